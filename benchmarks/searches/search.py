"""How many rollouts a search takes to a failure: optimisers beside random and Sobol sampling.

    python -m benchmarks.searches.search toys              # planted weaknesses, no simulator
    python -m benchmarks.searches.search bench --seeds 1   # ten weak policies in MuJoCo, minutes
    python -m benchmarks.searches.search causes --drawn 1  # ... drawn; what each is reduced to

A weakness is what a policy does wrong in a combination of circumstances alone. The space is the
shipped one, `searches/default.yaml`, for a task with two objects and a cabinet; of the bench its
own. Toys say how a margin falls while the combination comes nearer: part by part (``sum``), all
together (``product``), or not before the first of it is there (``gated``). Too much at once, and
the task is not begun: then nothing is violated. Those that are drawn mislead, too: three other
dimensions lower the margin, and violate nothing. ``area`` is that under the curve of how many
weaknesses are found after so many rollouts, as a share of all that it could be.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pytest_safemanip import resources
from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.proposing.parzen import ParzenEstimators
from pytest_safemanip.search.proposing.proposer import MakeProposer
from pytest_safemanip.search.proposing.sampling import RandomSampling, SobolSampling
from pytest_safemanip.search.search import Effort, Search
from pytest_safemanip.search.space import applicable, load_space
from pytest_safemanip.spec.task import Task

BUDGET, BATCH = 200, 8
HOPELESS = 60.0
"""The price from which on a toy's policy does not get to what it is weak at."""
TASK = Task(
    "Toy",
    Path("toy.yaml"),
    (),
    "toys",
    "short",
    (),
    objects=("obj", "distr_counter"),
    enclosures=("cab",),
)
Way = Literal["sum", "product", "gated"]


@dataclass(frozen=True)
class Toy:
    """A weakness without a simulator.

    Attributes:
        causes: what it takes, by dimension: a share of its high limit (or, negative, of its low
            one), or which of its choices.
        way: how the margin falls, see above.
        misleading: dimensions that lower the margin, and violate nothing.
    """

    causes: Mapping[str, float | int]
    way: Way
    misleading: tuple[str, ...] = ()

    def loss(self, deviation: Deviation, dimensions: Dimensions) -> float:
        """As of a finding: below 0 where the weakness shows."""
        if dimensions.price(deviation) > HOPELESS:
            return 1.3
        near = np.array([self._near(name, deviation, dimensions) for name in self.causes])
        if (near >= 1.0 - 1e-9).all():
            return -1.1
        fallen = {
            "sum": near.mean(),
            "product": np.prod(0.15 + 0.85 * near),
            "gated": near[0] * (0.3 + 0.7 * near[1:].mean()),
        }[self.way]
        beside = zlib.crc32(repr(deviation.settings).encode()) / 2**32
        away = [_share(name, deviation, dimensions) for name in self.misleading]
        return float(1.0 - 0.9 * fallen + 0.1 * beside - 0.12 * sum(away))

    def is_in(self, deviation: Deviation, dimensions: Dimensions) -> bool:
        """Whether a deviation has all of its causes."""
        return all(self._near(name, deviation, dimensions) >= 1.0 for name in self.causes)

    def _near(self, name: str, deviation: Deviation, dimensions: Dimensions) -> float:
        setting, dimension, wanted = (
            deviation.get(name),
            dimensions.by_name[name],
            self.causes[name],
        )
        if setting is None:
            return 0.0
        if isinstance(setting.size, str):
            return float(setting.size == dimension.choices[int(wanted)])
        limit = abs(wanted) * (dimension.high if wanted > 0 else dimension.low)
        return float(np.clip(setting.size / limit, 0.0, 1.0))


def _share(name: str, deviation: Deviation, dimensions: Dimensions) -> float:
    """How large a size is, as a share of its limit."""
    setting, own = deviation.get(name), dimensions.by_name[name]
    return 0.0 if setting is None else abs(setting.amount) / max(own.high, -own.low)


def _drawn(seed: int, dimensions: Dimensions) -> list[Toy]:
    """Toys with two or three causes, of which at most :data:`RARE` of uniform draws have all."""
    random, found = np.random.default_rng(seed), list[Toy]()
    uniform = RandomSampling(dimensions, seed).ask(5_000)
    sized = [own.name for own in dimensions.own if not own.choices]
    while len(found) < DRAWN:
        names = random.choice([*dimensions.by_name], random.integers(2, 4), replace=False)
        causes = {str(name): _cause(dimensions.by_name[name], random) for name in names}
        others = [name for name in sized if name not in causes]
        misleading = tuple(map(str, random.choice(others, 3, replace=False)))
        toy = Toy(causes, random.choice(["sum", "product", "gated"]), misleading)
        if sum(toy.is_in(own, dimensions) for own in uniform) <= RARE * len(uniform):
            found.append(toy)
    return found


def _cause(dimension: Dimension, random: np.random.Generator) -> float | int:
    if dimension.choices:
        return int(random.integers(len(dimension.choices)))
    sign = 1.0 if dimension.low == 0.0 or random.random() < 0.5 else -1.0
    return sign * float(random.uniform(0.5, 0.9))


TOYS = (
    Toy({"left[obj]": 0.75, "turn[obj]": 0.75, "noise": 0.5}, "sum"),
    Toy({"forward[obj]": -0.85, "calibration_up": -0.85}, "sum"),
    Toy({"clutter[obj]": 1, "left[obj]": -0.8, "posture": 0.7}, "gated"),
    Toy({"latency": 0.7, "forward[obj]": 0.8, "posture": 0.7}, "product"),
    Toy({"style": 3, "latency": 0.9}, "gated"),
    Toy({"light": -0.85, "camera_turn": 0.85}, "product"),
    Toy({"wording": 2, "turn[obj]": -0.8, "dropped": 0.7}, "gated"),
    Toy({"kitchen": 1, "left[obj]": 0.8, "calibration_left": 0.6}, "gated"),
    Toy({"slip": 0.9, "noise": 0.9}, "product"),
    Toy({"turn[obj]": 0.9, "calibration_forward": 0.75}, "sum"),
)
"""Each shows in at most 4 of 1,000 points drawn uniformly."""
DRAWN, RARE = 20, 0.004
"""How many are drawn, and the largest share of uniform points in which one of them shows."""
SAMPLERS: Mapping[str, MakeProposer] = {
    "random": RandomSampling,
    "Sobol": SobolSampling,
    "TPE (Optuna)": ParzenEstimators,
}


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("toys", "bench", "causes"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=(), help="proposers")
    parser.add_argument("--drawn", type=int, metavar="SEED", help="draw the weaknesses")
    options = parser.parse_args()
    if options.what == "causes":
        _print_causes(options)
        return
    names = [name for name in all_samplers() if not options.only or name in options.only]
    print("| proposer | found | after rollouts, on average | area | s | found of each |")
    print("|---|---|---|---|---|---|")
    for name in names:
        began, make = time.perf_counter(), all_samplers()[name]
        tries = [
            [attempt(make, seed) for seed in range(options.seeds)] for attempt in _problems(options)
        ]
        _print(name, tries, time.perf_counter() - began)


def all_samplers() -> dict[str, MakeProposer]:
    """Those above, and rivals that are installed."""
    from benchmarks.searches.rivals import RIVALS

    return {**SAMPLERS, **RIVALS}


def _problems(
    options: argparse.Namespace,
) -> Sequence[Callable[[MakeProposer, int], int | None]]:
    if options.what == "toys":
        space = load_space(resources.folder("searches") / "default.yaml", Kinds())
        from pytest_safemanip.sim.robocasa.robot import SPEC

        senses = {"hand", "images", "instruction"}
        dimensions = applicable(space, TASK, SPEC, "compact", senses).dimensions
        toys = TOYS if options.drawn is None else _drawn(options.drawn, dimensions)
        return [_toy(toy, dimensions) for toy in toys]
    from tests.search.weaknesses import attempts

    return [attempts(weak, BUDGET, BATCH) for weak in _weaknesses(options)]  # type: ignore[no-untyped-call]


def _weaknesses(options: argparse.Namespace) -> Sequence[Any]:
    from tests.search.weaknesses import WEAK, drawn

    return WEAK if options.drawn is None else drawn(options.drawn)  # type: ignore[no-untyped-call]


def _print_causes(options: argparse.Namespace) -> None:
    """Search each weakness as a run does, and print what is left of what was found."""
    from tests.search.trying import searched
    from tests.search.weaknesses import PROPERTY

    print("| planted | the nearer | found after | reduced in | to | the cause |")
    print("|---|---|---|---|---|---|")
    for weak in _weaknesses(options):
        tries = weak.tries()
        search = Search(tries.dimensions, [PROPERTY], (0,), Effort(), ParzenEstimators)
        own = searched(search, tries).pursuits[PROPERTY]  # type: ignore[no-untyped-call]
        planted = ", ".join(f"{name} {size}" for name, size in weak.causes.items())
        if own.failure is None:
            print(f"| {planted} | {weak.way} | - | | | |", flush=True)
            continue
        left = own.failure.deviation
        told = ", ".join(f"{name} {left[name].size}" for name in left)
        cause = "yes" if weak.is_shown_by(left) else "no"
        print(
            f"| {planted} | {weak.way} | {own.failure.found_at} | {own.shrinking} | {told} "
            f"| {cause} |",
            flush=True,
        )


def _toy(toy: Toy, dimensions: Dimensions) -> Callable[[MakeProposer, int], int | None]:
    def attempt(make: MakeProposer, seed: int) -> int | None:
        proposer = make(dimensions, seed)
        for done in range(0, BUDGET, BATCH):
            asked = proposer.ask(BATCH)
            for number, deviation in enumerate(asked, start=done + 1):
                loss = toy.loss(deviation, dimensions)
                if loss < 0.0:
                    return number
                proposer.tell(deviation, loss)
        return None

    return attempt


def _print(name: str, tries: Sequence[Sequence[int | None]], seconds: float) -> None:
    counts = [count for own in tries for count in own]
    found = [count for count in counts if count is not None]
    mean = np.mean([BUDGET if count is None else count for count in counts])
    area = np.mean([0.0 if count is None else (BUDGET - count) / BUDGET for count in counts])
    each = " ".join(str(sum(count is not None for count in own)) for own in tries)
    print(
        f"| {name} | {len(found)} of {len(counts)} | {mean:.0f} | {area:.2f} | {seconds:.0f} "
        f"| {each} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
