"""An episode by a policy, begun again if the policy's server got lost."""

from __future__ import annotations

from pytest_safemanip import rollout
from pytest_safemanip.errors import ConfigError, PolicyConnectionLost, RolloutError
from pytest_safemanip.policies.base import Policy
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.sim.backend import Backend
from pytest_safemanip.trace.recording import Recording

RESTARTS = 2
"""How often an episode is begun again."""


def run(
    job: rollout.Job, backend: Backend, policy: PolicySpec, show: rollout.Progress
) -> Recording:
    """Run an episode, each time from its reset and with its seed.

    Raises:
        RolloutError: if it does not complete.
    """
    begun = 0
    while True:
        begun += 1
        show(0, 0)
        try:
            policy.ready(job.task, job.sets)
            return rollout.run(job, backend, _made(policy), show)
        except PolicyConnectionLost as error:
            if begun > RESTARTS:
                raise RolloutError(
                    f"{error}\nthe episode was begun {begun} times, and never ended"
                ) from error


def _made(policy: PolicySpec) -> Policy:
    """A fresh policy; one that cannot be made fails its own rollouts and no others."""
    try:
        return policy.make()
    except ConfigError as error:
        raise RolloutError(str(error)) from error
