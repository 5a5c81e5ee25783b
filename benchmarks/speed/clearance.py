"""Price and truth of asking what would be touched, beside rehearsing the same way by stepping.

    python -m benchmarks.speed.clearance [--rounds 15] [--ways 40]

A way of 20 control steps of the hand, 20 postures, is asked for, and rehearsed: the physics
are stepped through the same 20 actions, contacts sampled. Then ways over the counter are drawn at
random, foreseen and followed, each from the state after reset.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from statistics import median
from typing import Any

# As in the process that rollouts run in. numpy reads this when it is imported.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import mujoco
import numpy as np

from benchmarks.tables import table
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper
from tests.sim.stepping.following import Kitchen, drawn, way

TASK, POSTURES, TOUCH = "PickPlaceCounterToCabinet", 20, 5.0
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def prices(kitchen: Kitchen, rounds: int) -> list[tuple[str, float]]:
    """Milliseconds for 20 postures, of each way to know."""
    far = kitchen.pose(0.45, 0.5, 1.2, 20.0, 0.0)
    path, actions = way(far, steps=POSTURES), []
    action = np.zeros(12)
    action[:3], action[11] = (0.1, 0.5, -0.1), -1.0
    actions = [action] * POSTURES

    def rehearse(kind: type[Stepper]) -> Callable[[], Any]:
        stepper = kind(kitchen.env, lambda data: None)

        def run() -> None:
            for action in actions:
                stepper.step(action.copy())

        return run

    systems = {
        "clearance": lambda: kitchen.ask(path),
        "rehearsal, fast stepping": rehearse(FastStepper),
        "rehearsal, exact stepping": rehearse(Stepper),
    }
    kept = _state(kitchen)
    found: dict[str, list[float]] = {name: [] for name in systems}
    for _ in range(rounds + 1):
        for name, run in systems.items():
            began = time.process_time()
            run()
            found[name].append(1e3 * (time.process_time() - began))
            mujoco.mj_setState(kitchen.model, kitchen.env.sim.data._data, kept, STATE)
    return [(name, median(values[1:])) for name, values in found.items()]


def truth(kitchen: Kitchen, ways: int) -> dict[str, Any]:
    """How foreseen ways are followed."""
    kept = _state(kitchen)
    joints, elbows, kinds = [], [], {(a, b): 0 for a in (True, False) for b in (True, False)}
    for path in drawn(kitchen, ways, seed=1):
        mujoco.mj_setState(kitchen.model, kitchen.env.sim.data._data, kept, STATE)
        kitchen.env.sim.forward()
        kitchen.reset()
        answer = kitchen.ask(path)
        reached = kitchen.follow(path)
        kinds[answer.touch is None, reached.force <= TOUCH] += 1
        if answer.free and reached.force <= TOUCH:
            joints.append(float(np.abs(answer.joints - reached.joints).max()))
            elbows.append(float(np.linalg.norm(kitchen.elbow(answer.joints) - reached.elbow)))
    return {"joints": joints, "elbows": elbows, "kinds": kinds}


def _state(kitchen: Kitchen) -> Any:
    state = np.empty(mujoco.mj_stateSize(kitchen.model, STATE))
    mujoco.mj_getState(kitchen.model, kitchen.env.sim.data._data, state, STATE)
    return state


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="rounds (15)")
    parser.add_argument("--ways", type=int, default=40, help="ways that are followed (40)")
    options = parser.parse_args()
    root = prepare_assets(loading.package_assets(), "primitive").root
    loading.load(root)
    mujoco.set_mju_user_warning(lambda _message: None)
    print(f"mujoco {mujoco.__version__}, {platform.machine()}; {TASK}, {POSTURES} postures")
    rows, found = [], []
    for scenes in ("compact", "target"):
        kitchen = Kitchen(environment.make(Request(TASK, 0, scenes), root))
        first = prices(kitchen, options.rounds)
        for name, spent in first:
            ratio = f"{spent / first[0][1]:.1f}"
            rows.append((f"{scenes}, {kitchen.model.ngeom} geoms", name, f"{spent:.1f}", ratio))
        found.append(
            (scenes, truth(Kitchen(environment.make(Request(TASK, 0, scenes), root)), options.ways))
        )
    print(table(("scene", "way to know", "ms", "ratio"), rows))
    for scenes, about in found:
        kinds, joints, elbows = about["kinds"], about["joints"], np.multiply(1e3, about["elbows"])
        print(
            f"{scenes}: said to be free {kinds[True, True] + kinds[True, False]}, "
            f"of these touched with more than {TOUCH:g} N {kinds[True, False]}; "
            f"said to touch {kinds[False, True] + kinds[False, False]}, "
            f"of these did not {kinds[False, True]}; joints off by {median(joints):.3f} "
            f"(9 of 10 {np.percentile(joints, 90):.3f}, at most {max(joints):.3f}) rad, elbow by "
            f"{np.median(elbows):.0f} (9 of 10 {np.percentile(elbows, 90):.0f}, at most "
            f"{max(elbows):.0f}) mm"
        )


if __name__ == "__main__":
    main()
