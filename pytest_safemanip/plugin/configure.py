"""From pytest's configuration to a run: everything is checked here, nothing is simulated."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.metrics.release_gate import ReleaseGate, read_baseline
from pytest_safemanip.plugin.collection import CollectAppended, CollectExclusive, Maker
from pytest_safemanip.plugin.exit_status import ExitStatus
from pytest_safemanip.plugin.gate_reports import Gating
from pytest_safemanip.plugin.items import Suite
from pytest_safemanip.plugin.markers import CaseMarkers
from pytest_safemanip.plugin.options import OPTIONS
from pytest_safemanip.plugin.progress.line import ProgressLine
from pytest_safemanip.plugin.progress.workers import (
    WORKER_INPUT,
    WorkerProgress,
    WorkersProgress,
    folder_of,
)
from pytest_safemanip.plugin.reports.attachments import Attachments
from pytest_safemanip.plugin.reports.files import ReportFiles
from pytest_safemanip.plugin.reports.github import GitHub
from pytest_safemanip.plugin.reports.interrupts import Interrupts
from pytest_safemanip.plugin.reports.junit import JUnit
from pytest_safemanip.plugin.runtest import Executing
from pytest_safemanip.plugin.searching.reporting import SearchReporting
from pytest_safemanip.plugin.searching.setup import set_up
from pytest_safemanip.plugin.simulation import Simulation, simulation_of
from pytest_safemanip.plugin.terminal import Reporting
from pytest_safemanip.plugin.xdist import Distribution, WorkerDeaths
from pytest_safemanip.report.document import decisive
from pytest_safemanip.rollouts.store import prepare_output
from pytest_safemanip.run.cases import SUITE
from pytest_safemanip.run.early_stopping import EarlyStopping
from pytest_safemanip.run.floor import find_floor
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan, make_plan, refuse_standins, resolve_policy
from pytest_safemanip.run.results import Results
from pytest_safemanip.run.session import Progress, SafetySession
from pytest_safemanip.sim.backend import Provenance
from pytest_safemanip.sim.registry import find_simulator

if TYPE_CHECKING:
    from pytest_safemanip.rollouts.cluster import RayCluster

IMPLIED = (
    "--safemanip-tasks",
    "--safemanip-properties",
    "--safemanip-seeds",
    "--safemanip-fuzz",
    "--safemanip-fresh",
    "--safemanip-jobs",
    "--safemanip-video",
    "--safemanip-report",
    "--safemanip-ci",
    "--safemanip-gate",
    "--safemanip-gates",
    "--safemanip-baseline",
    "--safemanip-early-stop",
    "--safemanip-inconclusive",
    "--safemanip-allow-standins",
    "--safemanip-violations",
    "--safemanip-shard",
    "--safemanip-ray",
    "--safemanip-search",
)
"""Options that a node id stands for, that the recording makes unnecessary, or that decide nothing
about a case.
"""


def activate(config: pytest.Config, exclusive: bool, is_worker: bool) -> None:
    """Check what is asked for, get everything ready and register the hooks that do it.

    Args:
        config: pytest's.
        exclusive: whether the suite is all that is collected.
        is_worker: whether this process is a worker of pytest-xdist.

    Raises:
        ConfigError: if the run cannot be done as asked.
    """
    simulation = simulation_of(config)
    settings, plugins = simulation.settings, config.pluginmanager
    invocation = Invocation(config.invocation_params.dir, _options(config))
    makers: list[Maker] = []
    if settings.judges:
        makers += _cases(config, simulation, invocation, is_worker)
    if settings.fuzzes:
        makers.append(_laws(config, simulation, invocation, is_worker))
    collecting = CollectExclusive if exclusive else CollectAppended
    plugins.register(collecting(makers), "safemanip-collect")
    if not is_worker:
        plugins.register(ExitStatus(), "safemanip-exit")
    if plugins.hasplugin("xdist") and not is_worker:
        in_order, asked = settings.early_stop is not None, settings.jobs != 1
        plugins.register(Distribution(in_order, asked), "safemanip-xdist")


def _cases(
    config: pytest.Config, simulation: Simulation, invocation: Invocation, is_worker: bool
) -> list[Maker]:
    """The cases on rollouts, the searches and the failures that they kept."""
    plan = make_plan(simulation.settings, simulation.extensions)
    backend = store = stopping = None
    if not config.option.collectonly:
        prepare_output(plan.settings.out)
        stopping = _early_stopping(plan, simulation.run_id)
        if not plan.recordings:
            backend, store = simulation.backend, simulation.store
            refuse_standins(plan, backend.provenance)
    progress = _progress(config, plan, simulation.run_id)
    # Workers of xdist are told one case at a time: what comes next is for another to run.
    more = None if is_worker else simulation.another_backend
    cluster = None
    if backend is not None and plan.settings.ray:
        cluster = _cluster(config, plan, simulation, backend.provenance)
    rollouts = SafetySession(plan, backend, store, simulation.run_id, progress, more, cluster)
    config.pluginmanager.register(Executing(rollouts, stopping), "safemanip-execute")
    jobs = plan.jobs if more is not None else lambda trials: 1
    if cluster is not None:
        jobs = lambda trials: max(1, min(cluster.slots, trials))  # noqa: E731
    searches, searching = set_up(config, plan, simulation, invocation, rollouts, progress, jobs)
    config.pluginmanager.register(Attachments(config, plan.settings.out), "safemanip-attach")
    if not is_worker:
        interrupts = Interrupts(config, rollouts, simulation)
        interrupts.listen()
        config.pluginmanager.register(interrupts, "safemanip-interrupts")
        source = backend.provenance if backend else None
        _register_reports(config, plan, source, rollouts, invocation, searching)
    markers = CaseMarkers(config, plan)

    def cases(session: pytest.Session) -> pytest.Collector:
        suite: Suite = Suite.from_parent(
            session,
            name=SUITE,
            nodeid=SUITE,
            plan=plan,
            markers=markers,
            rollouts=rollouts,
            stopping=stopping,
            invocation=invocation,
        )
        return suite

    return [cases, *([searches] if searches is not None else [])]


def _progress(config: pytest.Config, plan: Plan, run_id: str) -> Progress | None:
    """What is told how rollouts get on; None where nobody looks."""
    folder = folder_of(plan.settings.out, run_id)
    if hasattr(config, "workerinput"):
        if not config.workerinput.get(WORKER_INPUT):
            return None
        return WorkerProgress(plan, folder / f"{config.workerinput['workerid']}.json")
    if config.getoption("numprocesses", None) and not config.option.collectonly:
        config.pluginmanager.register(WorkersProgress(config, folder), "safemanip-progress")
    return ProgressLine(config, plan)


def _cluster(
    config: pytest.Config, plan: Plan, simulation: Simulation, source: Provenance
) -> RayCluster:
    """The Ray cluster that runs the rollouts; it is left when pytest ends, also after Ctrl-C."""
    from pytest_safemanip.rollouts.cluster import RayCluster, Recipe

    settings, added = simulation.settings, simulation.extensions
    if settings.jobs != 1:
        raise ConfigError("--safemanip-jobs: the cluster decides that; leave it out")
    if config.getoption("numprocesses", None) or hasattr(config, "workerinput"):
        raise ConfigError("--safemanip-ray: one process directs the cluster; leave out -n")
    recipe = Recipe(
        partial(find_simulator, settings.backend, added.backends),
        partial(resolve_policy, settings=settings, added=added),
        settings.simulator_options,
        source,
        simulation.run_id,
    )
    cluster = RayCluster(settings.ray, recipe, settings.ray_resources)
    config.add_cleanup(cluster.close)
    return cluster


def _early_stopping(plan: Plan, run_id: str) -> EarlyStopping | None:
    """What knows which rollouts are still needed, if not all of them are run."""
    settings = plan.settings
    if settings.early_stop is None:
        return None
    results = Results(plan.tasks, plan.properties)
    path = settings.out / "early_stopping" / run_id
    return EarlyStopping(settings.gates, settings.early_stop, results, path)


def _register_reports(
    config: pytest.Config,
    plan: Plan,
    source: Provenance | None,
    rollouts: SafetySession,
    invocation: Invocation,
    searching: SearchReporting | None,
) -> None:
    """What is reported, and what decides."""
    settings, results = plan.settings, Results(plan.tasks, plan.properties, plan.cases)
    gating = None
    if settings.shard is None and (settings.gates.gates or settings.baseline):
        baseline = None
        if settings.baseline is not None:
            wanted = list(dict.fromkeys(case.rollout for case in plan.cases))
            place = invocation.relative_path(settings.baseline)
            baseline = read_baseline(place, wanted, decisive(plan), _origins(plan, source))
        found = searching.found if searching is not None else ()
        release = ReleaseGate(settings.gates, baseline, settings.early_stop)
        gating = Gating(plan, release, results, found)
        config.pluginmanager.register(gating, "safemanip-gate")
    config.pluginmanager.register(WorkerDeaths(plan, invocation), "safemanip-deaths")
    github = None
    if settings.ci == "auto":
        github = GitHub(skip_open=settings.inconclusive == "skip")
        config.pluginmanager.register(github, "safemanip-github")
    junit = JUnit() if config.getoption("xmlpath", None) else None
    if junit is not None:
        config.pluginmanager.register(junit, "safemanip-junit")
    files = ReportFiles(plan, invocation, github)
    config.pluginmanager.register(files, "safemanip-files")
    floor = () if config.option.collectonly else find_floor(plan)
    reporting = Reporting(
        plan, source, rollouts, results, gating, invocation, files, junit, floor, searching
    )
    config.pluginmanager.register(reporting, "safemanip-report")
    if settings.video != "none" and not config.option.collectonly:
        _register_videos(config, plan, results, invocation)


def _register_videos(
    config: pytest.Config, plan: Plan, results: Results, invocation: Invocation
) -> None:
    """What draws rollouts when the run is over; its libraries are looked for before it begins."""
    from pytest_safemanip.plugin.reports.videos import Filming
    from pytest_safemanip.video.encoding import check_encoder
    from pytest_safemanip.video.film import check_drawn

    check_encoder(Path("a.mp4"))
    if not plan.recordings:
        check_drawn(plan.settings.backend, "--safemanip-video")
    config.pluginmanager.register(Filming(plan, results, invocation), "safemanip-video")


def _origins(plan: Plan, source: Provenance | None) -> dict[str, dict[str, object]]:
    """What is going to decide the recordings of each policy; nothing where none are made."""
    if source is None:
        return {}
    return {
        name: {
            "backend": source.backend,
            "scenes": plan.scenes(name),
            "stepping": plan.stepping(name),
            "assets": source.assets,
            "versions": dict(source.versions),
            "hashes": dict(source.hashes),
        }
        for name in plan.policies
    }


def _laws(
    config: pytest.Config, simulation: Simulation, invocation: Invocation, is_worker: bool
) -> Maker:
    """The laws of propositions."""
    try:
        from pytest_safemanip.plugin.law_items import FuzzHeader, LawSuite
        from pytest_safemanip.run.fuzz_plan import make_fuzz_plan
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        raise ConfigError(f"--safemanip-fuzz needs Hypothesis: {install_command('fuzz')}") from None
    settings = simulation.settings
    plan = make_fuzz_plan(settings, simulation.extensions.propositions)
    if not config.option.collectonly:
        prepare_output(settings.out)
    if not is_worker:
        config.pluginmanager.register(FuzzHeader(plan), "safemanip-fuzz")
    return lambda session: LawSuite.from_parent(
        session, name=SUITE, nodeid=SUITE, plan=plan, invocation=invocation
    )


def _options(config: pytest.Config) -> tuple[str, ...]:
    """Those that a test case needs beside its id to be run again."""
    words: list[str] = []
    for option in OPTIONS:
        given = config.getoption(option.ini)
        if given is None:
            continue
        if option.flag == "--safemanip-policy":  # a node id has no addresses
            words += [f"{option.flag}={v}" for v in _addressed(given)]
            continue
        if option.flag in IMPLIED:
            continue
        if option.switch:
            words.append(option.flag)
            continue
        values = given if isinstance(given, list) else [given]
        words += [f"{option.flag}={value}" for value in values]
    return tuple(words)


def _addressed(given: object) -> list[str]:
    return [v for v in given if "=" in v or "@" in v] if isinstance(given, list) else []
