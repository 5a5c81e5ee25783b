"""How likely a violation is, against the physical quantity that its threshold is about.

    python -m benchmarks.verdicts.sweeps --out DIR [--only slip,drop]
        [--values 13] [--seeds 400:405] [--put]

Events of each family (``safemanip faults`` lists them) are run from clearly safe to clearly
unsafe. The quantity is measured on what MuJoCo says of the rollout (``raw.py``) and not taken from
the plan, but for the edge, whose place the scene tells. ``--put`` writes the table into
docs/oracle.md, and the curves to docs/images/sweeps.png.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from benchmarks.options import add_seeds, some_of
from benchmarks.tables import put, table
from benchmarks.verdicts.labels import World
from benchmarks.verdicts.oracle import DOCUMENT, Runner
from benchmarks.verdicts.raw import Floats, Ints, Raw
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.fault import MARK, Family
from pytest_safemanip.faults.library import FAMILIES
from pytest_safemanip.judge import Judge
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

IMAGE = DOCUMENT.parent / "images" / "sweeps.png"
SECOND = 20
"""Control steps."""
LEAST_HELD = 5
"""Control steps for which something is held at least."""

Measure = Callable[[Raw, Recording], float | None]
"""The quantity in a rollout; None if it did not come to that."""


@dataclass(frozen=True)
class Axis:
    """What a family is drawn over.

    Attributes:
        label: with the unit.
        scale: what the threshold's own unit is in that of the axis.
        measure: the quantity, in the unit of the axis.
    """

    label: str
    scale: float
    measure: Measure


def _held(raw: Raw, name: str) -> tuple[int, Ints]:
    """Number of an object, and the steps at which both fingers press on it (K,)."""
    place = list(raw.objects).index(name)
    return place, np.flatnonzero(World(raw).held[:, place])


def _most(values: Floats, steps: Ints, apart: Callable[[Floats, Floats], Floats]) -> float:
    """Largest difference of two values within a second."""
    found = [0.0]
    for k, step in enumerate(steps):
        later = slice(k, np.searchsorted(steps, step + SECOND, "right"))
        found.append(float(apart(values[k], values[later]).max()))
    return max(found)


def _slid(raw: Raw, recording: Recording) -> float | None:
    place, steps = _held(raw, "obj")
    steps = np.flatnonzero(
        World(raw).handled[:, place] & (np.arange(len(raw.com)) >= steps[:1].sum())
    )
    if len(steps) < LEAST_HELD or steps[-1] < len(raw.com) - 1:
        return None  # it was never held, or fell out of the hand
    way = raw.com[steps, place] - raw.hand[steps, :3]
    local = _turns(raw.hand[steps, 3:]).inv().apply(way)
    return 1000.0 * _most(local, steps, lambda a, b: np.linalg.norm(b - a, axis=-1))


def _swung(raw: Raw, recording: Recording) -> float | None:
    place, steps = _held(raw, "obj")
    if len(steps) < LEAST_HELD:
        return None
    turns = (_turns(raw.hand[steps, 3:]).inv() * _turns(raw.turn[steps, place])).as_quat()

    def apart(one: Floats, others: Floats) -> Floats:
        alike = np.clip(np.abs(others @ one), 0.0, 1.0)
        return np.asarray(np.rad2deg(2.0 * np.arccos(alike)), np.float64)

    return _most(turns, steps, apart)


def _tipped(raw: Raw, recording: Recording) -> float | None:
    place, steps = _held(raw, "obj2")
    if len(steps) < LEAST_HELD:
        return None
    up = _turns(raw.turn[0, place]).inv().apply((0.0, 0.0, 1.0))
    lean = _turns(raw.turn[steps, place]).apply(up)[:, 2]
    return float(np.rad2deg(np.arccos(np.clip(lean, -1.0, 1.0))).max())


def _pressed(raw: Raw, recording: Recording) -> float | None:
    place, steps = _held(raw, "obj")
    block = list(raw.objects).index("distr_counter")
    both = np.sort(raw.owner[raw.pressed[:, 1:]], axis=1) == sorted((place, block))
    mine = both.all(axis=1) & np.isin(raw.pressed[:, 0], steps)
    return float(raw.newtons[mine].max()) if mine.any() else 0.0 if len(steps) else None


def _fell(raw: Raw, recording: Recording) -> float | None:
    place, steps = _held(raw, "obj")
    if len(steps) < LEAST_HELD or steps[-1] == len(raw.com) - 1:
        return None
    return 1000.0 * float(raw.com[steps[-1], place, 2] - raw.com[-1, place, 2])


def _behind_edge(raw: Raw, recording: Recording) -> float | None:
    _, steps = _held(raw, "obj")
    if len(steps) < LEAST_HELD:
        return None
    step = next(step for k, (step, *_) in enumerate(recording.steps) if k == steps[-1])
    arm = Arm(recording.scene, step)
    return 1000.0 * (arm.ahead(Thing(arm, "obj").com) - counter(arm, "counter")[1])


def _open(raw: Raw, recording: Recording) -> float | None:
    cabinet = recording.scene.roles["cab"]
    own = {int(j) for j, name in zip(raw.moved_by, raw.names, strict=True) if cabinet in name}
    doors = sorted(own - {-1})
    share: Floats = np.abs(raw.joints[:, doors]).max(axis=1) / raw.ranges[doors].max()
    return 100.0 * float(share[raw.hand[:, :2].shape[0] - 1])


def _turns(quaternions: Floats) -> Rotation:
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1))


AXES: Mapping[str, Axis] = {
    "slip": Axis("slid in the hand within 1 s, mm", 1000.0, _slid),
    "swing": Axis("turned in the hand within 1 s, degrees", float(np.rad2deg(1.0)), _swung),
    "tilt": Axis("tipped, degrees", float(np.rad2deg(1.0)), _tipped),
    "knock": Axis("held object on a block, N", 1.0, _pressed),
    "drop": Axis("fell after the fingers let go, mm", 1000.0, _fell),
    "edge": Axis("centre of mass behind the edge, mm", 1000.0, _behind_edge),
    "ajar": Axis("cabinet open, %", 100.0, _open),
}


@dataclass(frozen=True)
class Sweep:
    """The rollouts of a family.

    Attributes:
        family: which.
        x: the quantity (K,).
        flagged: whether the property was violated (K,).
        lost: rollouts in which it did not come to that.
        threshold: in the unit of ``x``.
    """

    family: Family
    x: Floats
    flagged: Floats
    lost: int
    threshold: float

    @property
    def sign(self) -> float:
        """1 if more is less safe, else -1."""
        return -1.0 if self.family.low > self.family.high else 1.0

    def ends(self) -> tuple[float, float]:
        """The least safe that was not flagged, and the safest that was."""
        less_safe, flagged = self.sign * self.x, self.flagged.astype(bool)
        return (
            self.sign * float(less_safe[~flagged].max(initial=-np.inf)),
            self.sign * float(less_safe[flagged].min(initial=np.inf)),
        )

    def fit(self) -> tuple[float, float]:
        """Where a violation is as likely as not, and from there to where it is in 9 of 10 cases.

        The maximum of the likelihood of a logistic curve; where the classes are apart, its middle
        is in the gap between them.
        """
        sign, spread = self.sign, float(np.ptp(self.x)) or 1.0
        least = 1e-3 * spread

        def loss(p: Floats) -> float:
            z = sign * (self.x - p[0]) / (abs(p[1]) + least)
            return float(np.logaddexp(0.0, np.where(self.flagged, -z, z)).sum())

        starts = [
            (m, w * spread) for m in np.quantile(self.x, (0.3, 0.5, 0.7)) for w in (0.01, 0.1)
        ]
        found = [minimize(loss, start, method="Nelder-Mead") for start in starts]
        middle, width = min(found, key=lambda f: float(f.fun)).x
        return float(middle), float(np.log(9.0) * (abs(width) + least))

    def wrong(self) -> int:
        """Rollouts on the other side of the threshold than what was said."""
        beyond = self.sign * self.x > self.sign * self.threshold
        return int((beyond != self.flagged.astype(bool)).sum())


def sweep(
    family: Family, runner: Runner, definitions: Definitions, values: int, seeds: Sequence[int]
) -> Sweep:
    """Run a family's events, and judge and measure each."""
    parameters = definitions.catalogue.parameters({})
    x, flagged, lost = [], [], 0
    for value in np.linspace(family.low, family.high, values):
        policy = resolve(f"scripted:{family.name}{MARK}{value:.4g}", {})
        (task,) = policy.tasks or ()
        for seed in seeds:
            path = runner.run(policy, task, seed)
            recording, raw = files.load(path), Raw.load(path.with_suffix(".npz"))
            found = AXES[family.name].measure(raw, recording)
            if found is None:
                lost += 1
                continue
            judge = Judge(
                recording,
                definitions.tasks[task],
                definitions.attributes,
                definitions.catalogue,
                parameters,
            )
            x.append(found)
            flagged.append(bool(judge.judge(definitions.properties[family.property_id]).findings))
    threshold = parameters[family.parameter] * AXES[family.name].scale
    return Sweep(family, np.array(x), np.array(flagged, float), lost, threshold)


def draw(sweeps: Sequence[Sweep]) -> None:
    """The curves, with the share of bins of rollouts and the threshold."""
    from matplotlib.figure import Figure

    columns = 3
    rows = -(-len(sweeps) // columns)
    figure = Figure(figsize=(4.0 * columns, 2.7 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, found in zip(grid.flat, sweeps, strict=False):
        middle, width = found.fit()
        x = np.linspace(found.x.min(), found.x.max(), 300)
        z = found.sign * (x - middle) / width * np.log(9.0)
        axes.plot(x, 1.0 / (1.0 + np.exp(-np.clip(z, -60, 60))), color="C0")
        axes.axvline(found.threshold, color="black", linestyle="--", linewidth=1)
        jitter = np.random.default_rng(0).uniform(-0.03, 0.03, len(found.x))
        axes.plot(found.x, found.flagged + jitter, "|", color="C1", markersize=7)
        axes.set_xlabel(AXES[found.family.name].label)
        axes.set_title(f"{found.family.parameter} ({found.family.property_id})", fontsize=9)
        axes.set_ylim(-0.08, 1.08)
        axes.set_ylabel("violated")
    for axes in grid.flat[len(sweeps) :]:
        axes.remove()
    figure.savefig(IMAGE, dpi=90)


def line(found: Sweep) -> list[str]:
    """A line of the table."""
    return [
        f"`{found.family.name}`",
        found.family.property_id,
        f"`{found.family.parameter}`",
        AXES[found.family.name].label,
        str(len(found.x)),
        str(found.lost),
        f"{found.threshold:.3g}",
        f"{found.fit()[0]:.3g}" if np.isfinite(found.ends()).all() else "-",
        *(f"{end:.3g}" if np.isfinite(end) else "-" for end in found.ends()),
        str(found.wrong()),
    ]


HEAD = [
    "family",
    "property",
    "threshold",
    "measured",
    "rollouts",
    "did not come about",
    "at",
    "50 %",
    "not flagged to",
    "flagged from",
    "on the other side",
]


def main() -> None:
    """Roll out, measure, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of recordings; what is there is kept"
    )
    parser.add_argument(
        "--only",
        type=some_of(AXES),
        default=",".join(AXES),
        help="families, with commas (default: all, %(default)s)",
    )
    parser.add_argument(
        "--values", type=int, default=13, help="amounts of each family (default: %(default)s)"
    )
    add_seeds(parser, "400:405")
    parser.add_argument(
        "--put",
        action="store_true",
        help=f"write table and curves into {DOCUMENT.name} and {IMAGE.name}",
    )
    options = parser.parse_args()
    if options.values < 2:
        parser.error("--values: two at least, a family's first and last")
    definitions = load_definitions([], [], [])
    runner = Runner(options.out, definitions)
    found = [
        sweep(FAMILIES[name], runner, definitions, options.values, options.seeds)
        for name in options.only
    ]
    text = table(HEAD, [line(each) for each in found])
    print(text)
    if options.put:
        put(DOCUMENT, "sweeps", text)
        draw(found)


if __name__ == "__main__":
    main()
