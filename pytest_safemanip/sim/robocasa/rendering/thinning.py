"""Meshes with fewer faces, where pictures are small and nobody has a GPU.

The robot's visual meshes have a quarter of a million faces. Without a GPU they take most of the
time of a picture in which a pixel is several millimetres wide.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

KEPT_WHOLE = 1500
"""Meshes of at most so many faces are left as they are."""
FINEST, COARSEST = 0.002, 0.016
"""Width of the cells whose vertices become one, m: the finest that leaves few enough faces."""


def simplify(model: Any) -> None:
    """Give up antialiasing, shadows, reflections and fine meshes, in place; what collides stays.

    Args:
        model: a ``mujoco.MjModel`` that is drawn and no longer simulated, before it is uploaded.
    """
    model.vis.quality.offsamples = 0
    model.light_castshadow[:] = 0
    model.mat_reflectance[:] = 0
    thin_meshes(model)


def thin_meshes(model: Any) -> None:
    """Merge near vertices of the detailed meshes; for ``model`` see :func:`simplify`."""
    for mesh in np.flatnonzero(model.mesh_facenum > KEPT_WHOLE):
        first, number = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        start, points = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        vertices = model.mesh_vert[start : start + points]
        faces = model.mesh_face[first : first + number]
        merged, kept = faces, np.arange(number)
        cell = FINEST
        while cell <= COARSEST and len(kept) > KEPT_WHOLE:
            merged, kept = _merge(vertices, faces, cell)
            cell *= 2
        _keep(model, slice(first, first + len(kept)), first + kept, merged)
        model.mesh_facenum[mesh] = len(kept)


def _merge(
    vertices: NDArray[Any], faces: NDArray[Any], cell: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The faces (K, 3) that are left when vertices of a cell are one, and their numbers (K,)."""
    places = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    keys = places @ np.array([1, 1 << 20, 1 << 40])
    _, first, cluster = np.unique(keys, return_index=True, return_inverse=True)
    corners = cluster.reshape(-1)[faces]
    flat = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    whole = np.flatnonzero(~flat)
    _, once = np.unique(np.sort(corners[whole], axis=1), axis=0, return_index=True)
    kept = whole[np.sort(once)]
    return first[corners[kept]], kept


def _keep(model: Any, place: slice, kept: NDArray[Any], merged: NDArray[Any]) -> None:
    """Move what belongs to the faces that are kept to the front of the mesh's own."""
    model.mesh_facenormal[place] = model.mesh_facenormal[kept]
    model.mesh_facetexcoord[place] = model.mesh_facetexcoord[kept]
    model.mesh_face[place] = merged
