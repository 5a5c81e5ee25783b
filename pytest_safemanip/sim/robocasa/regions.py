"""Interiors, handles and controls of RoboCasa's fixtures."""

from __future__ import annotations

from typing import Any

import mujoco

from pytest_safemanip.sim.mujoco.description import half_of_geom
from pytest_safemanip.trace.elements import Box

LEAST_INTERIOR = 0.005
"""Half extent below which a region is no space that holds anything, m."""


def boxes(model: Any, env: Any, fixtures: list[str]) -> list[tuple[Box, int]]:
    """Interiors, handles and controls of the fixtures that play a role in the task, each with its
    geom.
    """
    found = []
    for name in fixtures:
        fixture = env.fixtures[name]
        for region in fixture.get_reset_region_names():
            geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{name}_reg_{region}")
            # A counter's interior is a point: there is none.
            if geom >= 0 and min(half_of_geom(model, geom)) > LEAST_INTERIOR:
                found.append((Box(name, region, "interior", half_of_geom(model, geom)), geom))
        root = int(model.body_rootid[model.body(fixture.root_body).id])
        for geom in range(model.ngeom):
            body = int(model.geom_bodyid[geom])
            local = model.geom(geom).name.removeprefix(f"{name}_")
            if model.body_rootid[body] != root or model.geom_contype[geom] == 0:
                continue
            if local.endswith(("handle_handle", "handle_main")):
                found.append((Box(name, local, "handle", half_of_geom(model, geom)), geom))
            elif local.endswith(("button", "knob_main", "lever_handle")):
                found.append((Box(name, local, "control", half_of_geom(model, geom)), geom))
    return found
