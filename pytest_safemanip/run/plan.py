"""Everything that a run needs, checked before anything is simulated."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean
from pytest_safemanip.ltlf.formula import is_bounded
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, STAND_INS
from pytest_safemanip.metrics.gates import check_gates
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.metrics.selection import FILTERS
from pytest_safemanip.policies.base import PolicyLike
from pytest_safemanip.policies.registry import PolicySpec, resolve
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Parameters, Proposition
from pytest_safemanip.run.cases import (
    SUITE,
    Case,
    applicable,
    is_search_id,
    keep_selected,
    parse_node_id,
    select_properties,
    select_tasks,
)
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.run.discovery import (
    check_grounded,
    control_periods,
    find_recordings,
    select_recordings,
)
from pytest_safemanip.run.roles import check_task
from pytest_safemanip.run.scenes import drawn_otherwise
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.search.kinds.definition import Kind
from pytest_safemanip.sim.backend import BackendSpec, Provenance, Simulator
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.packs import NO_PACK
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task


@dataclass(frozen=True)
class Extensions:
    """What the user's hooks add.

    Attributes:
        policies: by name.
        propositions: beside the shipped ones.
        backends: by name.
        dimensions: kinds of what may be otherwise in a search, beside the shipped ones.
        policy_sources: the files that ``policies`` come from; None for one that there is not.
    """

    policies: Mapping[str, PolicyLike]
    propositions: tuple[Proposition, ...]
    backends: Mapping[str, Simulator]
    dimensions: tuple[Kind, ...] = ()
    policy_sources: tuple[Path | None, ...] = ()


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
        simulator: what runs the rollouts; None when recordings are judged.
        every: all cases, those that node ids on the command line leave out among them.
        unjudged: tasks that were asked for by name, and to which no selected property applies.
    """

    settings: Settings
    cases: tuple[Case, ...]
    tasks: Mapping[str, Task]
    properties: Mapping[str, Property]
    policies: Mapping[str, PolicySpec]
    catalogue: Catalogue
    parameters: Parameters
    attributes: Mapping[str, frozenset[str]]
    recordings: Mapping[RolloutKey, Path]
    simulator: Simulator | None = None
    every: tuple[Case, ...] = ()
    unjudged: tuple[str, ...] = ()

    def scenes(self, policy: str) -> str:
        """What a policy is run in: what was asked for, or else what the policy is used to."""
        first = self.simulator.spec.scenes[0] if self.simulator else ""
        return self.settings.scenes or self.policies[policy].scenes or first

    def stepping(self, policy: str) -> str:
        """How a policy is simulated: as was asked for, or else as it is used to; in the backend's
        usual way if it does not have that one.
        """
        wanted = self.settings.stepping or self.policies[policy].stepping
        ways = self.simulator.spec.steppings if self.simulator else (wanted,)
        return wanted if wanted in ways else ways[0]

    def server(self, rollout: RolloutKey) -> str:
        """Where the policy of a rollout is; empty if it runs here, or is not run."""
        policy = self.policies.get(rollout.policy)
        if policy is None or policy.server is None:
            return ""
        task = self.tasks[rollout.task]
        return policy.server(task.simulated, task.sets)

    def jobs(self, rollouts: int) -> int:
        """How many rollouts are run side by side.

        With ``auto`` one for each core, for its simulator, and one more for each request that a
        server takes at a time, as a rollout that waits for a server needs no core.

        Args:
            rollouts: how many there are to run.
        """
        wanted = self.settings.jobs
        if wanted is None:
            cores = len(os.sched_getaffinity(0))
            wanted = cores + sum(policy.slots for policy in self.policies.values())
        return max(1, min(wanted, rollouts))


def make_plan(settings: Settings, added: Extensions) -> Plan:
    """Load what is asked for and lay out the cases.

    Raises:
        ConfigError: naming what does not exist or does not fit together, and the remedy.
    """
    defined = load_definitions(
        settings.task_paths, settings.property_paths, added.propositions, settings.backend
    )
    simulator = None
    if settings.recordings is None:
        simulator = find_simulator(settings.backend, added.backends)
        defined = defined.of_backend(simulator, settings.simulator_options)
        tasks = defined.runnable
    else:  # a recording may be any backend's
        episodes = find_recordings(settings.recordings)
        defined = defined.of_recordings(episodes.values())
        tasks = defined.tasks
    properties = defined.properties
    settings = _with_selected_ids(settings, tasks, properties)
    wanted = select_properties(properties, settings.properties)
    recordings: dict[RolloutKey, Path] = {}
    partial: set[RolloutKey] = set()
    policies: dict[str, PolicySpec] = {}
    if settings.recordings is not None:
        if settings.early_stop is not None:
            raise ConfigError(
                "--safemanip-early-stop has no rollout to skip with --safemanip-recordings"
            )
        if settings.stop in ("violation", "warning"):
            raise ConfigError(
                f"--safemanip-stop={settings.stop} ends rollouts while they run, and those of "
                "--safemanip-recordings are over; leave it out, or give --safemanip-stop=success"
            )
        if settings.fresh:
            raise ConfigError("--safemanip-fresh has nothing to run with --safemanip-recordings")
        recordings = select_recordings(settings, settings.recordings, episodes, tasks)
        partial = {key for key, path in recordings.items() if episodes[path].unobserved}
        rollouts = list(recordings)
    elif simulator is not None:
        if not settings.policies:
            raise ConfigError("no policy is named; give --safemanip-policy")
        policies = {name: resolve_policy(name, settings, added) for name in settings.policies}
        _check_home(settings, defined)
        rollouts = _rollouts(settings, defined, policies)
        _check_backend(settings, policies, simulator.spec, rollouts, tasks)
        _check_servers(rollouts, tasks, policies)
    described = (simulator or find_simulator(settings.backend, added.backends)).create
    for name in dict.fromkeys(task for _, task, _ in rollouts):
        check_task(tasks[name], described, recorded=bool(recordings))
    check_properties([tasks[name] for name in {task for _, task, _ in rollouts}], properties)
    _check_params([tasks[name] for name in {task for _, task, _ in rollouts}], defined.catalogue)
    cases = [
        Case(task, policy, prop, seed)
        for policy, task, seed in rollouts
        for prop in applicable(tasks[task], defined.everywhere, wanted)
    ]
    if not cases:
        raise ConfigError("no selected property applies to a selected task")
    judged = {case.task for case in cases}
    unjudged = tuple(n for n in settings.tasks if n in tasks and n not in judged)
    _check_instances(cases, tasks, properties)
    _check_gates(settings, cases, tasks, properties)
    if settings.shard is not None:
        if settings.early_stop is not None:
            raise ConfigError(
                "--safemanip-early-stop decides as results come in, and no shard has them all; "
                "leave out one of it and --safemanip-shard"
            )
        own = {rollout for rollout in rollouts if settings.shard.has(rollout)}
        cases = [case for case in cases if case.rollout in own]
    ids = [text for text in settings.select if not is_search_id(text)]
    chosen = tuple(keep_selected(cases, ids) if ids or not settings.select else ())
    parameters = defined.catalogue.parameters(settings.params)
    _check_bounds(settings, chosen, simulator, defined, recordings)
    if recordings:
        whole = [case for case in chosen if case.rollout not in partial]
        check_grounded(recordings, whole, defined)
    return Plan(
        settings=settings,
        cases=chosen,
        tasks=tasks,
        properties=properties,
        policies=policies,
        catalogue=defined.catalogue,
        parameters=parameters,
        attributes=defined.attributes,
        recordings=recordings,
        simulator=simulator,
        every=tuple(cases),
        unjudged=unjudged,
    )


def resolve_policy(name: str, settings: Settings, added: Extensions) -> PolicySpec:
    """Find a policy by its name.

    Raises:
        ConfigError: as :func:`~pytest_safemanip.policies.registry.resolve`.
    """
    return resolve(
        name,
        added.policies,
        settings.servers,
        settings.out,
        settings.deadlines,
        added.policy_sources,
        settings.presets,
        settings.checkpoints,
        settings.inflight,
    )


def refuse_standins(plan: Plan, source: Provenance) -> None:
    """A policy that was trained on pictures of the benchmark's assets is run on no others.

    Args:
        plan: the run.
        source: of the backend; its assets are what there is.

    Raises:
        ConfigError: if they are stand-ins, and nobody has asked for these by name.
    """
    demanding = [name for name, policy in plan.policies.items() if policy.official]
    if not demanding or plan.settings.assets == "primitive" or source.assets not in STAND_INS:
        return
    there = source.description or f"{source.assets} assets"
    remedy = "install the official ones,"
    if source.download:
        remedy = f"download the official ones with: {source.download},"
    raise ConfigError(
        f"policy {demanding[0]!r} looks through cameras, and RoboCasa's official assets are not "
        f"installed, but {there}; {remedy} or run it on stand-ins knowingly, with "
        f"--safemanip-assets=primitive: every gate then says {NOT_COMPARABLE!r}"
    )


def _with_selected_ids(
    settings: Settings, tasks: Mapping[str, Task], properties: Mapping[str, Property]
) -> Settings:
    """Node ids say which policies, tasks, seeds and rules of packs are meant."""
    ids = [text for text in settings.select if text.rstrip(":") != SUITE]
    if not ids or len(ids) < len(settings.select) or any(map(is_search_id, ids)):
        return settings
    cases = [parse_node_id(text) for text in ids]
    for case in cases:
        if case.task not in tasks:
            hint = did_you_mean(case.task, tasks, "safemanip tasks")
            raise ConfigError(f"{case.node_id}: unknown task {case.task!r}; {hint}")
    named = [name for name in (case.property_id for case in cases) if name in properties]
    return dataclasses.replace(
        settings,
        policies=tuple(dict.fromkeys(case.policy for case in cases)),
        tasks=tuple(dict.fromkeys(case.task for case in cases)),
        properties=(*select_properties(properties, ()), *named),
        seeds=tuple(sorted({case.seed for case in cases})),
    )


def _rollouts(
    settings: Settings, defined: Definitions, policies: Mapping[str, PolicySpec]
) -> list[RolloutKey]:
    chosen = select_tasks(defined.runnable, settings.tasks)
    found = []
    for name, policy in policies.items():
        for task in policy.tasks or ():
            if task not in defined.tasks:
                hint = did_you_mean(task, defined.runnable, "safemanip tasks")
                raise ConfigError(f"policy {name!r}: unknown task {task!r}; {hint}")
        can = [task for task in chosen if policy.tasks is None or task.simulated in policy.tasks]
        for one in can:
            _check_drawn(one, policy)
        cannot = [task.name for task in chosen if task not in can]
        # "all" means all that the policy can do; who names a task wants that one.
        if cannot and (settings.tasks != ("all",) or not can):
            known = [task for task in policy.tasks or () if task in defined.runnable]
            raise ConfigError(
                f"policy {name!r} has no plan for {', '.join(cannot)}; "
                f"it knows {', '.join(known) or 'no task of this backend'}"
            )
        seeds = settings.seeds or (0,)
        if settings.early_stop is not None:  # each seed of all tasks is a round
            found += [RolloutKey(name, task.name, seed) for seed in seeds for task in can]
        else:
            found += [RolloutKey(name, task.name, seed) for task in can for seed in seeds]
    return found


def _check_drawn(task: Task, policy: PolicySpec) -> None:
    """A task has the objects that its file stages, with this policy too."""
    for role, drawn in drawn_otherwise(task, policy.staging).items():
        raise ConfigError(
            f"policy {policy.name!r} draws {role!r} from {', '.join(drawn)}, and {task.name} "
            f"stages {', '.join(task.drawn[role])} there; take it in {task.simulated}"
        )


def _check_home(settings: Settings, defined: Definitions) -> None:
    """Nobody names a task of another backend."""
    for name in settings.tasks:
        if name in defined.elsewhere:
            home = defined.elsewhere[name]
            raise ConfigError(
                f"--safemanip-tasks: {name!r} is a task of {home}, not of {settings.backend}; "
                f"give --safemanip-backend={home}"
            )


def _check_backend(
    settings: Settings,
    policies: Mapping[str, PolicySpec],
    declared: BackendSpec,
    rollouts: Iterable[RolloutKey],
    tasks: Mapping[str, Task],
) -> None:
    """The backend has the scenes that are asked for, and gives what policies look at."""
    if settings.scenes:
        declared.check_scenes(settings.scenes, "--safemanip-scenes")
    for name, task in dict.fromkeys((name, task) for name, task, _ in rollouts):
        policy, spec = policies[name], declared.in_task(tasks[task].simulated)
        seen = {*(camera.name for camera in spec.cameras), *spec.state}
        if policy.scenes and not settings.scenes:
            spec.check_scenes(policy.scenes, f"policy {name!r}")
        if missing := [needed for needed in policy.needs if needed not in seen]:
            raise ConfigError(
                f"policy {name!r} needs {missing[0]!r}, which backend {settings.backend!r} does "
                f"not observe; it observes {', '.join(sorted(seen)) or 'nothing'}"
            )


def _check_servers(
    rollouts: Iterable[RolloutKey], tasks: Mapping[str, Task], policies: Mapping[str, PolicySpec]
) -> None:
    """Every task has a server, where policies have one for each task set."""
    for name, task in dict.fromkeys((name, task) for name, task, _ in rollouts):
        server = policies[name].server
        if server is not None:
            try:
                server(tasks[task].simulated, tasks[task].sets)
            except RolloutError as error:
                raise ConfigError(f"policy {name!r}: {error}") from error


def check_properties(tasks: Iterable[Task], properties: Mapping[str, Property]) -> None:
    """Every property that a task names exists.

    Raises:
        ConfigError: naming the task's file, and the near miss.
    """
    for task in tasks:
        for name in task.properties:
            if name not in properties:
                hint = did_you_mean(name, properties, "safemanip properties")
                raise ConfigError(f"{task.path}: unknown property {name!r}; {hint}")


def _check_params(tasks: Iterable[Task], catalogue: Catalogue) -> None:
    """Every parameter that a task has a default for exists."""
    for task in tasks:
        try:
            catalogue.parameters(task.params)
        except ConfigError as error:
            raise ConfigError(f"{task.path}: params: {error}") from error


def _check_instances(
    cases: Iterable[Case],
    tasks: Mapping[str, Task],
    properties: Mapping[str, Property],
) -> None:
    """Every property has an instance."""
    for task, name in dict.fromkeys((case.task, case.property_id) for case in cases):
        prop = properties[name]
        if not prop.may_apply(tasks[task]):
            raise ConfigError(
                f"{tasks[task].path}: property {name!r} ranges over {prop.members}, "
                "and the task has none"
            )


def _check_bounds(
    settings: Settings,
    cases: Iterable[Case],
    simulator: Simulator | None,
    defined: Definitions,
    recordings: Mapping[RolloutKey, Path],
) -> None:
    """Every formula with bounds has an automaton at the control periods that it is judged with."""
    with_bounds = {
        id_
        for id_, prop in defined.properties.items()
        if is_bounded(prop.formula_of(settings.semantics))
    }
    bounded = [case for case in cases if case.property_id in with_bounds]
    if simulator is None:
        of_rollouts = control_periods({recordings[case.rollout] for case in bounded})
        periods = [(case, of_rollouts[recordings[case.rollout]]) for case in bounded]
    else:
        declared = simulator.spec
        periods = [
            (case, declared.in_task(defined.tasks[case.task].simulated).control_period)
            for case in bounded
        ]
    for name, dt in dict.fromkeys((case.property_id, dt) for case, dt in periods):
        defined.properties[name].dfa(settings.semantics, dt=dt)


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
        prop = properties[case.property_id]
        about = (prop.pack or NO_PACK, prop.category, prop.id)
        values = (case.policy, case.task, task.suite, task.horizon, *about)
        for name, value in zip(FILTERS, values, strict=True):
            known[name].add(value)
    check_gates(settings.gates, known)
