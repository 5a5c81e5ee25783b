"""Which files of a folder are read: one rule for properties, tasks and packs.

Every ``*.yaml`` of the folder itself is. What looks like one and would be passed over is refused: a
rule that nobody judges looks like one that nobody breaks.
"""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import ConfigError

_SUFFIX = ".yaml"
_ALIKE = (_SUFFIX, ".yml")


def yaml_files(folder: Path) -> list[Path]:
    """The YAML files of a folder, by name; subfolders are not searched.

    Raises:
        ConfigError: if the folder cannot be read, or has a YAML file that is hidden or ends
            otherwise than in ``.yaml``.
    """
    try:
        found = sorted(path for path in folder.iterdir() if path.suffix.lower() in _ALIKE)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be read: {error.strerror}") from error
    for path in found:
        if is_hidden(path):
            raise ConfigError(f"{path}: hidden files are not read; rename it, or take it away")
        if path.suffix != _SUFFIX:
            named = path.with_suffix(_SUFFIX).name
            raise ConfigError(f"{path}: only *{_SUFFIX} is read; rename it to {named!r}")
    return found


def is_hidden(path: Path) -> bool:
    """Whether shells and file managers do not show a file or folder."""
    return path.name.startswith(".")
