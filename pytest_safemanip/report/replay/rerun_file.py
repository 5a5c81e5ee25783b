"""A rollout as a file for Rerun: the replay, propositions as time series, verdicts as a log."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, install_command, printable
from pytest_safemanip.judge import Verdict
from pytest_safemanip.report.replay.packing import guilty_entities
from pytest_safemanip.report.replay.stage import STILL, Form, Skin, Stage, set_stage
from pytest_safemanip.report.replay.touches import LEAST_FORCE
from pytest_safemanip.sim.looks import Look
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array, cross, rotate
from pytest_safemanip.trace.recording import Recording, check

APPLICATION = "safemanip"
COLOURS = {"robot": 0xE9EAECFF, "object": 0x56B4E9FF, "fixture": 0xCFC6B8FF, "room": 0xDCDFE330}
GUILTY, CONTACT = 0xD55E00FF, 0x0072B2FF
METRES_PER_NEWTON = 0.01
LONGEST = 0.4
"""Of an arrow, m."""
MOST_SERIES = 300

Series = Mapping[tuple[str, ...], NDArray[Any]]
"""Truth values (T,) by proposition and arguments."""


def write_rrd(
    recording: Recording,
    verdicts: Mapping[str, Verdict],
    propositions: Series,
    path: Path,
    looks: Sequence[Look] = (),
) -> Path:
    """Write a rollout for Rerun.

    In the file: ``world/KIND/ENTITY`` has the boxes, ``world/contacts`` the contact forces as
    arrows, ``propositions/...`` truth values, ``signals/...`` openness and forces, ``verdicts`` a
    text log; the timelines are ``step`` and ``time``.

    Args:
        recording: the rollout.
        verdicts: on it, by property.
        propositions: truth values (T,) by name and arguments; at most 300 are written.
        path: of the file.
        looks: meshes of its things from a simulator; those without are boxes.

    Returns:
        The path.

    Raises:
        ConfigError: if rerun-sdk is not installed.
        TraceError: if the recording is physically impossible.
        OSError: if the file cannot be written.
    """
    check(recording)
    rr = load_rerun()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.open("wb").close()  # Rerun's own error does not say what is wrong with the path
    guilty = {
        name
        for verdict in verdicts.values()
        for finding in verdict.findings
        for name in guilty_entities(finding, recording)
    }
    about = recording.episode
    name = printable(f"{about.task}, {about.policy}, seed {about.seed}")
    with rr.RecordingStream(APPLICATION) as stream:
        stream.save(path)
        stream.send_recording_name(name)
        stream.send_blueprint(_blueprint(rr))
        writer = _Writer(rr, stream, recording)
        writer.write(set_stage(recording, guilty, looks), guilty)
        writer.write_series(propositions)
        writer.write_log(verdicts)
        stream.flush()
        stream.disconnect()
    return path


def load_rerun() -> Any:
    """The library that the file is written with.

    Raises:
        ConfigError: if it is not installed.
    """
    try:
        importlib.import_module("rerun.blueprint")
        return importlib.import_module("rerun")
    except ImportError as error:
        raise ConfigError(
            f"files for Rerun are written with rerun-sdk: {install_command('rerun')} ({error})"
        ) from error


def _blueprint(rr: Any) -> Any:
    """The scene on the left; on the right what was judged, over time."""
    layout = rr.blueprint
    return layout.Blueprint(
        layout.Horizontal(
            layout.Spatial3DView(origin="/world", name="rollout"),
            layout.Vertical(
                layout.TextLogView(origin="/verdicts", name="verdicts"),
                layout.TimeSeriesView(origin="/propositions", name="propositions"),
                layout.TimeSeriesView(origin="/signals", name="signals"),
            ),
            column_shares=[3, 2],
        ),
        collapse_panels=True,
    )


class _Writer:
    """Writes the parts of one rollout."""

    def __init__(self, rr: Any, stream: Any, recording: Recording) -> None:
        self._rr, self._stream, self._recording = rr, stream, recording
        steps = np.arange(len(recording.steps))
        self._times = [
            rr.TimeColumn("step", sequence=steps),
            rr.TimeColumn("time", duration=steps * recording.scene.control_period),
        ]

    def write(self, stage: Stage, guilty: Iterable[str]) -> None:
        """The solids and meshes, the tracks that carry them, and the contacts."""
        rr, stream = self._rr, self._stream
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        groups: dict[tuple[str, int, Form], list[int]] = {}
        for index, solid in enumerate(stage.solids):
            groups.setdefault((solid.entity, solid.track, solid.form), []).append(index)
        entities = self._recording.scene.entity
        for (name, track, form), indices in groups.items():
            kind = entities[name].kind
            own = self._place(kind, name, track)
            colour = GUILTY if name in guilty else COLOURS[kind]
            shape = self._shape(stage, indices, form, colour)
            stream.log(f"{own}/{form}", shape, static=True)
            if track != STILL:
                self._carry(own, stage.tracks[track])
        for number, skin in enumerate(stage.skins):
            own = self._place(entities[skin.entity].kind, skin.entity, skin.track)
            stream.log(f"{own}/mesh{number}", self._mesh(skin, skin.entity in guilty), static=True)
            if skin.track != STILL:
                self._carry(own, stage.tracks[skin.track])
        self._write_contacts()

    def _place(self, kind: str, name: str, track: int) -> str:
        return self._path("world", kind, name, "still" if track == STILL else f"moving{track}")

    def _mesh(self, skin: Skin, guilty: bool) -> Any:
        colour = [round(255 * share) for share in skin.colour]
        return self._rr.Mesh3D(
            vertex_positions=skin.points[skin.triangles].reshape(-1, 3),
            vertex_normals=np.repeat(_normals(skin.points[skin.triangles]), 3, axis=0),
            albedo_factor=GUILTY if guilty and skin.track != STILL else [*colour, 255],
        )

    def write_series(self, propositions: Series) -> None:
        """Truth values, and the signals that every recording has."""
        steps, scene = self._recording.steps, self._recording.scene
        for name in list(propositions)[:MOST_SERIES]:
            self._scalars(self._path("propositions", *name), propositions[name])
        for index, gripper in enumerate(scene.grippers):
            self._scalars(
                self._path("signals", "opening", gripper.name), steps.openings[:, index, 0]
            )
        for index, joint in enumerate(scene.joints):
            openness = steps.joint[:, index, 0]
            if np.ptp(openness) > 0.01:
                self._scalars(self._path("signals", "openness", joint.key), openness)
        self._scalars(self._path("signals", "force", ROBOT), self._robot_force())

    def write_log(self, verdicts: Mapping[str, Verdict]) -> None:
        """What was found, when; what was not violated, at the end."""
        last = len(self._recording.steps) - 1
        lines = []
        for id_, verdict in verdicts.items():
            for finding in verdict.findings:
                text = "; ".join([f"{id_}: {finding}", *finding.evidence])
                lines.append((finding.first, text, "ERROR"))
            if not verdict.findings:
                lines.append((last, f"{id_}: {verdict.outcome.label}", "INFO"))
        for step, text, level in sorted(lines):
            self._at(step)
            self._stream.log("verdicts", self._rr.TextLog(printable(text, 600), level=level))

    def _shape(self, stage: Stage, indices: Sequence[int], form: Form, colour: int) -> Any:
        rr = self._rr
        solids = [stage.solids[index] for index in indices]
        poses, half = np.array([s.pose for s in solids]), np.array([s.half for s in solids])
        turns = poses[:, [4, 5, 6, 3]]
        if form == "capsule":
            # Rerun's begin where ours have the centre of their lower cap.
            along = np.zeros((len(solids), 3))
            along[:, 2] = half[:, 2]
            start = poses[:, :3] - rotate(poses[:, 3:], along)
            return rr.Capsules3D(
                lengths=2 * half[:, 2],
                radii=half[:, 0],
                translations=start,
                quaternions=turns,
                colors=colour,
            )
        fill = rr.components.FillMode.MajorWireframe if form == "outline" else None
        return rr.Boxes3D(
            centers=poses[:, :3],
            half_sizes=half,
            quaternions=turns,
            colors=colour,
            fill_mode=fill or rr.components.FillMode.Solid,
        )

    def _carry(self, path: str, poses: Array) -> None:
        rr = self._rr
        columns = rr.Transform3D.columns(
            translation=poses[:, :3], quaternion=poses[:, [4, 5, 6, 3]]
        )
        self._stream.send_columns(path, indexes=self._times, columns=columns)

    def _write_contacts(self) -> None:
        contacts, scene = self._recording.steps.contacts, self._recording.scene
        robot = np.array([part.entity == ROBOT for part in scene.parts], bool)
        names = [printable(f"{part.entity}/{part.name}", 80) for part in scene.parts]
        for step in range(len(self._recording.steps)):
            rows = np.arange(*contacts.span(step, step + 1))
            rows = rows[contacts.force[rows] >= LEAST_FORCE]
            # The force on what is not the robot.
            sign = np.where(robot[contacts.b[rows]], -1.0, 1.0)
            length = np.minimum(contacts.force[rows] * METRES_PER_NEWTON, LONGEST)
            arrows = self._rr.Arrows3D(
                origins=contacts.position[rows],
                vectors=contacts.normal[rows] * (sign * length)[:, None],
                colors=CONTACT,
                labels=[
                    f"{names[contacts.a[row]]} on {names[contacts.b[row]]}: "
                    f"{contacts.force[row]:.1f} N"
                    for row in rows
                ],
                show_labels=False,
            )
            self._at(step)
            self._stream.log("world/contacts", arrows)

    def _robot_force(self) -> Array:
        """The hardest contact of the robot at each step, N (T,)."""
        contacts, scene = self._recording.steps.contacts, self._recording.scene
        robot = np.array([part.entity == ROBOT for part in scene.parts], bool)
        own = robot[contacts.a] | robot[contacts.b]
        force = np.zeros(len(self._recording.steps))
        np.maximum.at(force, contacts.step[own], contacts.sustained[own])
        return force

    def _scalars(self, path: str, values: NDArray[Any]) -> None:
        columns = self._rr.Scalars.columns(scalars=np.asarray(values, float))
        self._stream.send_columns(path, indexes=self._times, columns=columns)

    def _at(self, step: int) -> None:
        self._stream.set_time("step", sequence=step)
        self._stream.set_time("time", duration=step * self._recording.scene.control_period)

    def _path(self, *parts: str) -> str:
        """An entity's path; what its parts have of Rerun's own characters is escaped."""
        path: str = self._rr.new_entity_path([printable(part, 120) for part in parts])
        return path


def _normals(triangles: Array) -> Array:
    """Unit normals (F, 3) of triangles (F, 3, 3)."""
    normals = cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    flat: Array = normals / np.where(length > 0, length, 1.0)
    return flat
