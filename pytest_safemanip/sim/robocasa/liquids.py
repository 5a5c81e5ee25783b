"""Liquids in RoboCasa's kitchens: small balls that a vessel is filled with before an episode."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError, TaskError
from pytest_safemanip.sim.mujoco.describing import radius_of
from pytest_safemanip.sim.staging import Change, Fill
from pytest_safemanip.trace.elements import Body, Entity, Liquid
from pytest_safemanip.trace.geometry import corners

Floats = NDArray[np.float64]

_NAME = re.compile(r"liquid/(\w+)/(\d+)")
"""Names of the bodies."""
DENSITY = 1000.0
"""Of water, kg/m3."""
_FRICTION = "0.3 0.0005 0.0005"
"""Sliding, spinning and rolling: with less of any they take long to come to rest, and what moves is
computed; with more they heap up."""
_SOLREF = "0.004 1"
"""As stiff as RoboCasa's time step allows: what falls from 10 cm must not get through a thin floor.
"""
_WAITING = (60.0, 60.0, 1.0)
"""Where they are until the vessel stands, m: far from everything."""
_SPACING = 2.1
"""Distance of their centres when they are let go, in radii."""
_SHIFT = 0.3
"""Of the layers from the middle, in radii."""
_RAYS = 25
"""Along each side of a vessel's box, to find where it is hollow."""
_DEEP = 0.4
"""Share of its height that a vessel is hollow down to: a plate is not."""


def fills_of(changes: Sequence[Change]) -> list[Fill]:
    """Those of the changes of an episode that fill vessels.

    Raises:
        TaskError: if two are of one liquid.
    """
    found = [change for change in changes if isinstance(change, Fill)]
    names = [fill.liquid for fill in found]
    for name in names:
        if names.count(name) > 1:
            raise TaskError(f"two vessels are filled with the liquid {name!r}; name them apart")
    return found


def with_particles(model: str, fills: Sequence[Fill]) -> str:
    """The XML of a model with the particles of liquids in it, far from everything."""
    root = ElementTree.fromstring(model)  # noqa: S314 -- RoboCasa's own
    world = root.find("worldbody")
    if world is None:
        raise RolloutError("RoboCasa's model has no worldbody to put particles into")
    x, y, z = _WAITING
    for row, fill in enumerate(fills):
        mass = DENSITY * 4.0 / 3.0 * np.pi * fill.radius**3
        for number in range(fill.count):
            name, place = (
                f"liquid/{fill.liquid}/{number}",
                f"{x + 0.1 * number} {y + row} {z}",
            )
            body = ElementTree.SubElement(world, "body", name=name, pos=place)
            ElementTree.SubElement(body, "freejoint", name=name)
            # RoboCasa's models take inertia from what is not drawn only.
            ElementTree.SubElement(
                body,
                "inertial",
                pos="0 0 0",
                mass=f"{mass:.6g}",
                diaginertia=" ".join([f"{0.4 * mass * fill.radius**2:.6g}"] * 3),
            )
            ElementTree.SubElement(
                body,
                "geom",
                name=name,
                type="sphere",
                size=f"{fill.radius}",
                friction=_FRICTION,
                condim="6",
                priority="1",
                solref=_SOLREF,
                group="1",
                rgba="0.35 0.55 0.9 0.8",
            )
    return ElementTree.tostring(root, encoding="unicode")


def particles_of(model: Any) -> dict[str, list[int]]:
    """Body ids of the particles of each liquid of a model."""
    found: dict[str, dict[int, int]] = {}
    for body in range(model.nbody):
        match = _NAME.fullmatch(model.body(body).name)
        if match:
            found.setdefault(match[1], {})[int(match[2])] = body
    return {name: [own[number] for number in sorted(own)] for name, own in found.items()}


def liquids_in(model: Any) -> tuple[tuple[Entity, ...], tuple[Liquid, ...], NDArray[np.intp]]:
    """The liquids of a model, as entities, by their particles, and these particles' body ids."""
    particles = particles_of(model)
    entities = tuple(Entity(name, "liquid", name) for name in particles)
    liquids = tuple(
        Liquid(name, len(own), radius_of(model, own[0])) for name, own in particles.items()
    )
    ids = [body for own in particles.values() for body in own]
    return entities, liquids, np.array(ids, np.intp)


def fill(env: Any, change: Fill, vessel: Body, pose: Floats) -> None:
    """Let the particles of a liquid go inside a vessel that stands upright.

    Args:
        env: a RoboCasa environment whose model has them.
        change: which liquid.
        vessel: the object that is filled.
        pose: its pose (7,).

    Raises:
        TaskError: if it has no hollow, or one too small for them.
    """
    env.sim.forward()
    hollow = _hollow(env.sim, env.objects[change.role].root_body, vessel, pose)
    places = np.zeros((0, 3)) if hollow is None else _places(hollow, change.radius)
    if not len(places):
        raise TaskError(f"{change.role!r} is not hollow; {change.liquid!r} cannot be filled in")
    if len(places) < change.count:
        raise TaskError(
            f"{change.role!r} holds {len(places)} balls of {change.radius:g} m, not the "
            f"{change.count} of {change.liquid!r}; fill in fewer or smaller ones"
        )
    data = env.sim.data
    for number, place in enumerate(places[: change.count]):
        name = f"liquid/{change.liquid}/{number}"
        data.set_joint_qpos(name, np.array((*place, 1.0, 0.0, 0.0, 0.0)))
        data.set_joint_qvel(name, np.zeros(6))


@dataclass(frozen=True)
class _Hollow:
    """The widest upright cylinder in a vessel that is open above, m."""

    axis: Floats
    radius: float
    floor: float
    rim: float


def _hollow(sim: Any, name: str, vessel: Body, pose: Floats) -> _Hollow | None:
    """Found by rays straight down from the rim: deep where the vessel is hollow."""
    model, data = sim.model._model, sim.data._data
    own = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    points = corners(pose, vessel.half, vessel.centre)
    low, high = points.min(axis=0), points.max(axis=0)
    grid = [np.linspace(low[k], high[k], _RAYS) for k in range(2)]
    across = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    down, hit, solid = (
        np.array((0.0, 0.0, -1.0)),
        np.zeros(1, np.int32),
        np.eye(6, dtype=np.uint8)[0],
    )
    depth = np.zeros(len(across))
    for row, place in enumerate(across):
        start = np.append(place, high[2])
        far = mujoco.mj_ray(model, data, start, down, solid, 1, -1, hit)
        if hit[0] >= 0 and model.body_rootid[model.geom_bodyid[hit[0]]] == own:
            depth[row] = far
    deep = depth > _DEEP * (high[2] - low[2])
    if not deep.any() or deep.all():
        return None
    between = np.linalg.norm(across[deep][:, None] - across[~deep], axis=-1).min(axis=1)
    widest = int(np.argmax(between))
    axis, radius = across[deep][widest], float(between[widest])
    covered = np.linalg.norm(across - axis, axis=1) < radius
    return _Hollow(axis, radius, float(high[2] - depth[covered].min()), float(high[2]))


def _places(hollow: _Hollow, radius: float) -> Floats:
    """Places of balls in a hollow that do not touch, layer upon layer (K, 3).

    Every other layer is shifted, so that no ball balances on another.
    """
    spacing = _SPACING * radius
    layers = np.arange(hollow.floor + radius, hollow.rim - radius, spacing)
    reach = np.arange(-int(hollow.radius / spacing) - 1, int(hollow.radius / spacing) + 2) * spacing
    found = []
    for number, height in enumerate(layers):
        shift = _SHIFT * radius * (-1) ** number
        level = np.array([(x + shift, y + shift / 2.0) for x in reach for y in reach])
        away = np.linalg.norm(level, axis=1)
        inner = np.argsort(away, kind="stable")
        fits = level[inner][away[inner] <= hollow.radius - radius]
        found.append(np.column_stack((fits + hollow.axis, np.full(len(fits), height))))
    return np.concatenate(found) if found else np.zeros((0, 3))
