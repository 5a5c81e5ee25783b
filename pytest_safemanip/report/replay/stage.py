"""What a replay shows: solids, still or carried along tracks. World frame, metres, ``wxyz``."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from pytest_safemanip.report.replay.arms import links_of
from pytest_safemanip.report.replay.placing import IDENTITY, composed
from pytest_safemanip.sim.looks import Look
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array, angle_between, to_world
from pytest_safemanip.trace.kinematics import carried
from pytest_safemanip.trace.recording import Recording

Form = Literal["box", "capsule", "outline"]
FORMS: tuple[Form, ...] = ("box", "capsule", "outline")
STILL = -1
"""The track of what does not move."""
LEAST_WAY, LEAST_TURN = 5e-4, 4e-3
"""What stays within this of where it begins is drawn as still, m and rad."""
MOST_SOLIDS, MOST_OBJECTS = 4000, 500
_INTERIOR = 2e-3
"""The interior of a fixture is drawn so much smaller than its walls, m: they share faces."""


@dataclass(frozen=True)
class Solid:
    """A piece of an entity.

    Attributes:
        entity: whose it is.
        form: a box; a capsule along z with radius ``half[0]`` and ``half[2]`` to the centres of its
            caps; the edges of a box, for an interior.
        half: half extents (3,), m.
        pose: centre in the frame of its track, or in the world (7,).
        track: number of the track that carries it, or :data:`STILL`.
    """

    entity: str
    form: Form
    half: Sequence[float]
    pose: Array
    track: int


@dataclass(frozen=True)
class Skin:
    """A mesh of an entity.

    Attributes:
        entity: whose it is.
        colour: red, green and blue, 0 to 1 (3,).
        points: in the frame of its track, or in the world (V, 3), m.
        triangles: numbers of points (F, 3).
        track: number of the track that carries it, or :data:`STILL`.
    """

    entity: str
    colour: tuple[float, float, float]
    points: Array
    triangles: Array
    track: int


@dataclass
class Stage:
    """Solids and meshes, and the tracks that carry them.

    Attributes:
        solids: of everything that has no mesh; the pieces of fixtures last.
        skins: the meshes.
        tracks: poses over the steps of the recording (T, 7), each.
    """

    solids: list[Solid] = field(default_factory=list)
    skins: list[Skin] = field(default_factory=list)
    tracks: list[Array] = field(default_factory=list)

    def carry(self, poses: Array) -> tuple[int, Array]:
        """Add a track of poses (T, 7), if they move.

        Returns:
            Its number and the identity, or :data:`STILL` and the pose that is kept (7,).
        """
        poses = np.asarray(poses, float)
        way = np.linalg.norm(poses[:, :3] - poses[0, :3], axis=1).max()
        turn = angle_between(poses[:, 3:], poses[:1, 3:]).max()
        if way < LEAST_WAY and turn < LEAST_TURN:
            return STILL, poses[0]
        self.tracks.append(poses)
        return len(self.tracks) - 1, np.array(IDENTITY)

    def add(
        self,
        entity: str,
        form: Form,
        half: Sequence[float],
        local: Sequence[float],
        frame: tuple[int, Array],
    ) -> None:
        """Add a piece at a pose (7,) in a frame that :meth:`carry` gave."""
        track, pose = frame
        placed = composed(pose, np.asarray(local, float))
        self.solids.append(Solid(entity, form, [float(x) for x in half], placed, track))


def set_stage(recording: Recording, guilty: Collection[str], looks: Sequence[Look] = ()) -> Stage:
    """What is shown of a rollout: meshes, where there are some, and else what a recording alone
    has, the robot and the boxes of objects, fixtures and room.

    Args:
        recording: the rollout.
        guilty: the entities whose interiors are shown too, and boxes beside their meshes.
        looks: meshes; an entity that has some has no boxes.
    """
    stage, steps = Stage(), recording.steps
    bare = {entity.name for entity in recording.scene.entities} - {look.entity for look in looks}
    _add_skins(stage, looks)
    for link in links_of(recording) if ROBOT in bare else ():
        frame = stage.carry(link.poses)
        for piece in link.pieces:
            stage.add(ROBOT, piece.form, piece.half, piece.pose, frame)
    for index, body in enumerate(recording.scene.bodies[:MOST_OBJECTS]):
        if body.entity in bare or body.entity in guilty:
            form: Form = "box" if body.entity in bare else "outline"
            frame = stage.carry(steps.object_pose[:, index])
            stage.add(body.entity, form, body.half, (*body.centre, *IDENTITY[3:]), frame)
    for index, box in enumerate(recording.scene.boxes):
        if box.kind == "interior" and box.entity in guilty:
            half = np.maximum(np.asarray(box.half) - _INTERIOR, 0.0).tolist()
            frame = stage.carry(steps.box_pose[:, index])
            stage.add(box.entity, "outline", half, IDENTITY, frame)
    _add_fixtures(stage, recording, bare)
    return stage


def _add_skins(stage: Stage, looks: Sequence[Look]) -> None:
    frames: dict[int, tuple[int, Array]] = {}
    for look in looks:
        # Pieces of one body share their poses.
        track, frame = frames.setdefault(id(look.poses), (STILL, np.empty(0)))
        if not frame.size:
            track, frame = frames[id(look.poses)] = stage.carry(look.poses)
        points = to_world(frame, look.points)
        stage.skins.append(Skin(look.entity, look.colour, points, look.triangles, track))


def _add_fixtures(stage: Stage, recording: Recording, bare: Collection[str]) -> None:
    """The pieces of fixtures and room; the largest of too many."""
    solid = recording.scene.solid
    room = max(0, MOST_SOLIDS - len(stage.solids))
    largest = np.argsort(-np.prod(solid.half, axis=1), kind="stable").tolist()
    chosen = [index for index in largest if solid.entities[index] in bare][:room]
    frames = _joint_frames(stage, recording, {solid.joints[index] for index in chosen})
    for index in chosen:
        frame = frames[solid.joints[index]]
        stage.add(solid.entities[index], "box", solid.half[index], solid.pose[index], frame)


def _joint_frames(
    stage: Stage, recording: Recording, wanted: Collection[str]
) -> Mapping[str, tuple[int, Array]]:
    """Frames in which the poses at openness 0 are where joints have brought them, by joint."""
    frames = {"": (STILL, np.array(IDENTITY))}
    for index, joint in enumerate(recording.scene.joints):
        if joint.key in wanted:
            openness = np.asarray(recording.steps.joint[:, index, 0], float)
            poses = carried(joint, np.tile(IDENTITY, (len(openness), 1)), openness)
            frames[joint.key] = stage.carry(poses)
    return frames
