"""Clones the scripted expert: small networks for each task, from its recordings.

    python train.py expert/recordings --epochs 2,10,40,160

It learns from the expert as it is and from the expert that is shaken; see ``shaken.py``.

A checkpoint is one file of arrays with the weights of all tasks' networks.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np
from features import MODE, SWITCHES, Features, Floats, scaled, switch
from policy import NETWORKS
from shaken import shakes
from sklearn.neural_network import MLPClassifier, MLPRegressor

from pytest_safemanip.trace import files
from pytest_safemanip.trace.geometry import matrix

HIDDEN = (128, 128)
BLUR = 0.1
"""Of an observation, as a share of its standard deviation."""


def samples(path: Path) -> tuple[str, Floats, Floats]:
    """Task, observations (K, 55) and what was done (K, 12) in a rollout; none of one that failed.

    What was done is the action; of the base's motion, commands being jerky, where it led to.
    """
    recording = files.load(path)
    steps, seen, done, where = list(recording.steps), [], [], []
    episode = recording.episode
    shaken = shakes(episode.seed, len(steps)).any(axis=1) & (episode.policy == "shaken")
    features = Features(recording.scene, steps[0][0])
    for index, (_, action, acting) in enumerate(steps[1:]):
        if not acting or not recording.success:
            break
        told = np.asarray(action, np.float64)
        if not shaken[index]:
            seen.append(features(steps[index][0]))
            done.append(told)
            where.append(np.asarray(steps[index][0].base_pose, np.float64))
        features.memory.told(told)
    if done:
        _lead_on(np.array(where), done)
    return episode.task, np.array(seen), np.array(done)


def _lead_on(where: Floats, done: list[Floats]) -> None:
    """Write into actions in which the base moves, instead of commands, where it is from there when
    the arm moves next: forward and left, m, and degrees to the left.

    Args:
        where: poses of the base (K, 7).
        done: actions (12,), which are changed.
    """
    end = where[-1]
    for pose, action in zip(where[::-1], done[::-1], strict=True):
        if action[MODE] < 0.0:
            end = pose
            continue
        frame, then = matrix(pose[3:]), matrix(end[3:])
        turned = (frame.T @ then)[:2, 0]
        action[7:9] = (frame.T @ (end[:3] - pose[:3]))[:2]
        action[9] = np.degrees(np.arctan2(turned[1], turned[0]))


class Networks:
    """The networks of a task.

    Args:
        seen: observations (K, 55).
        done: actions (K, 12).
        longest: control steps of the longest rollout.
    """

    def __init__(self, seen: Floats, done: Floats, longest: int) -> None:
        self.middle, self.spread = seen.mean(axis=0), seen.std(axis=0)
        self._longest, self._random = longest, np.random.default_rng(0)
        chosen = switch(done)
        arm = chosen < 3
        same = {"hidden_layer_sizes": HIDDEN, "batch_size": 128, "random_state": 0, "alpha": 0.05}
        self.own = {
            "arm": (MLPRegressor(**same), seen[arm], done[arm, :6]),
            "base": (MLPRegressor(**same), seen[~arm], done[~arm, 7:10]),
            "switch": (MLPClassifier(**same), seen, chosen),
        }

    def learn(self) -> None:
        """Go through the data once, blurred: to know what to do a little beside it, too."""
        for name, (network, seen, done) in self.own.items():
            clear = scaled(seen, self.middle, self.spread)
            blurred = clear + self._random.normal(0.0, BLUR, clear.shape)
            more = {"classes": np.arange(SWITCHES)} if name == "switch" else {}
            network.partial_fit(blurred, done, **more)

    def arrays(self) -> dict[str, Floats]:
        """Copies of what is learnt: it goes on in the same arrays."""
        found = {"middle": self.middle, "spread": self.spread, "longest": np.array(self._longest)}
        for name in NETWORKS:
            network = self.own[name][0]
            for layer, (w, b) in enumerate(zip(network.coefs_, network.intercepts_, strict=True)):
                found[f"{name}/w{layer}"], found[f"{name}/b{layer}"] = w.copy(), b.copy()
        return found


def read_epochs(text: str) -> list[int]:
    """Numbers of epochs, with commas between them.

    Raises:
        argparse.ArgumentTypeError: if they are none.
    """
    parts = text.split(",")
    if not all(part.isascii() and part.isdigit() and int(part) for part in parts):
        raise argparse.ArgumentTypeError(f"expected numbers from 1 up, found {text!r}")
    return sorted({int(part) for part in parts})


def main() -> None:
    """Read, train, write a checkpoint after each of some epochs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, help="folder of .rollout files")
    parser.add_argument(
        "--epochs",
        type=read_epochs,
        metavar="N,N...",
        default="2,10,40,160",
        help="with a checkpoint after each (default: %(default)s)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("checkpoints"), help="default: %(default)s"
    )
    options = parser.parse_args()
    data: dict[str, list[tuple[Floats, Floats]]] = defaultdict(list)
    for path in sorted(options.recordings.glob(f"*{files.SUFFIX}")):
        task, seen, done = samples(path)
        if len(seen):
            data[task].append((seen, done))
    if not data:
        parser.error(f"there is no recording to learn from in {options.recordings}")
    checkpoints: dict[int, dict[str, Floats]] = {epoch: {} for epoch in options.epochs}
    for task, rollouts in data.items():
        seen, done = (np.concatenate(arrays) for arrays in zip(*rollouts, strict=True))
        networks = Networks(seen, done, max(len(own) for own, _ in rollouts))
        for epoch in range(1, options.epochs[-1] + 1):
            networks.learn()
            if epoch in checkpoints:
                own = networks.arrays()
                checkpoints[epoch] |= {f"{task}/{key}": array for key, array in own.items()}
        losses = ", ".join(f"{name} {own[0].loss_:.4f}" for name, own in networks.own.items())
        print(f"{task}: {len(rollouts)} rollouts, {len(seen)} steps, loss: {losses}", flush=True)
    options.out.mkdir(exist_ok=True)
    for epoch, arrays in checkpoints.items():
        np.savez(options.out / f"epoch_{epoch}.npz", **arrays)


if __name__ == "__main__":
    main()
