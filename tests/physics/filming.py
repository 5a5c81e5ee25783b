"""From a script to recordings: the physics runs once, two cameras look at it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from pytest_safemanip.sim.mujoco import extents
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.robocasa import parts
from pytest_safemanip.sim.robocasa.robot import PANDA
from pytest_safemanip.trace.elements import (
    ActionEntry,
    Body,
    Box,
    Camera,
    Entity,
    Joint,
    Liquid,
    Switch,
)
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import SUSTAINED, Contacts, Step, Steps
from tests.physics.script import Script
from tests.physics.world import (
    BURNER,
    CAMERA,
    DOOR_TRAVEL,
    DROP,
    FINGER_OPEN,
    INTERIOR,
    TIMESTEP,
    WATER,
    Place,
    Solver,
    Thing,
    mjcf,
)

PERIODS = (0.05, 0.025)
"""Control periods of 20 Hz and of 40 Hz, s."""
BOXES = (INTERIOR, WATER, BURNER)
TAIL = 0.6
"""What the settle tail lasts, s."""
FIXTURES = {
    "floor": "Floor",
    "counter": "Counter",
    "cabinet": "HingeCabinet",
    "sink": "Sink",
    "stove": "Stove",
}
LIQUID = "water"


_USUAL = Solver()


@dataclass(frozen=True)
class Filmed:
    """Records one simulation at one rate."""

    scene: Scene
    sampler: ContactSampler
    every: int
    steps: list[Step]
    actions: list[np.ndarray]


def film(
    things: Sequence[Thing],
    script: Script,
    door: float = 0.0,
    solver: Solver = _USUAL,
    seconds: float = SUSTAINED,
    water: Sequence[Place] = (),
) -> dict[float, Recording]:
    """Run a script and its settle tail.

    Args:
        things: what is there.
        script: what the hand does.
        door: openness of the door at first.
        solver: how it is computed.
        seconds: over which forces are averaged.
        water: where its particles are at first.

    Returns:
        The same rollout by control period.
    """
    model = mujoco.MjModel.from_xml_string(mjcf(things, solver, water))
    data, commands = mujoco.MjData(model), script.commands
    acting = len(commands)
    # In the tail the hand holds still: the last command stays.
    commands = np.concatenate((commands, np.tile(commands[-1], (round(TAIL / TIMESTEP), 1))))
    data.qpos[[model.joint(j).qposadr[0] for j in ("x", "y", "z")]] = commands[0, :3]
    data.qpos[[model.joint(j).qposadr[0] for j in ("left", "right")]] = FINGER_OPEN
    data.joint("cabinet_doorhinge").qpos[0] = door * DOOR_TRAVEL
    look = Look(model, things, len(water))
    cameras = [look.camera(period, seconds) for period in PERIODS]
    for camera in cameras:
        camera.steps.append(look.step(data, commands[0]))
        camera.actions.append(np.zeros(1))
    for done, command in enumerate(commands, start=1):
        data.ctrl[:] = command[[0, 1, 2, 3, 4, 4]]
        for _ in range(solver.substeps):
            mujoco.mj_step(model, data)
            for camera in cameras:
                camera.sampler.sample(data)
        due = [camera for camera in cameras if done % camera.every == 0]
        state = look.step(data, command) if due else None
        for camera in due:
            told = _action(command).astype(np.float32)
            camera.steps.append(replace(state, commands=told, contacts=camera.sampler.take()))
            camera.actions.append(told)
    return {camera.scene.control_period: _recording(camera, acting) for camera in cameras}


class Look:
    """Reads the state of a model.

    Args:
        model: of the world.
        things: what is in it.
        drops: number of particles of water.
    """

    def __init__(self, model: mujoco.MjModel, things: Sequence[Thing], drops: int = 0) -> None:
        self._model, self._things = model, things
        self._drops = [model.body(f"{LIQUID}/{number}").id for number in range(drops)]
        self._bodies = [model.body(thing.name).id for thing in things]
        roots = {model.body(name).id: (name, False) for name in FIXTURES}
        roots |= {model.body(thing.name).id: (thing.name, True) for thing in things}
        self._table = parts.build(model, roots)
        self._scratch = mujoco.MjData(model)

    def camera(self, period: float, seconds: float) -> Filmed:
        """One that records every so many seconds, and averages forces over some."""
        sampler = ContactSampler(self._model, self._table, seconds=seconds)
        return Filmed(self._scene(period), sampler, round(period / TIMESTEP), [], [])

    def step(self, data: mujoco.MjData, command: np.ndarray) -> Step:
        """The present state, without contacts."""
        # What MuJoCo derives from a state is one substep behind it.
        d = self._scratch
        d.qpos[:], d.qvel[:] = data.qpos, data.qvel
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
            update(self._model, d)
        hand = self._model.body("gripper0_right_hand").id
        fingers = [d.joint(side) for side in ("left", "right")]
        door = d.joint("cabinet_doorhinge")
        floats = {
            "eef_poses": [self._pose(hand)],
            "eef_twists": [self._twist(hand)],
            "openings": [[sum(getattr(f, a)[0] for f in fingers) for a in ("qpos", "qvel")]]
            / np.array(2 * FINGER_OPEN),
            "commands": np.zeros(1),
            "base_pose": (0.0, -1.5, 0.0, 1.0, 0.0, 0.0, 0.0),
            "object_pose": [self._pose(body) for body in self._bodies],
            "object_twist": [self._twist(body) for body in self._bodies],
            "joint": [(door.qpos[0] / DOOR_TRAVEL, door.qvel[0] / DOOR_TRAVEL)],
            "box_pose": [(*centre, 1.0, 0.0, 0.0, 0.0) for _, centre in BOXES],
            "switch": command[6:],
            "camera_pose": [np.concatenate(CAMERA)],
            "particles": d.xpos[self._drops],
            "qpos": d.qpos,
            "qvel": d.qvel,
        }
        arrays = {name: np.array(value, np.float32) for name, value in floats.items()}
        return Step(**arrays, success=False, contacts=Contacts.empty())

    def _pose(self, body: int) -> np.ndarray:
        return np.concatenate((self._scratch.xpos[body], self._scratch.xquat[body]))

    def _twist(self, body: int) -> np.ndarray:
        spin_first = np.zeros(6)
        mujoco.mj_objectVelocity(
            self._model, self._scratch, mujoco.mjtObj.mjOBJ_XBODY, body, spin_first, 0
        )
        return spin_first[[3, 4, 5, 0, 1, 2]]

    def _scene(self, period: float) -> Scene:
        model, data = self._model, mujoco.MjData(self._model)
        mujoco.mj_kinematics(model, data)
        pose, half = extents.moving_box(model, data, model.body("cabinet_hingedoor").id)
        hinge = model.joint("cabinet_doorhinge").id
        grip = np.append(data.site("grip").xpos, (0.0, 0.0, 0.0, 0.0))
        mujoco.mju_mat2Quat(grip[3:], data.site("grip").xmat)
        hand = [
            geom
            for geom in range(model.ngeom)
            if model.geom(geom).name.startswith("gripper0_right_") and model.geom_contype[geom]
        ]
        grip_half, grip_centre = map(extents.vector, extents.box_around(model, data, grip, hand))
        liquids = (Liquid(LIQUID, len(self._drops), DROP),) if self._drops else ()
        names = [*FIXTURES, *(t.name for t in self._things), *(q.entity for q in liquids)]
        return Scene(
            control_period=period,
            entities=(
                Entity("robot", "robot", "Hand"),
                *(Entity(n, "room" if n == "floor" else "fixture", c) for n, c in FIXTURES.items()),
                *(Entity(t.name, "object", t.category) for t in self._things),
                *(Entity(liquid.entity, "liquid", LIQUID) for liquid in liquids),
            ),
            bodies=tuple(
                Body(t.name, t.half, (0.0, 0.0, 0.0), tuple(model.body(t.name).ipos), t.mass)
                for t in self._things
            ),
            parts=self._table.parts,
            joints=(
                Joint(
                    "cabinet",
                    "doorhinge",
                    "hinge",
                    gives_access=True,
                    axis=extents.vector(data.xaxis[hinge]),
                    anchor=extents.vector(data.xanchor[hinge]),
                    travel=DOOR_TRAVEL,
                    half=half,
                    pose=pose,
                ),
            ),
            boxes=(
                Box("cabinet", "shelf", "interior", INTERIOR[0]),
                Box("sink", "stream", "water", WATER[0]),
                Box("stove", "front", "burner", BURNER[0]),
            ),
            switches=(Switch("sink", "tap", "water"), Switch("stove", "front", "burner")),
            cameras=(Camera("right", 1.0, 4.0 / 3.0),),
            liquids=liquids,
            surfaces=tuple(extents.surfaces(model, data, self._table, set(FIXTURES))),
            grippers=(PANDA.in_scene(grip_half, grip_centre),),
            actions=(ActionEntry(PANDA.entry),),
            roles={name: name for name in names},
        ).checked()


def _action(command: np.ndarray) -> np.ndarray:
    return np.array((PANDA.opens if command[5] else PANDA.closes,))


def _recording(camera: Filmed, acting: int) -> Recording:
    length = 1 + acting // camera.every
    steps = Steps.stack(camera.steps, camera.actions, length)
    episode = Episode(
        task="Physics",
        seed=0,
        policy="script",
        instruction="do as the script says",
        horizon=length,
        ended="horizon",
        backend="tests",
        scenes="compact",
        stepping="exact",
        assets="primitive",
        versions={"mujoco": mujoco.__version__},
        hashes={},
        served={},
    )
    return check(Recording(episode, camera.scene, steps))
