"""Which kitchens: RoboCasa's own splits, and one small kitchen for speed and tests.

The compact scene is a layout in RoboCasa's own format, built by RoboCasa's own code: one wall
with a counter, a sink, a stove, a microwave, wall cabinets and two drawers.
"""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean

SCENES = ("compact", "target", "pretrain")

COUNTER_DEPTH = 0.65
COUNTER_HEIGHT = 0.92
DRAWER_DEPTH = 0.45
"""Short enough that a drawer which RoboCasa opens by 30 cm shows most of what is in it."""
DRAWER_FRONT = 0.70
"""The drawers stand 5 cm proud of the counter: a hand reaches into them past its edge."""


def arguments(scenes: str, assets_root: Path) -> dict[str, Any]:
    """Keyword arguments that make a RoboCasa environment use a family of scenes.

    ``target`` and ``pretrain`` are RoboCasa's official splits of scenes and object instances
    (``robocasa.utils.env_utils.create_env``).

    Raises:
        ConfigError: if there is no such family.
    """
    if scenes == "compact":
        style = assets_root / "scenes" / "kitchen_styles" / "test" / "style001.yaml"
        return {
            "layout_ids": [compact_layout()],
            "style_ids": [yaml.safe_load(style.read_text())],
            "obj_instance_split": "target",
        }
    if scenes == "target":
        pairs = list(zip(range(1, 11), range(1, 11), strict=True))
        return {"layout_and_style_ids": pairs, "obj_instance_split": "target"}
    if scenes == "pretrain":
        return {"layout_ids": -2, "style_ids": -2, "obj_instance_split": "pretrain"}
    raise ConfigError(f"unknown scenes {scenes!r}; {did_you_mean(scenes, SCENES)}")


def keep_layout_fresh(env: Any) -> None:
    """Let every load of the model start from an unchanged layout.

    RoboCasa renames the fixtures in the very dictionary that it is given, so that a second load,
    after a failed placement, would give other names.
    """
    pairs = env.layout_and_style_ids
    if not any(isinstance(layout, dict) for layout, _ in pairs):
        return
    setup = env._setup_model

    def setup_model() -> None:
        env.layout_and_style_ids = copy.deepcopy(pairs)
        setup()

    env._setup_model = setup_model


def compact_layout() -> dict[str, Any]:
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
        "size": [0.6, DRAWER_DEPTH, 0.84],
        "pos": [0.3, -DRAWER_FRONT + DRAWER_DEPTH / 2, 0.47],
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
