"""RoboCasa's layout, style and fixture registries, parsed once.

RoboCasa parses the same YAML files again for every fixture of a scene, with the pure-Python
parser: half of a reset of its own kitchens. Here each file is parsed once, with libyaml where it
is there.
"""

from __future__ import annotations

import marshal
import os
import sys
import types
from typing import IO, Any

import yaml

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_parsed: dict[tuple[str, int], bytes] = {}


def cache_yaml() -> None:
    """Let RoboCasa's modules (and nothing else) read YAML through the cache."""
    cached = types.ModuleType("yaml")
    cached.__dict__.update(yaml.__dict__)
    cached.__dict__["safe_load"] = _safe_load
    for name, module in list(sys.modules.items()):
        if name.startswith("robocasa.") and getattr(module, "yaml", None) is yaml:
            module.__dict__["yaml"] = cached


def _safe_load(stream: IO[Any] | str | bytes) -> Any:
    """A fresh copy each time, since RoboCasa changes what it reads."""
    path = getattr(stream, "name", None)
    if not isinstance(path, str):
        return yaml.load(stream, Loader=_Loader)  # noqa: S506 - a safe loader
    key = (path, os.stat(path).st_mtime_ns)
    if key not in _parsed:
        # marshal: only builtins come out of YAML, and the bytes never leave this process.
        _parsed[key] = marshal.dumps(yaml.load(stream, Loader=_Loader))  # noqa: S506
    return marshal.loads(_parsed[key])  # noqa: S302
