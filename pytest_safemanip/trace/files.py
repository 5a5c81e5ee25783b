"""The file of a recording: a zip of a JSON header and plain ``.npy`` arrays.

The same recording always gives the same bytes. Nothing in a file is trusted: no pickle, every
size is bounded before it is read, and every value is checked.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import io
import json
import os
import struct
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.recording import Episode, Recording, check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Steps

SCHEMA = 2
_READ = (1, SCHEMA)
SUFFIX = ".rollout"
MAX_HEADER = 4 * 2**20
MAX_ARRAY = 256 * 2**20
_STEP_ARRAYS = (*ARRAYS, "action", "success", "tail")
_CONTACT_ARRAYS = tuple(f.name for f in dataclasses.fields(Contacts))
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, ValueError)
"""What ``zipfile`` raises on bytes that are no archive, or no archive any more."""
_DTYPES = {"success": np.bool_, "tail": np.bool_, "step": np.int32, "a": np.int32, "b": np.int32}


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
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise


def load(path: Path) -> Recording:
    """Read a recording and check it.

    Raises:
        TraceError: naming the file and what is wrong with it.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TraceError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return from_bytes(data)
    except TraceError as error:
        raise TraceError(f"{path}: {error}") from error


def load_episode(path: Path) -> Episode:
    """What was run, from the header alone; the arrays are not read.

    Raises:
        TraceError: naming the file and what is wrong with it.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return _episode(_header(archive))
    except OSError as error:
        raise TraceError(f"{path}: cannot be read ({error.strerror})") from error
    except _DAMAGE as error:
        raise TraceError(f"{path}: not a recording, or a truncated one ({error})") from error
    except TraceError as error:
        raise TraceError(f"{path}: {error}") from error


def to_bytes(recording: Recording) -> bytes:
    """The content of a recording's file, deterministic."""
    members = {f"{name}.npy": _npy(array) for name, array in _arrays(recording).items()}
    header = {
        "schema": SCHEMA,
        "episode": recording.episode.to_json(),
        "scene": recording.scene.to_json(),
    }
    header["digest"] = _digest(header, members)
    text = _canonical(header)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, content in {"header.json": text, **members}.items():
            # A ZipInfo made by name has a fixed date: the same rollout, the same bytes.
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED, 6)
    return stream.getvalue()


def from_bytes(data: bytes) -> Recording:
    """The inverse of :func:`to_bytes`.

    Raises:
        TraceError: if the content is truncated, tampered with, too large, of a future version or
            physically impossible.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            header = _header(archive)
            members = {
                f"{name}.npy": _member(archive, f"{name}.npy", MAX_ARRAY)
                for name in _names(_STEP_ARRAYS, _CONTACT_ARRAYS)
            }
    except _DAMAGE as error:
        raise TraceError(f"not a recording, or a truncated one ({error})") from error
    if header.pop("digest", None) != _digest(header, members):
        raise TraceError("the content does not match its digest: the file was changed")
    arrays = {name.removesuffix(".npy"): _array(name, raw) for name, raw in members.items()}
    contacts = Contacts(**{name: arrays[f"contacts.{name}"] for name in _CONTACT_ARRAYS})
    steps = Steps(**{name: arrays[name] for name in _STEP_ARRAYS}, contacts=contacts)
    return check(
        Recording(
            _episode(header),
            Scene.from_json(_section(header, "scene")),
            steps,
        )
    )


def _names(steps: tuple[str, ...], contacts: tuple[str, ...]) -> list[str]:
    return [*steps, *(f"contacts.{name}" for name in contacts)]


def _arrays(recording: Recording) -> dict[str, np.ndarray[Any, Any]]:
    steps = recording.steps
    arrays = {name: getattr(steps, name) for name in _STEP_ARRAYS}
    arrays |= {f"contacts.{name}": getattr(steps.contacts, name) for name in _CONTACT_ARRAYS}
    return arrays


def _npy(array: np.ndarray[Any, Any]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(array), allow_pickle=False)
    return stream.getvalue()


def _array(name: str, raw: bytes) -> np.ndarray[Any, Any]:
    try:
        array = np.load(io.BytesIO(raw), allow_pickle=False)
    except Exception as error:  # numpy does not say what it raises on a header that lies
        raise TraceError(f"{name}: not a readable array ({error})") from error
    if not isinstance(array, np.ndarray):
        raise TraceError(f"{name}: not an array")
    wanted = _DTYPES.get(name.removesuffix(".npy").removeprefix("contacts."), np.float32)
    if array.dtype != wanted:
        raise TraceError(f"{name}: {array.dtype}, expected {np.dtype(wanted)}")
    return np.asarray(array)


def _member(archive: zipfile.ZipFile, name: str, limit: int) -> bytes:
    try:
        info = archive.getinfo(name)
    except KeyError:
        raise TraceError(f"{name} is missing") from None
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise TraceError(f"{name}: compressed in another way than recordings are")
    if info.file_size > limit:
        raise TraceError(f"{name}: {info.file_size} bytes, more than the limit of {limit}")
    with archive.open(info) as stream:
        content = stream.read(limit + 1)
    if len(content) != info.file_size:
        raise TraceError(f"{name}: {len(content)} bytes, the archive says {info.file_size}")
    return content


def _header(archive: zipfile.ZipFile) -> dict[str, Any]:
    try:
        header = json.loads(_member(archive, "header.json", MAX_HEADER))
    except (ValueError, RecursionError) as error:
        raise TraceError(f"header.json: not JSON ({error})") from error
    if not isinstance(header, dict):
        raise TraceError("header.json: not a mapping")
    schema = header.get("schema")
    if schema not in _READ:
        raise TraceError(
            f"schema {schema!r}, this version reads {' and '.join(map(str, _READ))}; "
            "record again, or use the version of pytest-safemanip that wrote it"
        )
    return header


def _episode(header: dict[str, Any]) -> Episode:
    data = _section(header, "episode")
    if header["schema"] == 1 and "stepping" not in data:
        data = {**data, "stepping": "exact"}  # there was no other way
    return Episode.from_json(data)


def _section(header: dict[str, Any], name: str) -> dict[str, Any]:
    section = header.get(name)
    if not isinstance(section, dict):
        raise TraceError(f"header.json: {name} is missing")
    return section


def _canonical(header: dict[str, Any]) -> bytes:
    return json.dumps(header, sort_keys=True, separators=(",", ":")).encode()


def _digest(header: dict[str, Any], members: dict[str, bytes]) -> str:
    digest = hashlib.sha256(_canonical(header))
    for name in sorted(members):
        digest.update(name.encode() + b"\0" + members[name])
    return digest.hexdigest()
