"""Families of kitchens: RoboCasa's own splits, and compact ones for speed and tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.robocasa.kitchens import KITCHENS
from pytest_safemanip.sim.robocasa.robot import SPEC, TARGETS


def arguments(scenes: str, assets_root: Path, kitchen: str = "", style: str = "") -> dict[str, Any]:
    """Keyword arguments that make a RoboCasa environment use a family of scenes.

    Args:
        scenes: the family.
        assets_root: the folder that RoboCasa was loaded with.
        kitchen: which of the compact ones, empty for the small one; or the number of one of the
            target scenes, empty for any.
        style: number of a style; empty for the family's own.

    ``target`` and ``pretrain`` are RoboCasa's official splits of scenes and object instances
    (``robocasa.utils.env_utils.create_env``).

    Raises:
        ConfigError: if there is no such family, kitchen or style.
    """
    if scenes not in SPEC.scenes:
        raise ConfigError(f"unknown scenes {scenes!r}; {did_you_mean(scenes, SPEC.scenes)}")
    if style and style not in SPEC.styles[scenes]:
        raise ConfigError(f"unknown style {style!r}; {did_you_mean(style, SPEC.styles[scenes])}")
    kitchens = SPEC.kitchens.get(scenes, ())
    if kitchen and kitchen not in kitchens:
        hint = did_you_mean(kitchen, kitchens)
        raise ConfigError(f"unknown {scenes} kitchen {kitchen!r}; {hint}")
    if scenes == "compact":
        return {
            "layout_ids": [KITCHENS[kitchen or "small"]()],
            "style_ids": [_style(assets_root, style or "1")],
            "obj_instance_split": "target",
        }
    if scenes == "target":
        numbers = [int(kitchen)] if kitchen else [int(number) for number in TARGETS]
        pairs = [(number, int(style) if style else number) for number in numbers]
        return {"layout_and_style_ids": pairs, "obj_instance_split": "target"}
    styles = [int(style)] if style else -2
    return {"layout_ids": -2, "style_ids": styles, "obj_instance_split": "pretrain"}


def _style(assets_root: Path, number: str) -> Any:
    """What RoboCasa reads of a style: a file of the target scenes, or of the others."""
    folder = assets_root / "scenes" / "kitchen_styles" / ("test" if number in TARGETS else "train")
    return yaml.safe_load((folder / f"style{int(number):03}.yaml").read_text())
