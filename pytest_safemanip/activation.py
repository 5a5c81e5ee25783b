"""From pytest's configuration to a run: everything is checked here, nothing is simulated."""

from __future__ import annotations

import shlex
import sys
import uuid

import pytest

from pytest_safemanip.collecting import CollectAlone, CollectBeside, Maker
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.executing import Executing
from pytest_safemanip.gating import Gating
from pytest_safemanip.items import make_suite
from pytest_safemanip.options import OPTIONS
from pytest_safemanip.plan import Extensions, Plan, make_plan
from pytest_safemanip.progress import ProgressLine
from pytest_safemanip.release import Release, read_baseline
from pytest_safemanip.report.document import decisive
from pytest_safemanip.report.results import Results
from pytest_safemanip.reporting import Reporting
from pytest_safemanip.run import Run
from pytest_safemanip.session import SafetySession
from pytest_safemanip.settings import Settings, read_settings
from pytest_safemanip.sim.backend import Backend, Options
from pytest_safemanip.stopping import Stopping
from pytest_safemanip.store import Store, prepare_output

IMPLIED = (
    "--safemanip-policy",
    "--safemanip-tasks",
    "--safemanip-properties",
    "--safemanip-seeds",
    "--safemanip-fuzz",
)
"""Options that a node id stands for."""


def activate(config: pytest.Config, alone: bool, worker: str | None) -> None:
    """Check what is asked for, get everything ready and register the hooks that do it.

    Args:
        config: pytest's.
        alone: whether the suite is all that is collected.
        worker: the test run that this process is a worker of; None in the only or main process.

    Raises:
        ConfigError: if the run cannot be done as asked.
    """
    settings = read_settings(config)
    _import_from(str(config.invocation_params.dir))
    added = _extensions(config)
    makers: list[Maker] = []
    if settings.fuzzes:
        makers.append(_laws(config, settings, added, worker))
    if settings.judges:
        makers.append(_safety(config, settings, added, alone and not makers, worker))
    collecting = CollectAlone if alone else CollectBeside
    plugins = config.pluginmanager
    plugins.register(collecting(makers[::-1]), "safemanip-collect")
    if plugins.hasplugin("xdist") and worker is None:
        from pytest_safemanip.xdist import Distribution

        plugins.register(Distribution(settings.until is not None), "safemanip-xdist")


def _safety(
    config: pytest.Config, settings: Settings, added: Extensions, alone: bool, worker: str | None
) -> Maker:
    """The cases on rollouts."""
    plan = make_plan(settings, added)
    backend = store = None
    run = worker or _run_id(config)
    if not config.option.collectonly:
        prepare_output(settings.out)
        if not plan.recordings:
            backend = _backend(settings, added)
            store = Store(settings.out / "recordings", run)
    progress = None if worker else ProgressLine(config, plan)
    session = SafetySession(plan, backend, store, run, progress)
    stopping = _stopping(plan, run) if not config.option.collectonly else None
    folder = config.invocation_params.dir
    suite = Run(plan, session, backend, stopping, _command(config), folder)
    config.pluginmanager.register(Executing(suite, alone), "safemanip-execute")
    if worker is None:
        _register_reports(config, suite)
    return lambda collector: make_suite(collector, suite)


def _run_id(config: pytest.Config) -> str:
    """Identifies the run; xdist's workers are told the same."""
    if not hasattr(config.option, "testrunuid"):
        return uuid.uuid4().hex
    config.option.testrunuid = config.option.testrunuid or uuid.uuid4().hex
    return str(config.option.testrunuid)


def _stopping(plan: Plan, run: str) -> Stopping | None:
    """What knows which rollouts are still needed, if not all of them are run."""
    settings = plan.settings
    if settings.until is None:
        return None
    results = Results(plan.tasks, plan.properties)
    return Stopping(settings.gates, settings.until, results, settings.out / "until" / run)


def _register_reports(config: pytest.Config, suite: Run) -> None:
    """What is told, and what decides."""
    plan, plugins = suite.plan, config.pluginmanager
    settings, results = plan.settings, Results(plan.tasks, plan.properties)
    gating = None
    if settings.gates.gates or settings.baseline:
        baseline = None
        if settings.baseline is not None:
            rollouts = list(dict.fromkeys(case.rollout for case in plan.cases))
            origins = _origins(suite)
            place = suite.shown(settings.baseline)
            baseline = read_baseline(place, rollouts, decisive(plan), origins)
        gating = Gating(plan, Release(settings.gates, baseline, settings.until), results)
        plugins.register(gating, "safemanip-gate")
    plugins.register(Reporting(suite, results, gating), "safemanip-report")


def _origins(suite: Run) -> dict[str, dict[str, object]]:
    """What is going to decide the recordings of each policy; nothing where none are made."""
    if suite.backend is None:
        return {}
    source, chosen = suite.backend.provenance, suite.plan.settings
    return {
        name: {
            "backend": source.backend,
            "scenes": chosen.scenes or spec.scenes,
            "stepping": chosen.stepping or spec.stepping,
            "assets": source.assets,
            "versions": dict(source.versions),
            "hashes": dict(source.hashes),
        }
        for name, spec in suite.plan.policies.items()
    }


def _laws(
    config: pytest.Config, settings: Settings, added: Extensions, worker: str | None
) -> Maker:
    """The laws of propositions."""
    try:
        from pytest_safemanip.fuzzing import FuzzHeader, make_fuzz_plan, make_law_suite
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        raise ConfigError(
            "--safemanip-fuzz needs Hypothesis: pip install 'pytest-safemanip[fuzz]'"
        ) from None
    plan = make_fuzz_plan(settings, added.propositions, settings.laws, _command(config))
    if not config.option.collectonly:
        prepare_output(settings.out)
    if worker is None:
        config.pluginmanager.register(FuzzHeader(plan), "safemanip-fuzz")
    return lambda collector: make_law_suite(collector, plan)


def _import_from(folder: str) -> None:
    """``module:attribute`` means a module beside the user, as with ``python -m pytest``."""
    if folder not in sys.path:
        sys.path.append(folder)


def _extensions(config: pytest.Config) -> Extensions:
    policies, backends = {}, {}
    for provided in config.hook.pytest_safemanip_policies():
        policies.update(provided)
    for provided in config.hook.pytest_safemanip_backends():
        backends.update(provided)
    propositions = [p for own in config.hook.pytest_safemanip_propositions() for p in own]
    return Extensions(policies, tuple(propositions), backends)


def _backend(settings: Settings, added: Extensions) -> Backend:
    factories = dict(added.backends)
    if settings.backend == "robocasa":
        from pytest_safemanip.sim.robocasa.factory import create

        factories.setdefault("robocasa", create)
    if settings.backend not in factories:
        hint = did_you_mean(settings.backend, {"robocasa", *factories})
        raise ConfigError(f"--safemanip-backend: unknown backend {settings.backend!r}; {hint}")
    return factories[settings.backend](Options(settings.assets, settings.out / "logs"))


def _command(config: pytest.Config) -> str:
    words = ["pytest"]
    for option in OPTIONS:
        given = config.getoption(option.ini)
        if given is None:
            continue
        if option.flag in IMPLIED:
            # A node id has no addresses.
            words += [shlex.quote(f"{option.flag}={v}") for v in _addressed(given)]
            continue
        if option.switch:
            words.append(option.flag)
            continue
        values = given if isinstance(given, list) else [given]
        words += [shlex.quote(f"{option.flag}={value}") for value in values]
    return " ".join(words)


def _addressed(given: object) -> list[str]:
    return [value for value in given if "=" in value] if isinstance(given, list) else []
