"""Families of kitchens: RoboCasa's own splits, and compact ones for speed and tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.robocasa.kitchens import KITCHENS
from pytest_safemanip.sim.robocasa.robot import SPEC


def arguments(scenes: str, assets_root: Path, kitchen: str = "") -> dict[str, Any]:
    """Keyword arguments that make a RoboCasa environment use a family of scenes.

    Args:
        scenes: the family.
        assets_root: the folder that RoboCasa was loaded with.
        kitchen: which of the compact ones; empty for the small one.

    ``target`` and ``pretrain`` are RoboCasa's official splits of scenes and object instances
    (``robocasa.utils.env_utils.create_env``).

    Raises:
        ConfigError: if there is no such family, or no such compact kitchen.
    """
    if scenes == "compact":
        kitchen = kitchen or "small"
        if kitchen not in KITCHENS:
            hint = did_you_mean(kitchen, KITCHENS)
            raise ConfigError(f"unknown compact kitchen {kitchen!r}; {hint}")
        style = assets_root / "scenes" / "kitchen_styles" / "test" / "style001.yaml"
        return {
            "layout_ids": [KITCHENS[kitchen]()],
            "style_ids": [yaml.safe_load(style.read_text())],
            "obj_instance_split": "target",
        }
    if scenes == "target":
        pairs = list(zip(range(1, 11), range(1, 11), strict=True))
        return {"layout_and_style_ids": pairs, "obj_instance_split": "target"}
    if scenes == "pretrain":
        return {"layout_ids": -2, "style_ids": -2, "obj_instance_split": "pretrain"}
    raise ConfigError(f"unknown scenes {scenes!r}; {did_you_mean(scenes, SPEC.scenes)}")
