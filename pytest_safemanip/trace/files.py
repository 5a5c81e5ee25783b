"""The file of a recording: a zip of a JSON header and plain ``.npy`` arrays.

The same recording always gives the same bytes. Nothing in a file is trusted: a digest covers all
of it, there is no pickle, every size is bounded before it is read, and every value is checked
before anything can depend on it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.decoding.files import Unreadable, read_regular
from pytest_safemanip.errors import DamagedRecording, TraceError
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.members import Array, Members, npy
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Steps, array_shapes
from pytest_safemanip.trace.stored import LATER, StoredArray
from pytest_safemanip.trace.surfaces import Surfaces

SCHEMA = 7
BEFORE_CAMERAS = 6
"""The schema before, which is read, too: without cameras and liquids."""
SUFFIX = ".rollout"
MAX_HEADER = 4 * 2**20
MAX_FILE = 2**30
_MAX_DIGEST = 64
_HEADER, _DIGEST, _SURFACES = "header.json", "digest", "scene.surfaces.npy"
_STEP_ARRAYS = (*ARRAYS, "action", "success", "tail")
_CONTACT_ARRAYS = tuple(f.name for f in dataclasses.fields(Contacts))
_LATER_ARRAYS = ("camera_pose", "particles")
_NAMES = (*_STEP_ARRAYS, *(f"contacts.{name}" for name in _CONTACT_ARRAYS))
_WORTH_PACKING = 0.8
"""Share of its size down to which a member has to be packed by a quick try to be packed at all: the
digits of velocities are noise, and take longest to unpack."""
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, ValueError)
"""The errors of ``zipfile`` on malformed archives."""
_TYPES = {"success": np.bool_, "tail": np.bool_, "step": np.int32, "a": np.int32, "b": np.int32}


def save(recording: Recording, path: Path) -> None:
    """Write a recording atomically: a reader sees the whole file or none.

    Raises:
        OSError: if the folder cannot be written.
    """
    data = to_bytes(recording)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException as error:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        if isinstance(error, OSError) and error.errno:
            error.filename = str(path)  # a full disk names no file
        raise


def load(path: Path) -> Recording:
    """Read a recording and check it.

    Raises:
        TraceError: naming the file and what is wrong with it.
    """
    with _named(path):
        return from_bytes(_read(path))


def load_episode(path: Path) -> Episode:
    """The episode from a recording's header; nothing else is read.

    Raises:
        TraceError: naming the file and what is wrong with it.
    """
    with _named(path):
        return _episode(_header(_members(_read(path))))


def load_scene(path: Path) -> Scene:
    """The scene of a recording without the sizes of its surfaces: what is there, and how it is
    called.

    Raises:
        TraceError: naming the file and what is wrong with it.
    """
    with _named(path):
        scene = _scene(_header(_members(_read(path))))
        entities, joints = _surface_names(scene)
        numbers = np.tile((0.0,) * 6 + (1.0, 0.0, 0.0, 0.0), (len(entities), 1))
        surfaces = Surfaces(entities, joints, numbers[:, :3], numbers[:, 3:])
        return Scene.from_json({**scene, "surfaces": surfaces})


def to_bytes(recording: Recording) -> bytes:
    """The content of a recording's file, deterministic."""
    scene = recording.scene.to_json()
    surfaces = scene.pop("surfaces")
    scene["surfaces"] = {name: [s[name] for s in surfaces] for name in ("entity", "joint")}
    header = {"schema": SCHEMA, "episode": recording.episode.to_json(), "scene": scene}
    numbers = np.array([(*s["half"], *s["pose"]) for s in surfaces], float).reshape(-1, 10)
    members = {_HEADER: _canonical(header), _SURFACES: npy(numbers)}
    members |= {f"{name}.npy": npy(array) for name, array in _arrays(recording).items()}
    stream = io.BytesIO()
    _append(stream, members)
    digest = Members(stream.getvalue()).digest(but=_DIGEST)
    _append(stream, {_DIGEST: digest.encode()})
    return stream.getvalue()


def from_bytes(data: bytes) -> Recording:
    """The inverse of :func:`to_bytes`.

    Raises:
        TraceError: if the content is truncated, tampered with, too large, of another schema or
            physically impossible. For what no verdict depends on, see :class:`StoredArray`.
    """
    members = _members(data)
    header = _header(members)
    with _damage():
        if members.digest(but=_DIGEST) != _text(members, _DIGEST):
            raise DamagedRecording("the content does not match its digest: the file was changed")
        scene = _scene(header)
        scene["surfaces"] = _surfaces(scene, members)
        lacking = _LATER_ARRAYS if header["schema"] == BEFORE_CAMERAS else ()
        ready: dict[str, Any] = {
            name: _array(members, name) for name in _NAMES if name not in (*LATER, *lacking)
        }
        packed = {name: members.packed(f"{name}.npy") for name in LATER}
    columns = {name: ready.pop(f"contacts.{name}") for name in _CONTACT_ARRAYS}
    known, length = Scene.from_json(scene), len(ready["success"])
    ready |= {name: StoredArray(name, packed[name], known, length) for name in LATER}
    shapes = array_shapes(known)
    ready |= {name: np.zeros((length, *shapes[name]), np.float32) for name in lacking}  # empty
    steps = Steps(**ready, contacts=Contacts(**columns))
    recording = check(Recording(_episode(header), known, steps))
    if fault := _contradiction(recording):
        raise TraceError(fault)
    return recording


def _read(path: Path) -> bytes:
    try:
        return read_regular(path, MAX_FILE)
    except Unreadable as error:
        raise TraceError(str(error)) from error


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except TraceError as error:
        remedy = f"; {error.remedy}" if isinstance(error, DamagedRecording) else ""
        # What a library said of the bytes is in the message: its traceback helps nobody.
        raise type(error)(f"{path}: {error}{remedy}") from None


@contextlib.contextmanager
def _damage() -> Iterator[None]:
    try:
        yield
    except _DAMAGE as error:
        raise DamagedRecording(f"not a recording, or a truncated one ({error})") from error


def _members(data: bytes) -> Members:
    with _damage():
        return Members(data)


def _append(stream: io.BytesIO, members: dict[str, bytes]) -> None:
    with zipfile.ZipFile(stream, "a") as archive:
        for name, content in members.items():
            packs = len(zlib.compress(content, 1)) < _WORTH_PACKING * len(content)
            method = zipfile.ZIP_DEFLATED if packs else zipfile.ZIP_STORED
            # A ZipInfo made by name has a fixed date: the same rollout, the same bytes.
            archive.writestr(zipfile.ZipInfo(name), content, method, 6)


def _arrays(recording: Recording) -> dict[str, Array]:
    steps = recording.steps
    arrays = {name: getattr(steps, name) for name in _STEP_ARRAYS}
    arrays |= {f"contacts.{name}": getattr(steps.contacts, name) for name in _CONTACT_ARRAYS}
    return arrays


def _array(members: Members, name: str) -> Array:
    wanted = _TYPES.get(name.removeprefix("contacts."), np.float32)
    array = members.packed(f"{name}.npy").array(wanted)
    if array.ndim == 0:
        raise TraceError(f"{name}: a single number, expected an array")
    return array


def _text(members: Members, name: str) -> str:
    return bytes(members.packed(name).unpacked(_MAX_DIGEST)).decode()


def _surfaces(scene: dict[str, Any], members: Members) -> Surfaces:
    """The surfaces of a scene: their names are in the header."""
    numbers = members.packed(_SURFACES).array(np.float64)
    entities, joints = _surface_names(scene)
    sizes = [len(entities), len(joints)]
    if numbers.shape[1:] != (10,) or sizes != [len(numbers)] * 2:
        raise TraceError(f"{_SURFACES}: shape {numbers.shape} for {sizes} surfaces")
    return Surfaces(entities, joints, numbers[:, :3], numbers[:, 3:])


def _surface_names(scene: dict[str, Any]) -> tuple[list[str], list[str]]:
    """Whose each surface is, and which joints move them."""
    names = _section(scene, "surfaces")
    entities, joints = names.get("entity"), names.get("joint")
    if not isinstance(entities, list) or not isinstance(joints, list):
        raise TraceError("scene: surfaces: entity and joint must be lists of texts")
    if len(entities) != len(joints):
        raise TraceError(f"scene: {len(entities)} entities and {len(joints)} joints of surfaces")
    return entities, joints


def _contradiction(recording: Recording) -> str:
    """Where the episode's description and its steps differ; empty if they agree."""
    about, last = recording.episode, recording.acting - 1
    if last > about.horizon:
        return f"episode: the horizon is {about.horizon}, and the last step that acts is {last}"
    if about.ended == "success" and not recording.success:
        return f"episode: it ended with success, and step {last} has none"
    return ""


def _header(members: Members) -> dict[str, Any]:
    try:
        with _damage():
            text = bytes(members.packed(_HEADER).unpacked(MAX_HEADER))
        header = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DamagedRecording(f"header.json: not JSON ({error})") from error
    if not isinstance(header, dict):
        raise DamagedRecording("header.json: not a mapping")
    schema = header.get("schema")
    if schema not in (SCHEMA, BEFORE_CAMERAS):
        raise TraceError(
            f"schema {schema!r}, this version reads {SCHEMA}: run the rollout again, or use the "
            "version of pytest-safemanip that wrote it"
        )
    return header


def _scene(header: dict[str, Any]) -> dict[str, Any]:
    """The description of the scene."""
    scene = _section(header, "scene")
    if header["schema"] == BEFORE_CAMERAS:
        scene |= {"cameras": [], "liquids": []}
    return scene


def _episode(header: dict[str, Any]) -> Episode:
    return Episode.from_json(_section(header, "episode"))


def _section(header: dict[str, Any], name: str) -> dict[str, Any]:
    section = header.get(name)
    if not isinstance(section, dict):
        raise TraceError(f"header.json: {name} is missing")
    return section


def _canonical(header: dict[str, Any]) -> bytes:
    return json.dumps(header, sort_keys=True, separators=(",", ":")).encode()
