"""Speed of the simulation, beside robosuite's own stepping and MuJoCo alone, in one run.

    python -m benchmarks.speed.simulation

One control step is 25 physics substeps. In every round each system runs the same actions from the
same state, one system after the other; MuJoCo alone replays the torques that the actions led to,
so that all of them simulate the same motion. The figures are medians over the rounds, of CPU time
(one thread), which other processes disturb less; resets are wall clock. After each round
the states must be equal bit for bit; if they are not, nothing is printed. Fast stepping is not
bit-identical, and what lies still sleeps in it: each round of it begins in the others' state, and
how far a joint of the robot is off at its end is printed. What RoboCasa asks at every step is
answered from memory (``sim/robocasa/patches/memo.py``) for robosuite's own stepping too.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

# As in the process that rollouts run in. numpy reads this when it is imported.
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.sleeping import Asleep
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.patches import registry
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper

TASK = "PickPlaceCounterToCabinet"
SCENES = ("compact", "target")
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
LATER_RESETS = 5
ROBOT = ("robot0_", "mobilebase0_", "gripper0_")

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """One way to run control steps.

    Attributes:
        name: as printed.
        env: whose state it changes.
        run: runs these actions (N, 12).
        exact: whether it has to end where all others do.
    """

    name: str
    env: Any
    run: Callable[[Floats], None]
    exact: bool = True

    def state(self) -> Floats:
        """All that decides how the simulation goes on."""
        model, data = self.env.sim.model._model, self.env.sim.data._data
        state = np.empty(mujoco.mj_stateSize(model, STATE))
        mujoco.mj_getState(model, data, state, STATE)
        return state

    def joints(self) -> Floats:
        """Positions of the robot's joints."""
        model = self.env.sim.model._model
        joints = [model.joint(n) for n in range(model.njnt)]
        at = [joint.qposadr[0] for joint in joints if joint.name.startswith(ROBOT)]
        positions: Floats = self.env.sim.data._data.qpos[at]
        return positions

    def begin(self, start: Floats, robot: Any) -> None:
        """Go to a state of MuJoCo's, and to what a robot's controllers know besides."""
        mujoco.mj_setState(self.env.sim.model._model, self.env.sim.data._data, start, STATE)
        own, other = (r.composite_controller.part_controllers for r in (self.env.robots[0], robot))
        own["right"].update_origin(other["right"].origin_pos, other["right"].origin_ori)
        for side, gripper in self.env.robots[0].gripper.items():
            gripper.current_action = robot.gripper[side].current_action.copy()


class Kitchens:
    """The systems of one scene, each on an environment of its own, all reset alike."""

    def __init__(self, assets_root: Path, scenes: str) -> None:
        def make() -> Any:
            return environment.make(Request(TASK, 0, scenes), assets_root)

        self._torques: list[Floats] = []
        self.leader = self._leader(make())
        self.timed = [
            self._physics(make()),
            self._stepping(make(), FastStepper),
            self._recording(make(), FastStepper),
            self._stepping(make(), Stepper),
            self._recording(make(), Stepper),
            self._stock(make()),
        ]
        self.off = 0.0
        model = self.leader.env.sim.model._model
        self.size = f"{model.ngeom} geoms, {model.nv} degrees of freedom"

    def round(self, actions: Floats) -> list[float]:
        """CPU seconds of each timed system for these actions.

        Raises:
            AssertionError: if they end in different states.
        """
        start = self.leader.state()
        self._torques.clear()
        self.leader.run(actions)
        seconds = []
        for system in self.timed:
            # The fixtures set the state of some of their parts themselves; MuJoCo alone does not.
            if not system.exact:
                system.begin(start, self.timed[-1].env.robots[0])
            began = time.process_time()
            system.run(actions)
            seconds.append(time.process_time() - began)
        for system in self.timed[1:]:
            if system.exact:
                assert np.array_equal(self.leader.state(), system.state()), f"{system.name} differs"
            else:
                off = np.abs(self.leader.joints() - system.joints()).max()
                self.off = max(self.off, float(off))
        return seconds

    def _leader(self, env: Any) -> System:
        """Notes the torques of every substep."""
        stepper = Stepper(env, lambda data: self._torques.append(data.ctrl.copy()))
        return System("", env, _each(stepper.step))

    def _physics(self, env: Any) -> System:
        model, data = env.sim.model._model, env.sim.data._data

        def run(_actions: Floats) -> None:
            for torques in self._torques:
                data.ctrl[:] = torques
                mujoco.mj_step(model, data)

        return System("MuJoCo alone (mj_step)", env, run, exact=False)

    def _stepping(self, env: Any, kind: type[Stepper]) -> System:
        run = _each(kind(env, lambda _: None).step)
        return System(f"{_NAMES[kind]} stepping alone", env, run, exact=kind is Stepper)

    def _recording(self, env: Any, kind: type[Stepper]) -> System:
        reader = open_reader(env)
        model = env.sim.model._model
        asleep = Asleep(model)
        sampler = ContactSampler(model, reader.description.table, asleep)
        stepper = (
            FastStepper(env, sampler.sample, asleep)
            if kind is FastStepper
            else Stepper(env, sampler.sample)
        )

        def step(action: Floats) -> None:
            stepper.step(action)
            reader.read(bool(env._check_success()), sampler.take())

        name = f"{_NAMES[kind]} stepping, contacts, reading"
        return System(name, env, _each(step), exact=kind is Stepper)

    def _stock(self, env: Any) -> System:
        return System("robosuite's env.step", env, _each(env.step))


_NAMES = {Stepper: "exact", FastStepper: "fast"}


def _each(step: Callable[[Floats], Any]) -> Callable[[Floats], None]:
    def run(actions: Floats) -> None:
        for action in actions:
            step(action.copy())

    return run


def random_actions(count: int, seed: int) -> Floats:
    """Arm and base in turn."""
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 12))
    actions[:, 11] = np.where(np.arange(count) % 12 < 8, -1.0, 1.0)
    return actions


def step_rows(kitchens: Kitchens, steps: int, rounds: int) -> list[tuple[str, float, float]]:
    """Name, milliseconds per control step, and times what MuJoCo alone takes."""
    kitchens.round(random_actions(2, seed=rounds))  # first calls cost more
    seconds = np.array([kitchens.round(random_actions(steps, seed)) for seed in range(rounds)])
    per_step = 1e3 * np.median(seconds, axis=0) / steps
    ratios = np.median(seconds / seconds[:, :1], axis=0)
    names = [system.name for system in kitchens.timed]
    return list(zip(names, per_step.tolist(), ratios.tolist(), strict=True))


def time_resets(scenes: str, count: int, *, stock: bool) -> list[float]:
    """Seconds of the first resets in this process, seeds 0, 1, ..."""
    if stock:
        registry.cache_yaml = lambda: None
    root = prepare()
    seconds = []
    for seed in range(count):
        began = time.perf_counter()
        environment.make(Request(TASK, seed, scenes), root)
        seconds.append(time.perf_counter() - began)
    return seconds


def resets_elsewhere(scenes: str, *, stock: bool) -> list[float]:
    """The same, measured in a fresh process."""
    job = json.dumps({"scenes": scenes, "count": 2 if stock else 1 + LATER_RESETS, "stock": stock})
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.speed.simulation", "--reset-job", job],
        check=True,
        stdout=subprocess.PIPE,
    )
    return [float(word) for word in done.stdout.split()]


def prepare() -> Path:
    """Load RoboCasa on the stand-in assets."""
    root = prepare_assets(loading.package_assets(), "primitive").root
    loading.load(root)
    mujoco.set_mju_user_warning(lambda _message: None)
    return root


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=20, help="control steps a round (20)")
    parser.add_argument("--rounds", type=int, default=15, help="rounds (15)")
    parser.add_argument(
        "--stock-reset",
        action="store_true",
        help="also time resets that parse RoboCasa's registries as it does itself",
    )
    parser.add_argument("--reset-job", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.reset_job:
        print(*time_resets(**json.loads(options.reset_job)))
        return
    root = prepare()
    print(
        f"Python {platform.python_version()}, numpy {np.__version__}, mujoco {mujoco.__version__}, "
        f"{platform.machine()}; {TASK}, {options.rounds} rounds of {options.steps} steps"
    )
    for scenes in SCENES:
        kitchens = Kitchens(root, scenes)
        rows = step_rows(kitchens, options.steps, options.rounds)
        print(f"\n{f'{scenes}: {kitchens.size}':<46}  ms/step   steps/s   x MuJoCo")
        for name, milliseconds, ratio in rows:
            print(f"{name:<46}{milliseconds:9.2f}{1e3 / milliseconds:10.1f}{ratio:11.2f}")
        print(f"fast: joints at most {kitchens.off:.1e} rad or m off after {options.steps} steps")
    print("\nexact: states after every round bit-identical to robosuite's env.step")
    print(f"\n{'reset':<46}  first s   later s (median)")
    for scenes in SCENES:
        for stock in (False, True) if options.stock_reset else (False,):
            first, *later = resets_elsewhere(scenes, stock=stock)
            name = f"{scenes}, registries parsed every time" if stock else scenes
            print(f"{name:<46}{first:9.2f}{median(later):10.2f}")


if __name__ == "__main__":
    main()
