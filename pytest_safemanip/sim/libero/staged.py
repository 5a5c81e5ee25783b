"""Changes how a LIBERO episode begins: things stand elsewhere, doors are open."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TaskError, did_you_mean
from pytest_safemanip.sim.mujoco.extents import local_box
from pytest_safemanip.sim.mujoco.layout import Layout, Region
from pytest_safemanip.sim.staging import Change, Fill, Push, Put, SetOpen, kind_of
from pytest_safemanip.trace.geometry import about, multiply, rotate, to_world

CLEARANCE = 0.002
"""Above what an object is put onto, m: it falls the rest."""

Floats = NDArray[np.float64]


def stage(env: Any, layout: Layout, changes: Iterable[Change]) -> None:
    """Change a scene that was just reset; it has to come to rest afterwards.

    Args:
        env: a LIBERO environment.
        layout: of its scene.
        changes: in their order; one may build on those before it.

    Raises:
        TaskError: if the scene has no such role, joint or interior.
    """
    for change in changes:
        env.sim.forward()
        if isinstance(change, SetOpen):
            _set_open(env, layout, change)
        elif isinstance(change, Put):
            _put(env, layout, change)
        else:
            kinds = {Fill: "filled with a liquid", Push: "set moving"}
            done = kinds.get(type(change), f"changed by {kind_of(change)!r}")
            raise TaskError(f"{getattr(change, 'role', 'LIBERO')}: in LIBERO nothing can be {done}")
    env.sim.forward()


def _set_open(env: Any, layout: Layout, change: SetOpen) -> None:
    fixture = _known(change.role, layout.fixtures, "fixture")
    prefix = f"{change.role}_"
    joints = {
        name: way
        for name, way in fixture.joints.items()
        if (name.removeprefix(prefix) == change.joint if change.joint else way.gives_access)
    }
    if not joints:
        names = [name.removeprefix(prefix) for name in fixture.joints]
        raise TaskError(f"{change.role} has no joint {change.joint!r}; it has {names}")
    for name, way in joints.items():
        where = way.closed + change.openness * (way.opened - way.closed)
        env.sim.data.set_joint_qpos(name, where)


def _put(env: Any, layout: Layout, change: Put) -> None:
    model, data = env.sim.model._model, env.sim.data._data
    thing = _known(change.role, layout.objects, "object")
    body = model.body(thing.body).id
    half, centre = local_box(model, data, body)
    joint = model.body_jntadr[body]
    address = model.jnt_qposadr[joint]
    pose = data.qpos[address : address + 7].copy()
    up = np.array([0.0, 0.0, 1.0])
    left = np.array([0.0, 1.0, 0.0])  # of the robot's base, which LIBERO never turns
    turns = about(up, np.deg2rad(change.turn[1])), about(left, np.deg2rad(change.turn[0]))
    pose[3:] = multiply(turns[0], multiply(turns[1], pose[3:]))
    below = _extent(pose[3:], half)
    at, floor = _target(env, layout, change)
    middle = np.array((*at[:2], floor + below + CLEARANCE)) + np.array(change.offset)
    pose[:3] = middle - rotate(pose[3:], centre)
    data.qpos[address : address + 7] = pose
    dof = model.jnt_dofadr[joint]
    data.qvel[dof : dof + 6] = 0.0


def _target(env: Any, layout: Layout, change: Put) -> tuple[Floats, float]:
    """Where an object is put: the middle of its place, and the height that it stands at."""
    model, data = env.sim.model._model, env.sim.data._data
    if change.relation == "in":
        fixture = _known(change.target, layout.fixtures, "fixture")
        interiors = fixture.interiors
        if not interiors or change.interior not in (*interiors, ""):
            raise TaskError(f"{change.target} has no interior {change.interior!r}")
        regions = [interiors[change.interior]] if change.interior else list(interiors.values())
        floors = [_floor(model, data, region) for region in regions if isinstance(region, Region)]
        return min(floors, key=lambda found: found[1])
    bodies = {name: thing.body for name, thing in layout.objects.items()}
    bodies |= {name: fixture.bodies[0] for name, fixture in layout.fixtures.items()}
    body = model.body(_known(change.target, bodies, "object or fixture")).id
    half, centre = local_box(model, data, body)
    frame = np.concatenate((data.xpos[body], data.xquat[body]))
    middle = to_world(frame, centre)
    reach = _extent(frame[3:], half)
    return middle, float(middle[2] + (reach if change.relation == "on" else -reach))


def _floor(model: Any, data: Any, region: Region) -> tuple[Floats, float]:
    """The middle of an interior, and the height of its floor."""
    body = model.body(region.body).id
    frame = np.concatenate((data.xpos[body], data.xquat[body]))
    turn = multiply(frame[3:], np.array(region.quat))
    middle = to_world(frame, region.centre)
    return middle, float(middle[2] - _extent(turn, np.array(region.half)))


def _extent(quat: Floats, half: Floats) -> float:
    """Half of the height of a box that is turned, m."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return float(np.abs(matrix.reshape(3, 3)[2]) @ half)


def _known(name: str, known: Any, what: str) -> Any:
    if name not in known:
        raise TaskError(f"the scene has no {what} {name!r}; {did_you_mean(name, known)}")
    return known[name]
