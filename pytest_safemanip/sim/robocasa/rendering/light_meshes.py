"""Fine meshes replaced by thinned ones before MuJoCo compiles them, kept in the cache directory.

To read and compile the robot's own takes as long as to draw a hundred pictures of a draft.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np

from pytest_safemanip.provenance import source_digest
from pytest_safemanip.sim.robocasa.rendering.thinning import thin_meshes

SMALL = 100_000
"""Files of at most so many bytes are left as they are."""
TAKEN = {"name", "file", "scale"}
"""Attributes of a mesh that a thinned one has taken in; with any other, it is left as it is."""


def lighten(xml: str, cache: Path) -> str:
    """A model with thinned meshes in place of those that are large files.

    Args:
        xml: of a model that is drawn and whose contacts do not matter; files by absolute paths.
        cache: the folder in which thinned meshes are kept, and made.
    """
    root = ET.fromstring(xml)  # noqa: S314 - RoboCasa has just written it
    if root.find("default//mesh") is not None:
        return xml
    for element in root.iterfind("asset/mesh"):
        path = Path(element.get("file", ""))
        # Whatever is wrong with a file, MuJoCo says it of the model; thinning is no must.
        with contextlib.suppress(OSError, ValueError):
            if path.is_absolute() and set(element.attrib) <= TAKEN and path.stat().st_size > SMALL:
                light = _kept(element, path, cache)
                element.attrib.pop("scale", None)
                element.attrib.update(file=str(light), inertia="shell")
    return ET.tostring(root, encoding="unicode")


def _kept(element: ET.Element, path: Path, cache: Path) -> Path:
    """The thinned mesh of an element, made if it is not there."""
    status, source = path.stat(), source_digest("sim/robocasa/rendering")
    about = [str(path), status.st_size, status.st_mtime_ns, element.get("scale"), source]
    key = hashlib.sha256(json.dumps([*about, mujoco.__version__]).encode()).hexdigest()[:32]
    light = cache / f"{key}.msh"
    if not light.exists():
        content = _thinned(element)
        cache.mkdir(parents=True, exist_ok=True)
        scratch = cache / f".{key}.{os.getpid()}"
        scratch.write_bytes(content)
        scratch.replace(light)
    return light


def _thinned(element: ET.Element) -> bytes:
    """A mesh with fewer faces as a file of MuJoCo's own format: counts, then arrays."""
    alone = ET.Element("mujoco")
    ET.SubElement(alone, "asset").append(element)
    model = mujoco.MjModel.from_xml_string(ET.tostring(alone, encoding="unicode"))
    thin_meshes(model)
    number, turned = int(model.mesh_facenum[0]), np.empty(9)
    parts = (model.mesh_face, model.mesh_facenormal, model.mesh_facetexcoord)
    corners = np.stack([part[:number] for part in parts], axis=-1).reshape(-1, 3)
    points, faces = np.unique(corners, axis=0, return_inverse=True)
    mujoco.mju_quat2Mat(turned, model.mesh_quat[0])
    rotation = turned.reshape(3, 3).T
    texture = model.mesh_texcoord[points[:, 2]] if model.nmeshtexcoord else np.empty((0, 2))
    arrays = (
        model.mesh_vert[points[:, 0]] @ rotation + model.mesh_pos[0],
        model.mesh_normal[points[:, 1]] @ rotation,
        texture,
    )
    counts = np.array([*map(len, arrays), number], np.int32)
    return b"".join(
        part.tobytes()
        for part in (counts, *(a.astype(np.float32) for a in arrays), faces.astype(np.int32))
    )
