"""What a dataset says of an episode (``ep_meta.json``), checked before RoboCasa believes it."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import TraceError
from pytest_safemanip.sim.robocasa.kitchens import KITCHENS
from pytest_safemanip.sim.robocasa.playback.model_xml import below
from pytest_safemanip.trace.typed import shown

MOST_OBJECTS = 1000
_OBJECT = re.compile(r".*/objects/(.+)", re.DOTALL)
"""How RoboCasa finds the model of an object in whatever path."""
KITCHEN = "safemanip_kitchen"
"""Key of the name of a compact kitchen; RoboCasa's own datasets have numbers of layouts instead."""
PUBLISHED = "/robocasa/models/assets/objects"


def published(meta: Mapping[str, Any], kitchen: str) -> dict[str, Any]:
    """RoboCasa's description of an episode for a dataset: plain JSON, no path of this machine.

    Args:
        meta: RoboCasa's own (``get_ep_meta``).
        kitchen: name of the compact kitchen; empty in RoboCasa's own scenes.
    """
    found: dict[str, Any] = _plain(copy.deepcopy(dict(meta)))
    for config in found["object_cfgs"]:
        info = config.get("info", {})
        if match := _OBJECT.fullmatch(str(info.get("mjcf_path", ""))):
            info["mjcf_path"] = f"{PUBLISHED}/{match[1]}"
    if kitchen:
        # RoboCasa has renamed the fixtures in the layout that it was given.
        found |= {"layout_id": _plain(KITCHENS[kitchen]()), KITCHEN: kitchen}
    return found


def kitchen_of(meta: Mapping[str, Any]) -> str:
    """The compact kitchen of an episode; empty in RoboCasa's own scenes.

    Raises:
        TraceError: if its layout is neither one of ours nor one of RoboCasa's, by its number.
    """
    layout, kitchen = meta.get("layout_id"), meta.get(KITCHEN, "")
    if type(layout) is int and type(meta.get("style_id")) is int and not kitchen:
        return ""
    if isinstance(kitchen, str) and kitchen in KITCHENS and layout == _plain(KITCHENS[kitchen]()):
        return kitchen
    raise TraceError(
        f"ep_meta: the layout {shown(layout)} is none of RoboCasa's numbers and no compact kitchen "
        "of this version"
    )


def checked(meta: object, assets_root: Path) -> dict[str, Any]:
    """A description that RoboCasa can set up an episode from, and that reads nothing but assets.

    Args:
        meta: as it was read.
        assets_root: the folder that RoboCasa was loaded with.

    Raises:
        TraceError: naming what is wrong.
    """
    if not isinstance(meta, dict):
        raise TraceError("ep_meta: must be a mapping")
    configs = meta.get("object_cfgs")
    if not isinstance(configs, list) or len(configs) > MOST_OBJECTS:
        raise TraceError(f"ep_meta: object_cfgs must be a list of at most {MOST_OBJECTS}")
    for config in configs:
        _check_object(config, assets_root)
    for name in ("init_robot_base_pos", "init_robot_base_ori"):
        value = meta.get(name)
        if not (isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))):
            raise TraceError(f"ep_meta: {name} must be three numbers, found {shown(value)}")
    references = meta.get("fixture_refs", {})
    if not isinstance(references, dict) or not all(
        isinstance(name, str) for name in references.values()
    ):
        raise TraceError(f"ep_meta: fixture_refs must be names, found {shown(references)}")
    if not isinstance(meta.get("lang", ""), str):
        raise TraceError("ep_meta: lang must be a text")
    kept = {name: value for name, value in meta.items() if name not in (KITCHEN, "gen_textures")}
    if kitchen_of(meta):  # its arguments bring it, fresh
        del kept["layout_id"], kept["style_id"]
    return kept


def _check_object(config: object, assets_root: Path) -> None:
    info = config.get("info") if isinstance(config, dict) else None
    path = info.get("mjcf_path") if isinstance(info, dict) else None
    if not isinstance(path, str):
        raise TraceError(
            f"ep_meta: object_cfgs: {shown(config)} does not say which model the object has"
        )
    match = _OBJECT.fullmatch(path.replace("\\", "/"))
    if not match:
        raise TraceError(f"ep_meta: {shown(path)} is no model of an object of RoboCasa's")
    below(assets_root / "objects", match[1], path)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _plain(value: Any) -> Any:
    """Builtins that JSON has, of what RoboCasa keeps: tuples, arrays, numbers of NumPy."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple | set):
        return [_plain(item) for item in value]
    return value if isinstance(value, bool | int | float | str | None) else str(value)
