"""Compact kitchens, as layouts in RoboCasa's own format: metres, z up, y into the back wall.

They are built by RoboCasa's own code. ``small`` has what most atomic tasks need, for speed;
``full`` has every fixture that RoboCasa's fifty target tasks ask for, ``deep`` has deeper drawers,
``roomy`` a fridge with its shelves farther apart.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pytest_safemanip.sim.robocasa.standins.models import fridges

Layout = dict[str, Any]

COUNTER_DEPTH = 0.65
COUNTER_HEIGHT = 0.92
DRAWER_DEPTH = 0.45
"""Short enough that a drawer which RoboCasa opens by 30 cm shows most of what is in it."""
DEEP_DRAWER = 0.60
"""As in RoboCasa's own layouts, for tasks that put things 10 cm deeper than its middle: in a drawer
of 45 cm, on three seeds in eight, onto its back wall or behind it."""
DRAWER_FRONT = 0.70
"""The drawers stand 5 cm proud of the counter: a hand reaches into them past its edge."""
TOASTER_OVEN = (0.50, 0.42, 0.25)
"""Width, depth with its handle, and height, m: a big countertop oven, in which a baguette to be
filled lies on the rack. RoboCasa's own is 30 cm deep, and its bread stands out of it."""
ROOMY_FRIDGE = {"config_name": fridges.ROOMY, "size": [0.91, 0.80, 1.88]}
"""A big one, for a task that takes what lies across its shelves: they are 38 cm apart."""
STOOL_Y = -3.17
"""The stools are tucked in as in RoboCasa's own layouts, their middle 8 cm inside the island's
edge: RoboCasa puts the robot behind their backs, and from there it has to reach the island."""


def small(drawer_depth: float = DRAWER_DEPTH) -> Layout:
    """A kitchen of one wall, 4 m wide (RoboCasa's layout format; metres, z up, y into the wall).

    The sink has no cabinet above it, so that open doors never stand between robot and faucet;
    the drawers' front is flush with the counter's, so that their handles can be reached.
    """
    counter = {
        "name": "counter_main",
        "type": "counter",
        "interior_obj": "sink",
        "size": [3.7, COUNTER_DEPTH, COUNTER_HEIGHT],
        "pos": [1.85, -COUNTER_DEPTH / 2, COUNTER_HEIGHT / 2],
        "obj_x_percent": 0.9,
        "obj_y_percent": 0.01,
    }
    stove = {
        "name": "stove",
        "type": "stove",
        "size": [None, 0.66, None],
        "align_to": "counter_main",
        "side": "right",
        "alignment": "top_back",
        "offset": [0.35, 0.0, 0.0],  # room for the robot's base in front of the faucet
    }
    drawers = {
        "name": "stack_1",
        "type": "stack",
        "levels": ["drawer", "drawer"],
        "percentages": [0.73, 0.27],
        "size": [0.6, drawer_depth, 0.84],
        "pos": [0.3, -DRAWER_FRONT + drawer_depth / 2, 0.47],
    }
    return {
        "room": {
            "walls": [
                {"name": "wall", "type": "wall", "size": [2.7, 1.5, 0.02], "pos": [2.7, 0, 1.5]}
            ],
            "floor": [
                {"name": "floor", "type": "floor", "size": [2.7, 1.8, 0.02], "pos": [2.7, -1.8, 0]}
            ],
        },
        "main_group": {
            "bottom_row": [{"name": "sink", "type": "sink"}, counter, stove],
            "bottom_row_cabinets": [drawers],
            "top_row": [
                _cabinet("cab_1", left=0.7, width=1.0),
                _cabinet("cab_2", left=1.7, width=0.9),
                {
                    "name": "microwave",
                    "type": "microwave",
                    "size": [0.6, 0.45, None],
                    "pos": [4.45, -0.225, 1.5],
                },
            ],
            "counter_accessories": [],
        },
    }


def full(drawer_depth: float = DRAWER_DEPTH) -> Layout:
    """The small kitchen made wider, with a fridge whose freezer has racks, a dishwasher, small
    appliances, and an island with stools to dine at.

    Small appliances are there in the tasks that ask for them, as in RoboCasa's own layouts.
    """
    layout = small(drawer_depth)
    room, group = layout["room"], layout["main_group"]
    width = 7.2
    room["walls"][0].update(size=[width / 2, 1.5, 0.02], pos=[width / 2, 0, 1.5])
    room["floor"][0].update(size=[width / 2, 2.4, 0.02], pos=[width / 2, -2.4, 0])
    room["floor_accessories"] = [_stool(number, 1.4 + 0.8 * number) for number in range(3)]
    group["bottom_row"] += [
        {
            "name": "counter_right",
            "type": "counter",
            "size": [1.1, COUNTER_DEPTH, COUNTER_HEIGHT],
            "align_to": "stove",
            "side": "right",
            "alignment": "top_back",
        },
        {
            "name": "fridge",
            "type": "fridge_side_by_side",
            "align_to": "counter_right",
            "side": "right",
            "alignment": "bottom_back",
        },
    ]
    group["bottom_row_cabinets"].append(
        {
            "name": "dishwasher",
            "type": "dishwasher",
            "size": [0.65, 0.6, 0.89],
            "pos": [2.0, -0.3, 0.445],
        }
    )
    group["counter_accessories"] = _appliances()
    layout["island_group"] = {
        "group_origin": [0, 0],
        "group_pos": [2.2, -1.9],
        "group_z_rot": 3.1415,
        "island": [
            {
                "name": "island",
                "type": "counter",
                "default_config_name": "island",
                "size": [2.4, 0.9, COUNTER_HEIGHT],
                "pos": [0, 0.9, COUNTER_HEIGHT / 2],
                "base_opening": [False, True],
            }
        ],
    }
    return layout


def deep() -> Layout:
    """The full kitchen with drawers as deep as RoboCasa's own."""
    return full(DEEP_DRAWER)


def roomy() -> Layout:
    """The full kitchen with a big fridge."""
    layout = full()
    (fridge,) = (row for row in layout["main_group"]["bottom_row"] if row["name"] == "fridge")
    fridge.update(ROOMY_FRIDGE)
    return layout


KITCHENS: Mapping[str, Callable[[], Layout]] = {
    "small": small,
    "full": full,
    "deep": deep,
    "roomy": roomy,
}


def _stool(number: int, left: float) -> dict[str, Any]:
    return {
        "name": f"stool_{number + 1}",
        "type": "stool",
        "attach_to": "floor",
        "z_rot": 3.1415,
        "pos": [left, STOOL_Y, None],
    }


def _appliances() -> list[dict[str, Any]]:
    """Each below a cabinet or on the counter beside the stove, its back to the wall."""
    loose = {
        "has_free_joints": True,
        "placement": "anchor",
        "auxiliary_placement_args": {"ensure_valid_placement": False},
    }
    return [
        _appliance("coffee_machine", "cab_1", (0.45, 0.52), (0.5, 1.0), enable=True),
        _appliance("toaster_oven", "cab_2", (1.0, 0.5), (None, 1.0), config_name="default")
        | {"size": list(TOASTER_OVEN)},
        _appliance("electric_kettle", "cab_2", (0.8, 0.3), (0.0, -0.75)),
        # Its head points away from the coffee machine's end of the counter, and has room to tilt.
        _appliance("stand_mixer", "cab_1", (0.5, 0.25), (-1.0, -1.0), turned=-1.57),
        _appliance("blender", "cab_2", (0.5, 0.25), (0.0, -1.0), aux_fixture_config=loose),
        _appliance("toaster", None, (1.0, 0.4), (None, 1.0), enable=True),
        _appliance("digital_scale", "cab_1", (0.5, 0.3), (None, 1.0), is_clutter=True),
        _appliance("dish_rack", "cab_2", ("obj", 0.5), (0.5, 1.0)),
    ]


def _appliance(
    name: str,
    below: str | None,
    size: tuple[Any, float],
    at: tuple[float | None, float],
    turned: float = 0.0,
    enable: bool = False,
    **more: Any,
) -> dict[str, Any]:
    placement: dict[str, Any] = {
        "fixture": "counter_main_main_group" if below else "counter_right_main_group",
        "size": list(size),
        "pos": list(at),
        "rotation": [turned, turned],
    }
    if below:
        placement["sample_region_kwargs"] = {"ref": below}
    return {"name": name, "type": name, "enable": enable, "placement": placement, **more}


def _cabinet(name: str, left: float, width: float) -> dict[str, Any]:
    """A wall cabinet with two doors and two levels.

    Its floor is as high as RoboCasa still puts things into (1.50 m), so that a hand has room
    below it and above its lower level.
    """
    depth, height, bottom = 0.40, 0.80, 1.45
    return {
        "name": name,
        "type": "hinge_cabinet",
        "default_config_name": "cab_top",
        "size": [width, depth, height],
        "pos": [left + width / 2, -depth / 2, bottom + height / 2],
    }
