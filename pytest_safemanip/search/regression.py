"""Failures that are kept: a few lines of YAML each, which later runs try again.

    task: PickPlaceCounterToCabinet
    property: release_stability
    seed: 0
    backend: robocasa
    scenes: compact
    changes:
      - {move: obj, along: left, size: -4 cm}
      - {push: robot, size: 6 N s, at: 2.5 s, towards: 90 deg}
    found: scripted fails 9 of 10

What a change is of, it is about, and its numbers are named as in a space. ``found`` is for people.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.kinds.definition import Kind, Setting
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.search.space import about_of, check_size, kind_of
from pytest_safemanip.search.units import parse_size, show
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.folders import yaml_files

MOST = 40
"""Changes of one failure."""
_REQUIRED = ("task", "property", "seed", "backend", "changes")
_OPTIONAL = ("scenes", "repeat", "found")


@dataclass(frozen=True)
class Change:
    """One thing that is otherwise.

    Attributes:
        kind: what it is of.
        about: what it is about.
        setting: its value.
    """

    kind: Kind
    about: Mapping[str, str]
    setting: Setting

    def to_plain(self) -> dict[str, str]:
        """As in YAML."""
        size = self.setting.size
        own = {"choice": size} if isinstance(size, str) else {"size": show(size, self.kind.unit)}
        details = {
            name: show(value, self.kind.details[name].unit) for name, value in self.setting.details
        }
        return {**self.about, **own, **details}


@dataclass(frozen=True)
class Regression:
    """A failure that is kept.

    Attributes:
        task: name of the task.
        property_id: what was violated.
        seed: of the episode.
        backend: where.
        scenes: family of scenes; empty for that of the run.
        changes: what is otherwise.
        found: how it was found, for people.
        path: its file.
        repeat: of the run that failed, see :class:`~pytest_safemanip.search.trials.Trial`.
    """

    task: str
    property_id: str
    seed: int
    backend: str
    scenes: str
    changes: tuple[Change, ...]
    found: str = ""
    path: Path = Path()
    repeat: int = 0

    @property
    def name(self) -> str:
        """Its file's name without the ending: part of node ids."""
        return self.path.stem

    @property
    def situation(self) -> Situation:
        """What its episode has otherwise."""
        situation = Situation()
        for change in self.changes:
            situation = change.kind.apply(situation, change.about, change.setting)
        return situation

    def save_in(self, folder: Path, stem: str) -> Path:
        """Write it into a folder; the file.

        Args:
            folder: the folder.
            stem: of the file's name, which gets a number where another failure has it.
        """
        for number in count(1):
            path = folder / f"{stem}-{number}.yaml" if number > 1 else folder / f"{stem}.yaml"
            if not path.exists() or self._is_in(path):
                break
        replace(self, path=path).save()
        return path

    def _is_in(self, path: Path) -> bool:
        """Whether a file keeps the same failure, however often it failed."""
        known, own = yaml.safe_load(path.read_text(encoding="utf-8")), self._to_plain()
        decides = {*_REQUIRED, "scenes"}
        return isinstance(known, dict) and all(known.get(k) == own.get(k) for k in decides)

    def _to_plain(self) -> dict[str, Any]:
        """As in YAML."""
        return {
            "task": self.task,
            "property": self.property_id,
            "seed": self.seed,
            "backend": self.backend,
            **({"scenes": self.scenes} if self.scenes else {}),
            **({"repeat": self.repeat} if self.repeat else {}),
            "changes": [change.to_plain() for change in self.changes],
            **({"found": self.found} if self.found else {}),
        }

    def save(self) -> None:
        """Write its file."""
        plain = self._to_plain()
        text = yaml.safe_dump(plain, sort_keys=False, default_flow_style=None, width=100)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        whole = self.path.with_suffix(f".{os.getpid()}")
        whole.write_text(text, encoding="utf-8")
        whole.replace(self.path)


def changes_of(deviation: Deviation, dimensions: Dimensions) -> tuple[Change, ...]:
    """A deviation without the space that it was found in."""
    known = dimensions.by_name
    return tuple(
        Change(known[name].kind, known[name].about, setting) for name, setting in deviation.settings
    )


def as_dimensions(changes: tuple[Change, ...]) -> tuple[Dimensions, Deviation]:
    """Changes as values of dimensions of their own."""
    own = [
        (Dimension(f"change_{number}", change.kind, change.about), change.setting)
        for number, change in enumerate(changes, start=1)
    ]
    return (
        Dimensions(tuple(dimension for dimension, _ in own)),
        Deviation(tuple((dimension.name, setting) for dimension, setting in own)),
    )


def load_regressions(folder: Path, kinds: Mapping[str, Kind]) -> dict[str, Regression]:
    """All of a folder, by name; none if there is no such folder.

    Raises:
        ConfigError: naming file, line and what is wrong there; also if a file looks like one of
            them and would be passed over.
    """
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--safemanip-regressions: {folder} is no folder")
    found = yaml_files(folder) if folder.exists() else []
    return {path.stem: load_regression(path, kinds) for path in found}


def load_regression(path: Path, kinds: Mapping[str, Kind]) -> Regression:
    """Read one.

    Raises:
        ConfigError: naming file, line and what is wrong there.
    """
    section = yamlfile.load(path)
    section.check_keys(_REQUIRED, _OPTIONAL)
    changes = section.sections("changes")
    if not 1 <= len(changes) <= MOST:
        raise section.error("changes", f"expected 1 to {MOST}, found {len(changes)}")
    return Regression(
        section.string("task"),
        section.string("property"),
        section.whole("seed"),
        section.string("backend"),
        section.string("scenes") if "scenes" in section else "",
        tuple(_change(own, kinds) for own in changes),
        section.string("found") if "found" in section else "",
        path,
        section.whole("repeat") if "repeat" in section else 0,
    )


def _change(own: yamlfile.Section, kinds: Mapping[str, Kind]) -> Change:
    kind = kind_of(own, kinds)
    sized = "size" if kind.unit else "choice"
    own.check_keys((*kind.keys, sized, *kind.details), ())
    details = tuple((name, _size(own, name, detail.unit)) for name, detail in kind.details.items())
    size = _size(own, sized, kind.unit) if kind.unit else own.string(sized)
    if size == 0.0:
        raise own.error(sized, "expected a size other than 0")
    if isinstance(size, float):
        check_size(own, sized, kind, size)
    return Change(kind, about_of(own, kind), Setting(size, details))


def _size(own: yamlfile.Section, key: str, unit: str) -> float:
    try:
        return parse_size(own.string(key), unit)
    except ConfigError as error:
        raise own.error(key, str(error)) from None
