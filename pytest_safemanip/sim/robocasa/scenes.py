"""Which kitchens: RoboCasa's own splits, and compact ones of our own for speed and tests."""

from __future__ import annotations

import atexit
import copy
import functools
import tempfile
from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.robocasa.kitchens import KITCHENS

SCENES = ("compact", "target", "pretrain")


def arguments(scenes: str, assets_root: Path, kitchen: str = "small") -> dict[str, Any]:
    """Keyword arguments that make a RoboCasa environment use a family of scenes.

    Args:
        scenes: the family.
        assets_root: the folder that RoboCasa was loaded with.
        kitchen: which of the compact ones.

    ``target`` and ``pretrain`` are RoboCasa's official splits of scenes and object instances
    (``robocasa.utils.env_utils.create_env``).

    Raises:
        ConfigError: if there is no such family, or no such compact kitchen.
    """
    if scenes == "compact":
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
    raise ConfigError(f"unknown scenes {scenes!r}; {did_you_mean(scenes, SCENES)}")


def keep_layout_fresh(env: Any) -> None:
    """Let every load of the model start from an unchanged layout.

    RoboCasa renames the fixtures in the very dictionary that it is given, so that a second load,
    after a failed placement, would give other names.
    """
    pairs = env.layout_and_style_ids
    if not any(isinstance(layout, dict) for layout, _ in pairs):
        return
    _let_read(next(layout for layout, _ in pairs if isinstance(layout, dict)))
    setup = env._setup_model

    def setup_model() -> None:
        env.layout_and_style_ids = copy.deepcopy(pairs)
        setup()

    env._setup_model = setup_model


def _let_read(layout: dict[str, Any]) -> None:
    """Let RoboCasa read a layout of ours where it asks for the file of one of its own.

    It does so to find the stools and the counters of an island.
    """
    from robocasa.models.scenes import scene_registry

    path = _written(yaml.safe_dump(layout))
    original = getattr(
        scene_registry.get_layout_path, "__wrapped__", scene_registry.get_layout_path
    )

    @functools.wraps(original)
    def get_layout_path(layout_id: Any) -> str:
        return path if isinstance(layout_id, dict) else str(original(layout_id))

    scene_registry.get_layout_path = get_layout_path


@functools.cache
def _written(text: str) -> str:
    """A file with this text, until the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="safemanip-layout-")
    atexit.register(folder.cleanup)
    path = Path(folder.name) / "layout.yaml"
    path.write_text(text)
    return str(path)
