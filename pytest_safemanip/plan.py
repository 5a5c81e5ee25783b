"""Everything that a run needs, checked before anything is simulated."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip import resources
from pytest_safemanip.cases import (
    SUITE,
    Case,
    applicable,
    keep_selected,
    parse_node_id,
    select_properties,
    select_tasks,
)
from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean
from pytest_safemanip.metrics.gates import check_gates
from pytest_safemanip.metrics.selection import FILTERS
from pytest_safemanip.policies.registry import Factory, PolicySpec, resolve
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Parameters, Proposition
from pytest_safemanip.recordings import Rollout, find_recordings
from pytest_safemanip.settings import Settings
from pytest_safemanip.sim.backend import Factory as BackendFactory
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import Property, load_properties
from pytest_safemanip.spec.task import OBJECTS_FILE, Task
from pytest_safemanip.spec.tasks import load_tasks


@dataclass(frozen=True)
class Extensions:
    """What the user's hooks add."""

    policies: Mapping[str, Factory]
    propositions: tuple[Proposition, ...]
    backends: Mapping[str, BackendFactory]


@dataclass(frozen=True)
class Plan:
    """A run, ready to go.

    Attributes:
        settings: what was asked for.
        cases: in the order in which they run; those of one rollout are neighbours.
        tasks: by name.
        properties: by id.
        policies: by name; empty when recordings are judged.
        catalogue: the propositions.
        parameters: values of their parameters.
        attributes: of object categories.
        recordings: file of each rollout, when recordings are judged.
    """

    settings: Settings
    cases: tuple[Case, ...]
    tasks: Mapping[str, Task]
    properties: Mapping[str, Property]
    policies: Mapping[str, PolicySpec]
    catalogue: Catalogue
    parameters: Parameters
    attributes: Mapping[str, frozenset[str]]
    recordings: Mapping[Rollout, Path]


def make_plan(settings: Settings, added: Extensions) -> Plan:
    """Load what is asked for and lay out the cases.

    Raises:
        ConfigError: naming what does not exist or does not fit together, and the remedy.
    """
    catalogue = Catalogue(added.propositions)
    task_folder = resources.folder("tasks")
    tasks = load_tasks([task_folder, *settings.task_paths])
    settings = _with_selected_ids(settings, tasks)
    shipped, own = _load_properties(settings, catalogue)
    properties = {**shipped, **own}
    wanted = select_properties(properties, settings.properties)
    recordings: dict[Rollout, Path] = {}
    policies: dict[str, PolicySpec] = {}
    if settings.recordings is not None:
        if settings.until is not None:
            raise ConfigError("--safemanip-until has nothing to save with --safemanip-recordings")
        recordings = find_recordings(settings, settings.recordings, tasks)
        rollouts = list(recordings)
    else:
        if not settings.policies:
            raise ConfigError("no policy is named; give --safemanip-policy")
        policies = {
            name: resolve(name, added.policies, settings.servers, settings.out, settings.deadlines)
            for name in settings.policies
        }
        rollouts = _rollouts(settings, tasks, policies)
        _check_servers(rollouts, tasks, policies)
    _check_properties([tasks[name] for name in {task for _, task, _ in rollouts}], properties)
    cases = [
        Case(task, policy, prop, seed)
        for policy, task, seed in rollouts
        for prop in applicable(tasks[task], own, wanted)
    ]
    if not cases:
        raise ConfigError("no selected property applies to a selected task")
    _check_instances(cases, tasks, properties)
    _check_gates(settings, cases, tasks, properties)
    return Plan(
        settings=settings,
        cases=tuple(keep_selected(cases, settings.select)),
        tasks=tasks,
        properties=properties,
        policies=policies,
        catalogue=catalogue,
        parameters=catalogue.parameters(settings.params),
        attributes=load_attributes(task_folder / OBJECTS_FILE),
        recordings=recordings,
    )


def _with_selected_ids(settings: Settings, tasks: Mapping[str, Task]) -> Settings:
    """Node ids say which policies, tasks and seeds are meant."""
    ids = [text for text in settings.select if text.rstrip(":") != SUITE]
    if not ids or len(ids) < len(settings.select):
        return settings
    cases = [parse_node_id(text) for text in ids]
    for case in cases:
        if case.task not in tasks:
            hint = did_you_mean(case.task, tasks)
            raise ConfigError(f"{case.node_id}: unknown task {case.task!r}; {hint}")
    return dataclasses.replace(
        settings,
        policies=tuple(dict.fromkeys(case.policy for case in cases)),
        tasks=tuple(dict.fromkeys(case.task for case in cases)),
        properties=(),
        seeds=tuple(sorted({case.seed for case in cases})),
    )


def _load_properties(
    settings: Settings, catalogue: Catalogue
) -> tuple[dict[str, Property], dict[str, Property]]:
    """Shipped and the user's; each may use any proposition that exists."""
    known = {name: len(p.arguments) for name, p in catalogue.items()}
    shipped = load_properties([resources.folder("properties")], propositions=known)
    own = load_properties(settings.property_paths, propositions=known)
    for name in sorted(set(shipped) & set(own)):
        raise ConfigError(f"{own[name].path}: property {name!r} is already shipped; rename it")
    return shipped, own


def _rollouts(
    settings: Settings, tasks: Mapping[str, Task], policies: Mapping[str, PolicySpec]
) -> list[Rollout]:
    chosen = select_tasks(tasks, settings.tasks)
    found = []
    for name, policy in policies.items():
        can = [task for task in chosen if policy.tasks is None or task.name in policy.tasks]
        cannot = [task.name for task in chosen if task not in can]
        # "all" means all that the policy can do; who names a task wants that one.
        if cannot and settings.tasks != ("all",):
            raise ConfigError(
                f"policy {name!r} has no plan for {', '.join(cannot)}; "
                f"it knows {', '.join(policy.tasks or ())}"
            )
        seeds = settings.seeds or (0,)
        if settings.until is not None:  # each seed of all tasks is a round
            found += [(name, task.name, seed) for seed in seeds for task in can]
        else:
            found += [(name, task.name, seed) for task in can for seed in seeds]
    return found


def _check_servers(
    rollouts: Iterable[Rollout], tasks: Mapping[str, Task], policies: Mapping[str, PolicySpec]
) -> None:
    """Every task has a server, where policies have one for each task set."""
    for name, task in dict.fromkeys((name, task) for name, task, _ in rollouts):
        server = policies[name].server
        if server is not None:
            try:
                server(task, tasks[task].sets)
            except RolloutError as error:
                raise ConfigError(f"policy {name!r}: {error}") from error


def _check_properties(tasks: Iterable[Task], properties: Mapping[str, Property]) -> None:
    for task in tasks:
        for name in task.properties:
            if name not in properties:
                hint = did_you_mean(name, properties)
                raise ConfigError(f"{task.path}: unknown property {name!r}; {hint}")


def _check_instances(
    cases: Iterable[Case],
    tasks: Mapping[str, Task],
    properties: Mapping[str, Property],
) -> None:
    """Every property has an instance."""
    for task, name in dict.fromkeys((case.task, case.property_id) for case in cases):
        prop = properties[name]
        if tasks[task].instances(prop.relation) == 0:
            raise ConfigError(
                f"{tasks[task].path}: property {name!r} ranges over {prop.relation}, "
                "and the task has none"
            )


def _check_gates(
    settings: Settings,
    cases: Iterable[Case],
    tasks: Mapping[str, Task],
    properties: Mapping[str, Property],
) -> None:
    """Every gate is about something in the run."""
    known: dict[str, set[str]] = {name: set() for name in FILTERS}
    for case in cases:
        task = tasks[case.task]
        category = properties[case.property_id].category
        values = (case.policy, case.task, task.suite, task.horizon, category, case.property_id)
        for name, value in zip(FILTERS, values, strict=True):
            known[name].add(value)
    check_gates(settings.gates, known)
