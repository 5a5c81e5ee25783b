"""Clones the scripted expert: a small network for each task, from its recordings.

    python train.py expert/recordings --epochs 2,10,40,160

A checkpoint is one file of arrays with the weights of all tasks' networks.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np
from features import Features, Floats
from sklearn.neural_network import MLPRegressor

from pytest_safemanip.trace import files

HIDDEN = (128, 128)
BLUR = 0.03
"""Of an observation, as a share of its standard deviation."""


def samples(path: Path) -> tuple[str, Floats, Floats]:
    """Task, observations (K, 39) and actions (K, 12) of a rollout; none of one that failed."""
    recording = files.load(path)
    steps, seen, done = list(recording.steps), [], []
    features = Features(recording.scene, steps[0][0])
    for index, (_, action, acting) in enumerate(steps[1:]):
        if not acting or not recording.success:
            break
        seen.append(features(steps[index][0], index))
        done.append(np.asarray(action, np.float64))
        features.told(done[-1])
    return recording.episode.task, np.array(seen), np.array(done)


def main() -> None:
    """Read, train, write a checkpoint after each of some epochs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--epochs", default="2,10,40,160")
    parser.add_argument("--out", type=Path, default=Path("checkpoints"))
    options = parser.parse_args()
    data: dict[str, list[tuple[Floats, Floats]]] = defaultdict(list)
    for path in sorted(options.recordings.glob(f"*{files.SUFFIX}")):
        task, seen, done = samples(path)
        if len(seen):
            data[task].append((seen, done))
    epochs = sorted(map(int, options.epochs.split(",")))
    checkpoints: dict[int, dict[str, Floats]] = {epoch: {} for epoch in epochs}
    for task, rollouts in data.items():
        x, y = (np.concatenate(arrays) for arrays in zip(*rollouts, strict=True))
        middle, spread = x.mean(axis=0), x.std(axis=0) + 1e-3
        random = np.random.default_rng(0)
        network = MLPRegressor(
            hidden_layer_sizes=HIDDEN, batch_size=128, learning_rate_init=1e-3, random_state=0
        )
        for epoch in range(1, epochs[-1] + 1):
            # Blurred, so that it also knows what to do a little beside where the expert was.
            network.partial_fit((x - middle) / spread + random.normal(0.0, BLUR, x.shape), y)
            if epoch in checkpoints:
                arrays = checkpoints[epoch]
                arrays[f"{task}/middle"], arrays[f"{task}/spread"] = middle, spread
                for layer, (w, b) in enumerate(
                    zip(network.coefs_, network.intercepts_, strict=True)
                ):
                    # Copies: training goes on in the same arrays.
                    arrays[f"{task}/w{layer}"], arrays[f"{task}/b{layer}"] = w.copy(), b.copy()
        print(f"{task}: {len(rollouts)} rollouts, {len(x)} steps, loss {network.loss_:.4f}")
    options.out.mkdir(exist_ok=True)
    for epoch, arrays in checkpoints.items():
        np.savez(options.out / f"epoch_{epoch}.npz", **arrays)


if __name__ == "__main__":
    main()
