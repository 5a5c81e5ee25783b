"""Interiors, handles and controls of RoboCasa's fixtures."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco import extents
from pytest_safemanip.sim.mujoco.description import geom_place, half_of_geom
from pytest_safemanip.sim.mujoco.parts import PartTable, joint_of_body
from pytest_safemanip.trace.elements import Box

LEAST_INTERIOR = 0.005
"""Half extent below which a region is no space that holds anything, m."""
FOREMOST = 0.4
"""What is no farther behind a handle's front than this share of its depth is what one takes hold
of; the rest are posts that fix it."""
LEVEL_WITH = 0.002
"""What is no farther behind its foremost piece belongs to it anyhow, m."""

Place = tuple[int, NDArray[np.float64]]
"""A body, and a pose in its frame (7,)."""


def boxes(
    model: Any, data: Any, table: PartTable, env: Any, fixtures: list[str]
) -> list[tuple[Box, Place]]:
    """Interiors, handles and controls of the fixtures that play a role in the task."""
    found = []
    for name in fixtures:
        fixture = env.fixtures[name]
        for region in fixture.get_reset_region_names():
            geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{name}_reg_{region}")
            # A counter's interior is a point: there is none.
            if geom >= 0 and min(half_of_geom(model, geom)) > LEAST_INTERIOR:
                box = Box(name, region, "interior", half_of_geom(model, geom))
                found.append((box, geom_place(model, geom)))
        root = int(model.body_rootid[model.body(fixture.root_body).id])
        for geom in range(model.ngeom):
            body = int(model.geom_bodyid[geom])
            local = model.geom(geom).name.removeprefix(f"{name}_")
            if model.body_rootid[body] != root or model.geom_contype[geom] == 0:
                continue
            if local.endswith(CONTROLS) or START_BUTTON in local:
                box = Box(name, local, "control", half_of_geom(model, geom))
                found.append((box, geom_place(model, geom)))
        found += _handles(model, data, table, name)
    return found


CONTROLS = ("button", "knob_main", "lever_handle")
"""How the names of buttons, knobs and levers end."""
START_BUTTON = "start_button"
"""Of several, each has a number behind that."""


def _handles(model: Any, data: Any, table: PartTable, name: str) -> list[tuple[Box, Place]]:
    """What one takes hold of on each door and drawer of a fixture, named like its joint, in the
    axes of what the joint moves: RoboCasa's fixtures have their front along -y.
    """
    found = []
    for number, part in enumerate(table.parts):
        if part.entity != name or part.name != "handle" or not part.joint:
            continue
        geoms = np.flatnonzero(table.of_geom == number)
        body = int(model.jnt_bodyid[joint_of_body(model, int(model.geom_bodyid[geoms[0]]))])
        frame = np.concatenate((data.xpos[body], data.xquat[body]))
        each = [extents.box_around(model, data, frame, [geom]) for geom in geoms]
        half, centre = extents.box_around(model, data, frame, geoms)
        front = min(own[1] for _, own in each)
        limit = max(front + LEVEL_WITH, centre[1] - half[1] + 2.0 * FOREMOST * half[1])
        bar = [geom for geom, (_, own) in zip(geoms, each, strict=True) if own[1] < limit]
        half, centre = extents.box_around(model, data, frame, bar)
        box = Box(name, part.joint.removeprefix(f"{name}/"), "handle", extents.vector(half))
        found.append((box, (body, np.array((*centre, 1.0, 0.0, 0.0, 0.0)))))
    return found
