"""Packs: rules that others ask for, together, a folder each.

`properties/packs/NAME/` has `pack.yaml`, which says where the rules come from, a property in every
other `*.yaml`, and if it brings scenes, tasks in `tasks/`. Ids of the rules begin with the pack's
name, so that an id alone says which pack it is of, and none is in two:

    pack: is-bench
    title: Mitigation before or after a risky step
    source: IS-Bench (Lu et al. 2025)
    about: What the source asks, and how the rules follow it.
    not_expressed:
      Tasting food: the robot has no mouth
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.folders import is_hidden, yaml_files
from pytest_safemanip.spec.properties import Property, load_properties
from pytest_safemanip.trace.elements import ROBOT

FOLDER, DESCRIPTION, TASKS = "packs", "pack.yaml", "tasks"
"""Below the shipped properties; in the folder of a pack what describes it, and its staged tasks."""
NO_PACK = "default"
"""What selects the properties that are of no pack: they are judged where nothing is asked for."""


@dataclass(frozen=True)
class Pack:
    """Rules of one source.

    Attributes:
        name: what comes after ``pack:``; also the name of its folder.
        title: what it is about, in a line.
        source: what its rules follow, as a citation.
        about: what the source asks, and how the rules follow it.
        not_expressed: what of the source is no rule, and why.
        rules: by id.
    """

    name: str
    title: str
    source: str
    about: str
    not_expressed: Mapping[str, str]
    rules: Mapping[str, Property]


def load_packs(
    shipped: Path,
    *,
    propositions: Mapping[str, Proposition] | None = None,
    categories: Mapping[str, str] | None = None,
    parameters: Collection[str] | None = None,
) -> dict[str, Pack]:
    """Read all packs.

    Args:
        shipped: the folder of shipped properties, which has them in a folder of their own.
        propositions: as for `load_properties`.
        categories: as for `load_properties`.
        parameters: as for `load_properties`.

    Returns:
        The packs by name, in the order of names.

    Raises:
        ConfigError: a file is wrong or would not be read, a pack has no description, or an id does
            not begin with the name of its pack.
    """
    found: dict[str, Pack] = {}
    for path in (folder / DESCRIPTION for folder in _folders(shipped)):
        rules = load_properties(
            [path.parent],
            propositions=propositions,
            constants=(ROBOT,),
            categories=categories,
            parameters=parameters,
            besides=(DESCRIPTION,),
        )
        pack = _described(path, rules)
        for other in found.values():
            for name in sorted(set(pack.rules) & set(other.rules)):
                raise ConfigError(f"{rules[name].path}: pack:{other.name} has a rule {name!r}, too")
        found[pack.name] = pack
    return found


def task_folders(shipped: Path) -> list[Path]:
    """The folders of the tasks of packs, in the order of the packs' names."""
    return sorted((shipped / FOLDER).glob(f"*/{TASKS}"))


def check_no_packs(folder: Path, shipped: Path) -> None:
    """Refuse a folder of one's own properties that has packs, which would not be read.

    Args:
        folder: the user's.
        shipped: the folder of shipped properties.

    Raises:
        ConfigError: if it has some.
    """
    for path in sorted(folder.glob(f"{FOLDER}/*/{DESCRIPTION}")):
        raise ConfigError(
            f"{path}: packs are read from {shipped / FOLDER} only; name {path.parent} in "
            f"safemanip_property_paths, without {DESCRIPTION}, to have its rules as your own"
        )


def _folders(shipped: Path) -> list[Path]:
    """The folders of packs, by name.

    Raises:
        ConfigError: if rules lie where none are read.
    """
    place = shipped / FOLDER
    if not place.is_dir():
        return []
    for path in yaml_files(place):
        raise ConfigError(f"{path}: belongs to no pack; put it into the folder of one")
    found = sorted(path for path in place.iterdir() if path.is_dir())
    for folder in found:
        own = yaml_files(folder)
        if is_hidden(folder) and own:
            raise ConfigError(f"{folder}: hidden folders are not read; rename it, or take it away")
        if not is_hidden(folder) and folder / DESCRIPTION not in own:
            raise ConfigError(
                f"{folder}: a pack without {DESCRIPTION}; add one, with pack: {folder.name}"
            )
        for inner in sorted(path for path in folder.iterdir() if path.is_dir()):
            if inner.name != TASKS and yaml_files(inner):
                raise ConfigError(
                    f"{inner}: of the folders in a pack only {TASKS!r} is read; rename it"
                )
    return [folder for folder in found if not is_hidden(folder)]


def _described(path: Path, rules: Mapping[str, Property]) -> Pack:
    section = yamlfile.load(path)
    section.check_keys(("pack", "title", "source", "about", "not_expressed"))
    name = section.string("pack")
    if name != path.parent.name:
        raise section.error("pack", f"expected {path.parent.name!r}, as its folder, found {name!r}")
    if name == NO_PACK:
        message = f"{name!r} selects the properties of no pack; give it and its folder another name"
        raise section.error("pack", message)
    if not rules:
        raise section.error("pack", f"{name!r} has no rules; add some beside {DESCRIPTION}")
    prefix = f"{name.replace('-', '_')}_"
    for rule in rules.values():
        if not rule.id.startswith(prefix):
            raise ConfigError(f"{rule.path}: id {rule.id!r} does not begin with {prefix!r}")
    left_out = section.section("not_expressed")
    return Pack(
        name=name,
        title=section.one_line("title"),
        source=section.one_line("source"),
        about=section.one_line("about"),
        not_expressed=MappingProxyType({what: left_out.one_line(what) for what in left_out}),
        rules=MappingProxyType({id_: replace(rule, pack=name) for id_, rule in rules.items()}),
    )
