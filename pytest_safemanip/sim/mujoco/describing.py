"""Reads the scene out of a compiled model, by its layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco import extents, parts
from pytest_safemanip.sim.mujoco.description import (
    Attached,
    Description,
    Hand,
    Read,
    camera_of,
    camera_place,
    find,
    geom_place,
    half_of_geom,
    half_of_site,
    site_place,
)
from pytest_safemanip.sim.mujoco.layout import ROOM, FixtureLayout, HandLayout, Layout, Region
from pytest_safemanip.sim.mujoco.parts import PartTable
from pytest_safemanip.trace.elements import (
    ROBOT,
    Body,
    Box,
    BoxKind,
    Entity,
    Gripper,
    Joint,
    Liquid,
    Part,
    Switch,
    Vector,
)
from pytest_safemanip.trace.geometry import to_local
from pytest_safemanip.trace.scene import Scene

_Place = tuple[int, NDArray[np.float64]]


def describe(
    model: Any, data: Any, layout: Layout, switches: Sequence[tuple[Switch, Read]] = ()
) -> Description:
    """Read a scene.

    Args:
        model: a ``mujoco.MjModel``.
        data: its ``MjData`` with kinematics and centres of mass up to date.
        layout: what is what in it.
        switches: those of its fixtures, each with what gives its state.

    Raises:
        ConfigError: if the layout names what the model does not have, or contradicts itself.
    """
    layout.check()
    table = _Owners(model, layout).table()
    joints = [
        (name, find(model, "joint", joint, f"fixture {name!r}"), way)
        for name, fixture in layout.fixtures.items()
        for joint, way in fixture.joints.items()
    ]
    closed = closed_kinematics(model, data, {joint: way.closed for _, joint, way in joints})
    found = [
        box for name, fixture in layout.fixtures.items() for box in _boxes(model, name, fixture)
    ]
    hands = tuple(_hand(model, hand) for hand in layout.robot.hands)
    cameras = {find(model, "camera", name): aspect for name, aspect in layout.cameras.items()}
    particles = {
        name: [find(model, "body", body, f"liquid {name!r}") for body in liquid.bodies]
        for name, liquid in layout.liquids.items()
    }
    has_room = any(part.entity == ROOM for part in table.parts)
    scene = Scene(
        control_period=layout.control_period,
        entities=(
            Entity(ROBOT, "robot", layout.robot.name),
            *(Entity(name, "object", thing.category) for name, thing in layout.objects.items()),
            *(
                Entity(name, "fixture", fixture.category, fixture.attributes)
                for name, fixture in layout.fixtures.items()
            ),
            *((Entity(ROOM, "room", ROOM),) if has_room else ()),
            *(Entity(name, "liquid", liquid.category) for name, liquid in layout.liquids.items()),
        ),
        bodies=tuple(
            _object(model, data, name, find(model, "body", thing.body, f"object {name!r}"))
            for name, thing in layout.objects.items()
        ),
        parts=table.parts,
        joints=tuple(
            joint_of(model, closed, name, joint, way.opened - way.closed, way.gives_access)
            for name, joint, way in joints
        ),
        boxes=tuple(box for box, _ in found),
        switches=tuple(switch for switch, _ in switches),
        surfaces=tuple(extents.surfaces(model, closed, table, {*layout.fixtures, ROOM})),
        grippers=tuple(
            _gripper(model, data, table, declared, hand)
            for declared, hand in zip(layout.robot.hands, hands, strict=True)
        ),
        actions=layout.actions,
        roles={
            **{name: name for name in (*layout.objects, *layout.fixtures, *layout.liquids)},
            **layout.roles,
        },
        cameras=tuple(camera_of(model, camera, aspect) for camera, aspect in cameras.items()),
        liquids=tuple(
            Liquid(name, len(bodies), radius_of(model, bodies[0]))
            for name, bodies in particles.items()
        ),
    ).checked()
    ids = np.array([joint for _, joint, _ in joints], np.intp)
    return Description(
        scene=scene,
        table=table,
        hands=hands,
        base=find(model, "body", layout.robot.base, "the robot"),
        object_body=np.array(
            [find(model, "body", thing.body) for thing in layout.objects.values()], np.intp
        ),
        joint_qpos=model.jnt_qposadr[ids].astype(np.intp),
        joint_dof=model.jnt_dofadr[ids].astype(np.intp),
        joint_closed=np.array([way.closed for _, _, way in joints], np.float64),
        joint_open=np.array([way.opened for _, _, way in joints], np.float64),
        boxes=Attached.of([place for _, place in found]),
        read_switches=tuple(read for _, read in switches),
        cameras=Attached.of([camera_place(model, camera) for camera in cameras]),
        particles=np.array([body for own in particles.values() for body in own], np.intp),
    )


class _Owners:
    """Whose each body is."""

    def __init__(self, model: Any, layout: Layout) -> None:
        self._model, self._layout = model, layout
        robot = layout.robot
        claims: dict[int, tuple[str, str]] = {}  # entity, and part if that is the robot's
        for body in robot.bodies:
            claims[find(model, "body", body, "the robot")] = ROBOT, ""
        for hand in robot.hands:
            what = f"hand {hand.spec.name!r}"
            groups = zip(hand.spec.fingers, hand.fingers, strict=True)
            palm = zip(hand.spec.palm * len(hand.palm), hand.palm, strict=False)
            for names, bodies in groups:
                for finger in bodies:
                    claims[find(model, "body", finger, what)] = ROBOT, names[0]
            for name, rest in palm:
                claims[find(model, "body", rest, what)] = ROBOT, name
        for name, thing in layout.objects.items():
            claims[find(model, "body", thing.body, f"object {name!r}")] = name, ""
        for name, fixture in layout.fixtures.items():
            for root in fixture.bodies:
                claims[find(model, "body", root, f"fixture {name!r}")] = name, ""
        for name, liquid in layout.liquids.items():
            for body in liquid.bodies:
                claims[find(model, "body", body, f"liquid {name!r}")] = name, ""
        self._owner: list[tuple[str, str]] = [(ROOM, "")] * model.nbody
        for number, parent in enumerate(model.body_parentid.tolist()):
            self._owner[number] = claims.get(number, self._owner[parent])

    def table(self) -> PartTable:
        """The parts of all geoms."""
        return parts.build(self._model, self._part)

    def _part(self, geom: int) -> tuple[Part, bool] | None:
        model = self._model
        body = int(model.geom_bodyid[geom])
        entity, name = self._owner[body]
        if entity in self._layout.liquids:
            return None  # its particles are recorded, and not what they touch
        if entity == ROBOT:
            return Part(ROBOT, name or model.body(body).name or "body"), True
        if entity in self._layout.objects:
            return Part(entity, "body"), True
        if entity == ROOM:
            return Part(ROOM, "body"), bool(model.body_weldid[body])
        fixture = self._layout.fixtures[entity]
        own = fixture.parts.get(model.geom(geom).name) or fixture.parts.get(model.body(body).name)
        joint = parts.joint_of_body(model, body, [model.joint(name).id for name in fixture.joints])
        if joint < 0:
            return Part(entity, own or "body"), parts.joint_of_body(model, body) >= 0
        hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        moved = own or ("door" if hinge else "drawer")
        return Part(entity, moved, f"{entity}/{local_name(model, joint, entity)}"), True


def local_name(model: Any, joint: int, entity: str) -> str:
    """A joint's name within its entity."""
    name: str = model.joint(joint).name
    return name.removeprefix(f"{entity}_")


def closed_kinematics(model: Any, data: Any, positions: Mapping[int, float]) -> Any:
    """``MjData`` of the same scene with some joints elsewhere, its kinematics up to date.

    Args:
        model: a ``mujoco.MjModel``.
        data: of the scene.
        positions: of joints, by id.
    """
    closed = mujoco.MjData(model)
    closed.qpos[:] = data.qpos
    for joint, position in positions.items():
        closed.qpos[model.jnt_qposadr[joint]] = position
    mujoco.mj_kinematics(model, closed)
    return closed


def body_of(model: Any, data: Any, name: str, body: int, half: Vector, centre: Vector) -> Body:
    """A movable object.

    Args:
        model: a ``mujoco.MjModel``.
        data: with centres of mass.
        name: the object's.
        body: its id.
        half: see :class:`~pytest_safemanip.trace.elements.Body`.
        centre: likewise.
    """
    pose = np.concatenate((data.xpos[body], data.xquat[body]))
    return Body(
        entity=name,
        half=half,
        centre=centre,
        com=extents.vector(to_local(pose, data.subtree_com[body])),
        mass=float(model.body_subtreemass[body]),
    )


def joint_of(
    model: Any, closed: Any, entity: str, joint: int, travel: float, gives_access: bool
) -> Joint:
    """A door, a drawer or a control.

    Args:
        model: a ``mujoco.MjModel``.
        closed: kinematics with everything closed.
        entity: the fixture.
        joint: its id.
        travel: position at openness 1, less that at 0; rad or m.
        gives_access: see :class:`~pytest_safemanip.trace.elements.Joint`.
    """
    hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
    pose, half = extents.moving_box(model, closed, int(model.jnt_bodyid[joint]))
    return Joint(
        entity=entity,
        name=local_name(model, joint, entity),
        kind="hinge" if hinge else "slide",
        gives_access=gives_access,
        axis=extents.vector(closed.xaxis[joint] * np.sign(travel)),
        anchor=extents.vector(closed.xanchor[joint]),
        travel=abs(travel),
        half=half,
        pose=pose,
    )


def radius_of(model: Any, body: int) -> float:
    """Radius of the sphere that a body is, m."""
    return float(model.geom_size[model.body_geomadr[body], 0])


def _object(model: Any, data: Any, name: str, body: int) -> Body:
    half, centre = extents.local_box(model, data, body)
    return body_of(model, data, name, body, extents.vector(half), extents.vector(centre))


def _hand(model: Any, hand: HandLayout) -> Hand:
    what = f"hand {hand.spec.name!r}"
    site = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, hand.frame))
    body = find(model, "body", hand.frame, what) if site < 0 else int(model.site_bodyid[site])
    joints = [find(model, "joint", joint.name, what) for joint in hand.joints]
    return Hand(
        site=site,
        body=body,
        qpos=model.jnt_qposadr[joints].astype(np.intp),
        dof=model.jnt_dofadr[joints].astype(np.intp),
        closed=np.array([joint.closed for joint in hand.joints]),
        opened=np.array([joint.opened for joint in hand.joints]),
    )


def _gripper(model: Any, data: Any, table: PartTable, declared: HandLayout, hand: Hand) -> Gripper:
    spec = declared.spec
    names = {*spec.palm, *(name for group in spec.fingers for name in group)}
    own = [part.entity == ROBOT and part.name in names for part in table.parts]
    geoms = np.flatnonzero(np.append(own, False)[table.of_geom])
    half, centre = extents.box_around(model, data, hand.pose(data), geoms)
    return spec.in_scene(extents.vector(half), extents.vector(centre))


def _boxes(model: Any, name: str, fixture: FixtureLayout) -> list[tuple[Box, _Place]]:
    kinds: tuple[tuple[BoxKind, Mapping[str, str | Region]], ...] = (
        ("interior", fixture.interiors),
        ("handle", fixture.handles),
        ("control", fixture.controls),
        ("burner", fixture.burners),
    )
    found = []
    for kind, places in kinds:
        for box, place in places.items():
            half, at = _place(model, f"fixture {name!r}", place)
            found.append((Box(name, box, kind, half), at))
    return found


def _place(model: Any, what: str, place: str | Region) -> tuple[Vector, _Place]:
    """Half extents, and where it is."""
    if isinstance(place, Region):
        body = find(model, "body", place.body, what)
        return place.half, (body, np.array((*place.centre, *place.quat)))
    site = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, place))
    if site >= 0:
        return half_of_site(model, site), site_place(model, site)
    geom = find(model, "geom", place, what)
    return half_of_geom(model, geom), geom_place(model, geom)
