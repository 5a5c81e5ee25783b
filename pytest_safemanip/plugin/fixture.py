"""Rollouts for ordinary tests: what the fixture ``safemanip_rollout`` is."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cached_property

import pytest

from pytest_safemanip.errors import ConfigError, SafemanipError, did_you_mean
from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.plugin.simulation import simulation_of
from pytest_safemanip.report.failure import without_package_frames
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.option_values import SEEDS
from pytest_safemanip.run.plan import make_plan, refuse_standins
from pytest_safemanip.run.session import EvaluatedRollout, SafetySession
from pytest_safemanip.sim.registry import find_simulator


class RolloutProvider:
    """Runs rollouts, or takes them from the recordings of this run or of earlier ones.

    Args:
        config: pytest's; options that say how rollouts are run or judged apply.
    """

    def __init__(self, config: pytest.Config) -> None:
        self._simulation = simulation_of(config)
        self._sessions: dict[tuple[str, str], SafetySession] = {}

    def __call__(self, task: str, *, policy: str = "scripted", seed: int = 0) -> EvaluatedRollout:
        """A rollout with its verdicts on all properties that apply to its task.

        Neither ``--safemanip-policy`` nor the options that choose cases matter here.

        Args:
            task: its name; no glob or selector.
            policy: as ``--safemanip-policy`` takes it, without an address.
            seed: of the episode, from 0 up.

        Raises:
            ConfigError: if there is no such task or policy, or they do not fit together.
            RolloutError: if the rollout does not complete.
            TraceError: if its recording is broken.
        """
        __tracebackhide__ = True
        try:
            self._check(task, seed)
            if (task, policy) not in self._sessions:
                self._sessions[task, policy] = self._session(task, policy)
            return self._sessions[task, policy].evaluate(Case(task, policy, "", seed))
        except SafemanipError as error:
            # The test's own line, and where the user's code broke: no frames in between.
            cause = error.__cause__
            if cause is not None:
                cause = cause.with_traceback(without_package_frames(cause.__traceback__))
            raise error.with_traceback(None) from cause

    def close(self) -> None:
        """End the connections to policies; the simulator ends with pytest."""
        for session in self._sessions.values():
            session.close()

    @cached_property
    def _tasks(self) -> Mapping[str, object]:
        settings, own = self._simulation.settings, self._simulation.extensions.propositions
        paths = settings.task_paths, settings.property_paths
        defined = load_definitions(*paths, own, settings.backend)
        simulator = find_simulator(settings.backend, self._simulation.extensions.backends)
        return defined.of_backend(simulator, settings.simulator_options).runnable

    def _check(self, task: str, seed: int) -> None:
        """Refuse what no episode has, in the words of whoever called."""
        if task not in self._tasks:
            hint = did_you_mean(task, self._tasks, "safemanip tasks")
            raise ConfigError(f"safemanip_rollout: unknown task {task!r}; {hint}")
        if type(seed) is not int or not 0 <= seed < SEEDS:
            raise ConfigError(f"safemanip_rollout: expected a seed from 0 up, found {seed!r}")

    def _session(self, task: str, policy: str) -> SafetySession:
        simulation = self._simulation
        settings = dataclasses.replace(
            simulation.settings,
            policies=(policy,),
            tasks=(task,),
            properties=(),
            seeds=None,
            gates=Gates(),
            baseline=None,
            early_stop=None,
            select=(),
        )
        plan = make_plan(settings, simulation.extensions)
        if plan.recordings:
            return SafetySession(plan, None, None, simulation.run_id)
        refuse_standins(plan, simulation.own_backend.provenance)
        return SafetySession(plan, simulation.own_backend, simulation.store, simulation.run_id)
