"""Adapts any policy to the full interface of the rollout loop."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from pytest_safemanip.errors import RolloutError, raised_as
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.episode import LONGEST_FAILURE, MOST_HAZARDS, served_fault
from pytest_safemanip.trace.hazard import Hazard


def takes_nothing(target: Any) -> bool:
    """Whether it can be called without arguments and does not expect any."""
    try:
        parameters = inspect.signature(target).parameters.values()
    except (TypeError, ValueError):
        return False
    return all(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) or p.default is not p.empty
               for p in parameters)  # fmt: skip


def is_policy(target: Any) -> bool:
    """Whether a target is a policy itself, not a class or factory of policies."""
    if inspect.isclass(target):
        return False
    return _act_of(target) is not None or (callable(target) and not takes_nothing(target))


def ask(policy: Any, name: str, default: Any) -> Any:
    """The value of an attribute, a property or a method without arguments of a policy.

    Raises:
        Exception: whatever the property or method raises, AttributeError too.
    """
    value = member(policy, name, default)
    return value() if callable(value) else value


def member(policy: Any, name: str, default: Any = None) -> Any:
    """An attribute or method of a policy, not called.

    Raises:
        Exception: whatever a property raises, AttributeError too.
    """
    try:
        return getattr(policy, name)
    except AttributeError:
        if inspect.getattr_static(policy, name, None) is not None:
            raise
        return default


class AdaptedPolicy:
    """A policy with defaults for what :class:`~pytest_safemanip.policies.base.Policy` may lack.

    Args:
        policy: an object with ``act`` or ``infer``, or a function that is ``act`` itself.
        shared: whether it serves more than one rollout, and is closed by somebody else.
        released: called when its rollout no longer uses it.
    """

    def __init__(
        self, policy: Any, shared: bool = False, released: Callable[[], object] = lambda: None
    ) -> None:
        self.policy, self._shared, self._released = policy, shared, released
        self._act: Callable[[Observation], Any] = _act_of(policy) or policy

    def reset(self, episode: EpisodeInfo) -> None:
        """Announce an episode, to a policy that has ``reset``.

        Raises:
            RolloutError: if the policy fails; likewise in the methods below.
        """
        with _failures("at reset"):
            reset = member(self.policy, "reset")
            if reset is not None:
                reset(*(() if takes_nothing(reset) else (episode,)))

    def act(self, observation: Observation) -> Any:
        """The policy's answer, unchecked."""
        with _failures(f"at step {observation.index}"):
            return self._act(observation)

    @property
    def done(self) -> bool:
        """Whether the policy has nothing more to do."""
        with _failures("to say whether it is done"):
            done = ask(self.policy, "done", False)
        if not isinstance(done, bool | np.bool_):
            raise RolloutError(f"the policy's 'done' is {done!r}, expected True or False")
        return bool(done)

    @property
    def hazards(self) -> tuple[Hazard, ...]:
        """Hazards that the policy caused on purpose."""
        with _failures("to say its hazards"):
            hazards = tuple(ask(self.policy, "hazards", ()))
        if len(hazards) > MOST_HAZARDS or not all(isinstance(h, Hazard) for h in hazards):
            raise RolloutError(
                f"the policy's 'hazards' are {hazards!r}, expected at most {MOST_HAZARDS} of "
                "pytest_safemanip.trace.hazard.Hazard"
            )
        return hazards

    @property
    def failure(self) -> str:
        """Why the policy gave up, as a line that a recording keeps; empty if it did not."""
        with _failures("to say why it gave up"):
            said = str(ask(self.policy, "failure", "") or "")
        line = " ".join("".join(c if c.isprintable() else " " for c in said).split())
        return line[:LONGEST_FAILURE]

    @property
    def served_facts(self) -> Mapping[str, str]:
        """Facts about the policy's server and the exchange with it."""
        with _failures("to say its 'served_facts'"):
            facts: Mapping[str, str] = dict(ask(self.policy, "served_facts", {}))
        if fault := served_fault(facts):
            raise RolloutError(f"the policy's 'served_facts': {fault}")
        return facts

    def staging(self, task: str) -> Staging:
        """Staging of the episodes of a task, as the policy asks for it."""
        with _failures(f"to say its staging of {task}"):
            staging = member(self.policy, "staging")
            found = Staging() if staging is None else staging(task)
        if not isinstance(found, Staging):
            raise RolloutError(
                f"the policy's 'staging' of {task} is {found!r}, expected "
                "pytest_safemanip.sim.staging.Staging"
            )
        return found

    def close(self) -> None:
        """Free what the policy holds, if it served this rollout only."""
        try:
            if not self._shared:
                with _failures("at close"):
                    ask(self.policy, "close", None)
        finally:
            self._released()


def _failures(when: str) -> AbstractContextManager[None]:
    """Turns what a policy raises into an error of the rollout that says when it was."""
    return raised_as(RolloutError, f"the policy failed {when}")


def _act_of(policy: Any) -> Any:
    found = (member(policy, name) for name in ("act", "infer"))
    return next((act for act in found if callable(act)), None)
