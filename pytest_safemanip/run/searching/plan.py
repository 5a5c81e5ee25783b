"""Which searches and kept failures a run has, checked before anything is simulated."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import TypeVar

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.run.cases import SUITE, Case, is_search_id, select_tasks
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.kinds.definition import Kind
from pytest_safemanip.search.regression import Regression, load_regressions
from pytest_safemanip.search.search import Effort
from pytest_safemanip.search.space import (
    Applicable,
    Space,
    applicable,
    check_applicable,
    check_drawn,
    load_space,
)
from pytest_safemanip.sim.backend import DrawsObjects
from pytest_safemanip.sim.registry import check_backend
from pytest_safemanip.spec.task import Task

SENSES: Mapping[str, frozenset[str]] = {
    "scripted": frozenset({"hand"}),
    "random": frozenset(),
    "hold": frozenset(),
    "recording": frozenset(),
}
"""What the shipped policies sense; of others one has to assume everything."""
EVERYTHING = frozenset({"images", "instruction", "hand"})


@dataclass(frozen=True, slots=True)
class SearchCase:
    """The search for a violation of a property by a policy in a task.

    Attributes:
        task: name of the task.
        policy: name of the policy.
        property_id: of the property.
    """

    task: str
    policy: str
    property_id: str

    @property
    def name(self) -> str:
        """Name of the test item."""
        return f"test_search[{self.task}-{self.policy}-{self.property_id}]"

    @property
    def node_id(self) -> str:
        """Node id of the test item."""
        return f"{SUITE}::{self.name}"

    @property
    def heading(self) -> str:
        """What its section in a report begins with."""
        return f"search / {self.task} / {self.policy} / {self.property_id}"


@dataclass(frozen=True)
class RegressionCase:
    """A kept failure, tried again with a policy.

    Attributes:
        regression: the failure.
        policy: name of the policy.
    """

    regression: Regression
    policy: str

    @property
    def case(self) -> Case:
        """The case that it is a variation of."""
        own = self.regression
        return Case(own.task, self.policy, own.property_id, own.seed)

    @property
    def name(self) -> str:
        """Name of the test item."""
        return f"test_regression[{self.regression.name}-{self.policy}]"

    @property
    def node_id(self) -> str:
        """Node id of the test item."""
        return f"{SUITE}::{self.name}"

    @property
    def heading(self) -> str:
        """What its section in a report begins with."""
        return f"regression / {self.regression.name} / {self.policy}"


@dataclass(frozen=True)
class SearchPlan:
    """Searches and kept failures.

    Attributes:
        cases: the searches, those of a task and a policy next to each other.
        spaces: what each task and policy may have otherwise.
        effort: how much is tried for each.
        seeds: of the episodes.
        regressions: the failures that are tried again.
        folder: where failures are kept.
    """

    cases: tuple[SearchCase, ...]
    spaces: Mapping[tuple[str, str], Applicable]
    effort: Effort
    seeds: tuple[int, ...]
    regressions: tuple[RegressionCase, ...]
    folder: Path


T = TypeVar("T", SearchCase, RegressionCase)


def make_search_plan(plan: Plan, added: Sequence[Kind], backends: Collection[str]) -> SearchPlan:
    """Lay out the searches of a run, and the failures that it tries again.

    Args:
        plan: the run.
        added: kinds of dimensions that the user's hooks give.
        backends: names of those that they give.

    Raises:
        ConfigError: if a space or a kept failure is wrong, or nothing of a space can be otherwise.
    """
    kinds, settings = Kinds(added), plan.settings
    kept = load_regressions(settings.regressions, kinds)
    regressions = tuple(_regressions(plan, kept.values(), backends))
    effort = Effort(rollouts=settings.search or 0)
    searches: tuple[SearchCase, ...] = ()
    spaces: dict[tuple[str, str], Applicable] = {}
    if settings.search is not None:
        searches = tuple(
            dict.fromkeys(SearchCase(c.task, c.policy, c.property_id) for c in plan.every)
        )
        loaded = [load_space(path, kinds) for path in settings.spaces or (_shipped(),)]
        for task, policy in dict.fromkeys((case.task, case.policy) for case in searches):
            spaces[task, policy] = _space(plan, loaded, plan.tasks[task], plan.policies[policy])
    known = {*(own.node_id for own in searches), *(own.node_id for own in regressions)}
    _check_ids(plan.settings.select, known)
    return SearchPlan(
        tuple(_selected(plan, searches)),
        spaces,
        effort,
        settings.seeds or (0,),
        tuple(_selected(plan, regressions)),
        settings.regressions,
    )


def _check_ids(selected: Iterable[str], known: set[str]) -> None:
    for text in selected:
        if is_search_id(text) and text not in known:
            raise ConfigError(f"unknown node id: {text}; {did_you_mean(text, known)}")


def _selected(plan: Plan, cases: Iterable[T]) -> list[T]:
    """Those that node ids on the command line name; all without any, or with all of the suite."""
    wanted = {text for text in plan.settings.select if text.rstrip(":") != SUITE}
    if len(wanted) < len(set(plan.settings.select)) or not wanted:
        return list(cases)
    return [case for case in cases if case.node_id in wanted]


def _shipped() -> Path:
    return resources.folder("searches") / "default.yaml"


def _space(plan: Plan, spaces: Sequence[Space], task: Task, policy: PolicySpec) -> Applicable:
    """What of the spaces that are meant for a task it has."""
    own = [
        space
        for space in spaces
        if task in select_tasks(plan.tasks, space.tasks, f"{space.place}: tasks")
    ]
    if not own:
        places = ", ".join(space.place for space in spaces)
        raise ConfigError(f"{places}: no space is meant for {task.name}; leave out 'tasks' of one")
    if plan.simulator is None:
        raise ConfigError("--safemanip-search has nothing to run with --safemanip-recordings")
    senses = SENSES.get(policy.name.partition(":")[0], EVERYTHING)
    spec = plan.simulator.spec.in_task(task.simulated)
    space = reduce(Space.joined, own)
    kinds = _object_kinds(plan)
    for declared in space.declared if kinds else ():
        one = declared.dimension
        check_drawn(one.kind, one.about, one.choices, kinds, declared.place)
    return applicable(space, task, spec, plan.scenes(policy.name), senses)


def _regressions(
    plan: Plan, kept: Iterable[Regression], backends: Collection[str]
) -> Iterable[RegressionCase]:
    """Those of the tasks and properties of this run, with each of its policies."""
    if plan.simulator is None:
        return
    known = {(case.policy, case.task, case.property_id) for case in plan.every}
    kinds = _object_kinds(plan)
    for own in kept:
        _check_known(own, "property", own.property_id, plan.properties, "safemanip properties")
        check_backend(own.backend, backends, f"{own.path}: backend")
        if own.backend != plan.settings.backend:
            continue
        _check_known(own, "task", own.task, plan.tasks, "safemanip tasks")
        task = plan.tasks[own.task]
        spec = plan.simulator.spec.in_task(task.simulated)
        for change in own.changes:
            check_applicable(change.kind, change.about, task, spec, str(own.path))
            if kinds:
                size = change.setting.size
                check_drawn(change.kind, change.about, (size,), kinds, str(own.path))
        if own.scenes:
            plan.simulator.spec.check_scenes(own.scenes, str(own.path))
        for policy in plan.policies:
            here = not own.scenes or own.scenes == plan.scenes(policy)
            if here and (policy, own.task, own.property_id) in known:
                yield RegressionCase(own, policy)


def _object_kinds(plan: Plan) -> Collection[str]:
    """What the simulator draws objects from; empty where nobody knows."""
    factory = plan.simulator.create if plan.simulator else None
    return factory.object_kinds() if isinstance(factory, DrawsObjects) else ()


def _check_known(
    kept: Regression, what: str, name: str, known: Mapping[str, object], listed_by: str
) -> None:
    """Refuse a kept failure that would silently never be tried."""
    if name not in known:
        hint = did_you_mean(name, known, listed_by)
        raise ConfigError(f"{kept.path}: unknown {what} {name!r}; {hint}")
