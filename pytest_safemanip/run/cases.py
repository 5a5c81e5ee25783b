"""Which cases there are: task x policy x property x seed, and how they are named."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.spec.packs import NO_PACK
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task

SUITE = "safemanip"
_NODE_ID = re.compile(r"safemanip::test_safety\[(\w+)-(.+)-(\w+)-seed(\d+)\]")


@dataclass(frozen=True, slots=True)
class Case:
    """One property of one rollout.

    Attributes:
        task: name of the task.
        policy: name of the policy.
        property_id: of the property.
        seed: of the episode.
    """

    task: str
    policy: str
    property_id: str
    seed: int

    @property
    def name(self) -> str:
        """Name of the test item."""
        return f"test_safety[{self.task}-{self.policy}-{self.property_id}-seed{self.seed}]"

    @property
    def node_id(self) -> str:
        """Node id of the test item."""
        return f"{SUITE}::{self.name}"

    @property
    def heading(self) -> str:
        """What its section in a report begins with."""
        return f"{self.task} / {self.policy} / {self.property_id} / seed {self.seed}"

    @property
    def rollout(self) -> RolloutKey:
        """The rollout that the case needs."""
        return RolloutKey(self.policy, self.task, self.seed)


def is_case_id(text: str) -> bool:
    """Whether a node id is that of a case, and not of a law or of anything else."""
    return text.startswith(f"{SUITE}::test_safety[")


def is_law_id(text: str) -> bool:
    """Whether a node id is that of a law of a proposition."""
    return text.startswith(f"{SUITE}::fuzz[")


def is_search_id(text: str) -> bool:
    """Whether a node id is that of a search, or of a failure that was kept."""
    return text.startswith((f"{SUITE}::test_search[", f"{SUITE}::test_regression["))


def parse_node_id(text: str) -> Case:
    """The case that a node id names.

    Raises:
        ConfigError: if it is none of this suite.
    """
    match = _NODE_ID.fullmatch(text)
    if not match:
        raise ConfigError(
            f"unknown node id {text!r}; ids of the suite look like "
            f"{SUITE}::test_safety[TASK-POLICY-PROPERTY-seedN]"
        )
    return Case(match[1], match[2], match[3], int(match[4]))


def select_tasks(
    tasks: Mapping[str, Task], selectors: Sequence[str], option: str = "--safemanip-tasks"
) -> list[Task]:
    """Tasks by name, glob, ``suite:``, ``horizon:``, ``set:``, ``quick`` or ``all``; the last and
    ``horizon:`` without those that stage the scene of another.

    Args:
        tasks: all there are, by name.
        selectors: what is wanted.
        option: what the selectors were given for.

    Raises:
        ConfigError: if a selector matches nothing.
    """
    chosen: dict[str, Task] = {}
    sets = {name for task in tasks.values() for name in task.sets}
    for selector in selectors:
        found = [task for task in tasks.values() if _is_selected(task, selector)]
        if not found:
            hint = did_you_mean(selector, {*tasks, *sets, "all"}, "safemanip tasks")
            raise ConfigError(f"{option}: {selector!r} matches no task; {hint}")
        chosen.update((task.name, task) for task in found)
    return list(chosen.values())


def _is_selected(task: Task, selector: str) -> bool:
    kind, _, name = selector.partition(":")
    if name:
        own = () if task.base else (task.horizon,)
        groups = {"suite": (task.suite,), "horizon": own, "set": task.sets}
        return name in groups.get(kind, ())
    if selector == "all":
        return not task.base
    if selector in task.sets:
        return True
    return fnmatch.fnmatchcase(task.name, selector)


def select_properties(
    properties: Mapping[str, Property],
    selectors: Sequence[str],
    option: str = "--safemanip-properties",
) -> Collection[str]:
    """Ids of properties by id, glob, ``category:``, ``pack:`` or ``default``, all that are of no
    pack; these without a selector.

    Args:
        properties: all there are, by id.
        selectors: what is wanted.
        option: what the selectors were given for.

    Raises:
        ConfigError: if a selector matches nothing.
    """
    chosen: set[str] = set()
    for selector in selectors or (NO_PACK,):
        kind, _, name = selector.partition(":")
        if selector == NO_PACK:
            found = {p.id for p in properties.values() if not p.pack}
        elif kind == "category" and name:
            found = {p.id for p in properties.values() if p.category == name}
        elif kind == "pack":
            found = _of_pack(properties, name, option)
        else:
            found = set(fnmatch.filter(properties, selector))
        if not found:
            groups = {f"category:{p.category}" for p in properties.values()}
            groups |= {f"pack:{p.pack}" for p in properties.values() if p.pack} | {NO_PACK}
            hint = did_you_mean(selector, {*properties, *groups}, "safemanip properties")
            raise ConfigError(f"{option}: {selector!r} matches no property; {hint}")
        chosen |= found
    return chosen


def _of_pack(properties: Mapping[str, Property], name: str, option: str) -> set[str]:
    """Ids of the rules of a pack, or of all packs of a glob."""
    packs = {p.pack for p in properties.values() if p.pack}
    found = {p.id for p in properties.values() if p.pack and fnmatch.fnmatchcase(p.pack, name)}
    if not found:
        hint = did_you_mean(name, packs)
        known = f"; known: {', '.join(sorted(packs))}" if hint.startswith("did") else ""
        raise ConfigError(f"{option}: unknown pack {name!r}; {hint}{known}")
    return found


def applicable(
    task: Task, everywhere: Mapping[str, Property], wanted: Collection[str]
) -> list[str]:
    """Ids of the properties that apply to a task and are wanted.

    Args:
        task: names the properties that apply to it.
        everywhere: properties that apply wherever they have an instance.
        wanted: ids.
    """
    others = [p.id for p in everywhere.values() if p.id in wanted and p.may_apply(task)]
    return [name for name in dict.fromkeys([*task.properties, *others]) if name in wanted]


def keep_selected(cases: Iterable[Case], selected: Collection[str]) -> list[Case]:
    """The cases that node ids on the command line name; all of them without any.

    Raises:
        ConfigError: if an id names no case.
    """
    every = list(cases)
    wanted = {text for text in selected if text.rstrip(":") != SUITE}
    if len(wanted) < len(set(selected)) or not selected:
        return every
    known = {case.node_id for case in every}
    for text in sorted(wanted - known):
        raise ConfigError(f"unknown node id: {text}; {did_you_mean(text, known)}")
    return [case for case in every if case.node_id in wanted]
