"""Gets the searches of a run ready."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.plugin.collection import Maker
from pytest_safemanip.plugin.searching.items import SearchSuite
from pytest_safemanip.plugin.searching.reporting import SearchExecuting, SearchReporting
from pytest_safemanip.plugin.searching.telling import Telling
from pytest_safemanip.plugin.simulation import Simulation
from pytest_safemanip.rollouts.store import Store
from pytest_safemanip.run.cases import SUITE
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.searching.keeping import Keeping
from pytest_safemanip.run.searching.plan import make_search_plan
from pytest_safemanip.run.searching.running import FOLDER, Searches
from pytest_safemanip.run.session import Progress, SafetySession
from pytest_safemanip.search.proposing.proposer import MakeProposer


def set_up(
    config: pytest.Config,
    plan: Plan,
    simulation: Simulation,
    invocation: Invocation,
    rollouts: SafetySession,
    progress: Progress | None,
    jobs: Callable[[int], int],
) -> tuple[Maker | None, SearchReporting | None]:
    """What makes the items of searches and of kept failures, and what reports them; None of either
    if there are none.

    Raises:
        ConfigError: if a space or a kept failure is wrong, or a library is missing.
    """
    settings = plan.settings
    if plan.recordings or simulation.settings.recordings is not None:
        if settings.search is not None:
            raise ConfigError("--safemanip-search has nothing to run with --safemanip-recordings")
        return None, None
    if settings.search is None and config.getoption("safemanip_spaces"):
        raise ConfigError("--safemanip-spaces says what to search: --safemanip-search=200, too")
    if settings.search is not None and settings.shard is not None:
        raise ConfigError("--safemanip-search: a search is no part of a shard; leave out one")
    extensions = simulation.extensions
    searches = make_search_plan(plan, extensions.dimensions, extensions.backends)
    if not searches.cases and not searches.regressions:
        return None, None
    make = _optimiser() if searches.cases else None
    store = None
    if not config.option.collectonly:
        store = Store(settings.out / FOLDER / "kept", simulation.run_id, settings.fresh)
    running = Searches(
        plan,
        searches,
        rollouts,
        make,
        simulation.run_id,
        jobs,
        progress.say if progress else lambda text: None,
        progress.refresh if progress else lambda waiting: None,
    )
    keeping = Keeping(plan, rollouts, store, searches.folder)
    telling = Telling(running, keeping, invocation)
    config.pluginmanager.register(SearchExecuting(rollouts), "safemanip-search-execute")
    reporting = None
    if not hasattr(config, "workerinput"):
        reporting = SearchReporting(searches, telling)
        config.pluginmanager.register(reporting, "safemanip-search-report")

    def maker(session: pytest.Session) -> pytest.Collector:
        suite: SearchSuite = SearchSuite.from_parent(
            session,
            name=SUITE,
            nodeid=SUITE,
            plan=plan,
            searches=searches,
            rollouts=rollouts,
            telling=telling,
        )
        return suite

    return maker, reporting


def _optimiser() -> MakeProposer:
    """What proposes trials; its library is looked for before anything is simulated."""
    try:
        from pytest_safemanip.search.proposing.parzen import ParzenEstimators
    except ModuleNotFoundError as error:
        if error.name != "optuna":
            raise
        needed = install_command("search")
        raise ConfigError(f"--safemanip-search needs Optuna: {needed}") from None
    return ParzenEstimators
