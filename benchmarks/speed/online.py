"""What it costs to watch properties while a rollout runs: 8 objects, 6 fixtures, 10 properties, and
all packs beside them; and what `SafetyMonitor` adds to a control step of RoboCasa's environment of
one task, and of robosuite's Lift, without images and with them.

    python -m benchmarks.speed.online

The rollout is the scripted expert's PickPlaceCounterToCabinet in the compact scene, with its
objects and its cabinet copied to other places. The reference is a control step of that task in
that scene, simulated in its own process, its contacts read at every substep, and recorded. The
environment that `SafetyMonitor` watches is stepped by robosuite's own loop, in this process, and
CPU time is measured, for which BLAS should have one thread (OPENBLAS_NUM_THREADS=1).
"""

from __future__ import annotations

import dataclasses
import platform
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import gymnasium
import numpy as np

from pytest_safemanip import SafetyMonitor
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.live import LiveJudge
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.run.cases import select_properties
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.sim.backend import Options, Request
from pytest_safemanip.sim.mujoco import graphics
from pytest_safemanip.sim.mujoco.drawing import Painter
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.sim.robocasa.rendering.observing import Observer
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.sim.robosuite import environment as robosuite_environment
from pytest_safemanip.sim.robosuite.robots import IMAGE_SIZE
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace import Recording
from pytest_safemanip.trace.scene import Scene

TASK = "PickPlaceCounterToCabinet"
OBJECTS, FIXTURES, ROUNDS = 8, 6, 3
TOGETHER = (1, 5, 20, 40)
"""Steps that are evaluated together."""
WATCHED = 200
"""Control steps of the environment that is watched."""
APART = 0.4
"""Metres between a thing and its copy."""


def recorded(out: Path) -> tuple[Recording, list[float]]:
    """A rollout, and the seconds of each of its control steps."""
    backend, seconds = create(Options("primitive", out)), []

    class Timed:
        spec, provenance = backend.spec, backend.provenance
        reset, observe, close = backend.reset, backend.observe, backend.close

        def step(self, action: Any) -> Any:
            start = time.perf_counter()
            step = backend.step(action)
            seconds.append(time.perf_counter() - start)
            return step

    job = rollout.Job(TASK, "scripted", Request(TASK, 0, "compact"), rollout.Protocol(), {})
    try:
        return rollout.run(job, Timed(), Scripted("")), seconds
    finally:
        backend.close()


def copies(recording: Recording) -> Recording:
    """The same rollout with as many objects and cabinets as wanted."""
    scene, steps = recording.scene, recording.steps
    cabinet = scene.roles["cab"]
    more: dict[str, Any] = {f: [*getattr(scene, f)] for f in LISTS}
    arrays = {name: [getattr(steps, name)] for name in ("object_pose", "object_twist", "joint")}
    boxes = [steps.box_pose]
    for n in range(OBJECTS - len(scene.bodies)):
        of = scene.bodies[n % len(scene.bodies)].entity
        add(scene, more, of, f"{of}_{n}")
        index = [scene.object_index[of]]
        arrays["object_pose"].append(moved(steps.object_pose[:, index], n + 1))
        arrays["object_twist"].append(steps.object_twist[:, index])
    for n in range(FIXTURES - 1):
        add(scene, more, cabinet, f"{cabinet}_{n}")
        arrays["joint"].append(steps.joint[:, scene.joints_of(cabinet)])
        own = [k for k, box in enumerate(scene.boxes) if box.entity == cabinet]
        boxes.append(moved(steps.box_pose[:, own], n + 1))
    more |= {field: tuple(items) for field, items in more.items()}
    scene = dataclasses.replace(scene, **more).checked()
    stacked = {name: np.concatenate(parts, axis=1) for name, parts in arrays.items()}
    stacked["box_pose"] = np.concatenate(boxes, axis=1)
    return Recording(recording.episode, scene, dataclasses.replace(steps, **stacked))


LISTS = ("entities", "bodies", "parts", "joints", "boxes", "surfaces")


def add(scene: Scene, more: dict[str, list[Any]], of: str, name: str) -> None:
    """Everything of an entity once more, under another name."""
    for field in LISTS:
        for item in getattr(scene, field):
            owner = "name" if field == "entities" else "entity"
            if getattr(item, owner) == of:
                changed = {owner: name}
                if getattr(item, "joint", ""):
                    changed["joint"] = item.joint.replace(of, name, 1)
                more[field].append(dataclasses.replace(item, **changed))


def moved(poses: Any, number: int) -> Any:
    """Poses (T, K, 7) beside where they were."""
    beside = (APART * number, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return poses + np.array(beside, np.float32)


def bound(scene: Scene) -> Binding:
    """All of it has a part to play."""
    objects = tuple(body.entity for body in scene.bodies)
    cabinets = tuple(dict.fromkeys(box.entity for box in scene.boxes if box.kind == "interior"))
    cabinets = tuple(f for f in cabinets if scene.doors_of(f))[:FIXTURES]
    counter = scene.roles["counter"]
    return Binding(
        objects=objects,
        enclosures=cabinets,
        exclusive_enclosures=cabinets,
        mechanisms=cabinets,
        placements=tuple((o, cabinets[n % len(cabinets)]) for n, o in enumerate(objects)),
        skills=(
            *(("pick", o) for o in objects),
            *(("place", o) for o in objects),
            *(("open", f) for f in cabinets),
        ),
        transfers=tuple((o, cabinets[0]) for o in objects),
        tools=("robot",),
        touch=frozenset((o, "body") for o in objects),
        supports={o: frozenset({counter, *cabinets}) for o in objects},
        attributes={objects[0]: frozenset({"raw"}), objects[1]: frozenset({"ready_to_eat"})},
    )


LABELLED = ("jam", "knife", "liquor", "candle", "egg", "apple", "digital_scale", "spray")
"""Categories that have every label among them."""


def labelled(scene: Scene, binding: Binding, defined: Definitions) -> Binding:
    """The same, with categories that rules of packs are about."""
    kinds = {entity.name: entity.category for entity in scene.entities}
    kinds |= dict(zip(binding.objects, LABELLED, strict=True))
    fixtures = tuple(entity.name for entity in scene.entities if entity.kind == "fixture")
    return dataclasses.replace(
        binding,
        things=binding.objects,
        obstacles=binding.objects[1:],
        fixtures=fixtures,
        kinds=kinds,
        attributes={
            name: defined.attributes.get(kind, frozenset()) for name, kind in kinds.items()
        },
    )


class Environment(gymnasium.Env[Any, Any]):
    """An environment of robosuite's, as a gym wrapper has it.

    Args:
        env: it.
        draw: draws what the wrapper shows.
    """

    observation_space = action_space = gymnasium.spaces.Dict()

    def __init__(self, env: Any, draw: Callable[[], Any] = dict) -> None:
        self.env, self._draw, self.draws_nothing = env, draw, draw is dict

    def reset(self, **_: Any) -> Any:
        """Leave it as it is."""
        return {}, {}

    def step(self, action: Any) -> Any:
        """Run one control period."""
        _, reward, done, info = self.env.step(action)
        return self._draw(), reward, done, False, info


def watched() -> None:
    """What `SafetyMonitor` adds to a step, without images and with them."""
    root = prepare_assets(loading.package_assets(), "primitive").root
    loading.load(root)
    context = graphics.open_context("")
    kitchen = environment.make(Request(TASK, 0, "compact"), root)
    lift = robosuite_environment.make(Request("Lift", 0, "robosuite"), ["Panda"])
    painter = Painter(lift.sim.model._model, context, IMAGE_SIZE)
    print(f"\n{'per control step, CPU time':<40}{'alone ms':>10}{'added ms':>10}{'share':>8}")
    for what, env, task, size in (
        (f"{TASK}, no images", Environment(kitchen), TASK, SPEC.robot.actions.size),
        (
            "the same, and RoboCasa's three images",
            Environment(kitchen, Observer(kitchen, context).observe),
            TASK,
            SPEC.robot.actions.size,
        ),
        ("Lift, no images", Environment(lift), "Lift", lift.action_dim),
        (
            "the same, and one image",
            Environment(lift, lambda: painter.take(lift.sim.data._data, "agentview")),
            "Lift",
            lift.action_dim,
        ),
    ):
        count = WATCHED if env.draws_nothing else WATCHED // 10
        actions = np.random.default_rng(0).uniform(-0.3, 0.3, (count, size))
        actions[:, -1] = -1.0  # in a kitchen the arm moves, not the base
        alone = cpu_times(env, actions)
        monitor = SafetyMonitor(env, task)
        monitor.reset()
        added = cpu_times(monitor, actions) - alone
        monitor._source.leave()
        print(f"{what:<40}{1e3 * alone:>10.2f}{1e3 * added:>10.2f}{added / alone:>8.1%}")


def cpu_times(env: Any, actions: Any) -> float:
    """Median CPU time of a step, s."""
    found = []
    for action in actions:
        start = time.process_time()
        env.step(action)
        found.append(time.process_time() - start)
    return median(found)


def judged(
    recording: Recording,
    binding: Binding,
    properties: Sequence[Property],
    catalogue: Catalogue,
    parameters: Mapping[str, float],
    every: int,
    then: Callable[[LiveJudge], object] = lambda judge: None,
    robust: bool = False,
) -> list[float]:
    """Seconds for each step of a rollout that is watched, ``every`` steps at a time."""
    seconds = []
    for _ in range(ROUNDS):
        judge = LiveJudge(
            recording.scene, binding, properties, catalogue, parameters, every=every, robust=robust
        )
        start = time.perf_counter()
        for count, (step, action, acting) in enumerate(recording.steps, 1):
            judge.step(step, action, acting)
            if count % every == 0:
                then(judge)
                seconds.append((time.perf_counter() - start) / every)
                start = time.perf_counter()
    return seconds


def main() -> None:
    """Measure and print."""
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}\n")
    with tempfile.TemporaryDirectory() as scratch:
        recording, simulated = recorded(Path(scratch))
    recording = copies(recording)
    defined = load_definitions([], [], [])
    chosen = select_properties(defined.properties, ())
    properties = [defined.properties[name] for name in sorted(chosen)]
    catalogue = defined.catalogue
    binding, parameters = bound(recording.scene), catalogue.parameters({})
    watched_by = (recording, binding, properties, catalogue, parameters)
    rows = {"a control step, simulated": simulated}
    for every in TOGETHER:
        rows[f"all propositions, {every} steps at a time"] = judged(*watched_by, every)
    rows[f"the same and margins, {TOGETHER[2]} at a time"] = judged(
        *watched_by, TOGETHER[2], LiveJudge.margins
    )
    rows[f"robustness too, {TOGETHER[2]} at a time"] = judged(*watched_by, TOGETHER[2], robust=True)
    rows["all propositions and warnings, 1 at a time"] = judged(*watched_by, 1, LiveJudge.warnings)
    with_packs = with_instances(defined, labelled(recording.scene, binding, defined))
    for every in TOGETHER[1:]:
        named = f"the packs too, {every} steps at a time"
        rows[named] = judged(recording, *with_packs, catalogue, parameters, every)
    reference = median(simulated)
    period = recording.scene.control_period
    print(f"{'per control step':<48}{'median us':>10}{'p95 us':>9}{'x step':>8}{'x period':>10}")
    for name, times in rows.items():
        high = quantiles(times, n=20)[-1]
        print(f"{name:<48}{1e6 * median(times):>10.0f}{1e6 * high:>9.0f}", end="")
        print(f"{median(times) / reference:>8.3f}{median(times) / period:>10.3f}")
    for those in ((binding, properties), with_packs):
        instances = sum(len(p.rows(those[0])) for p in those[1])
        calls = LiveJudge(recording.scene, *those, catalogue, parameters).calls
        print(f"\n{len(those[1])} properties, {instances} instances, {len(calls)} propositions")
    watched()


def with_instances(defined: Definitions, binding: Binding) -> tuple[Binding, list[Property]]:
    """Of all properties, the release's and the packs', those that have an instance."""
    return binding, [prop for prop in defined.properties.values() if prop.rows(binding)]


if __name__ == "__main__":
    main()
