"""Runs an episode, and retries it if the connection to the policy's server is lost."""

from __future__ import annotations

import dataclasses
import threading
import warnings
from contextlib import AbstractContextManager, closing, nullcontext

import numpy as np

from pytest_safemanip.errors import (
    ConfigError,
    PolicyConnectionLost,
    PolicyServerError,
    RolloutError,
)
from pytest_safemanip.policies.adapter import AdaptedPolicy
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.sim.backend import Backend
from pytest_safemanip.trace.recording import Recording

RESTARTS = 2
"""Maximum number of retries of an episode."""


def run(job: rollout.Job, backend: Backend, policy: PolicySpec, show: rollout.OnStep) -> Recording:
    """Run an episode; a retry starts again from the reset, with the same seed.

    Returns:
        The recording; the ``served`` of its episode has the number of ``restarts``, if there were
        some.

    Raises:
        RolloutError: if it does not complete; ``restarts`` says how often it was retried.
    """
    restarts = 0
    while True:
        show(0, 0)
        try:
            policy.ready(job.request.task, job.sets)
            with np.errstate(), _filters(), closing(_made(policy)) as made:
                return _noted(rollout.run(job, backend, made, show), restarts)
        except PolicyConnectionLost as error:
            if restarts == RESTARTS:
                lost = PolicyConnectionLost(
                    f"{error}\nthe episode was begun {restarts + 1} times, and never ended"
                )
                lost.restarts = restarts
                raise lost from error
            restarts += 1
        except PolicyServerError as error:
            error.restarts = restarts
            raise


def _filters() -> AbstractContextManager[object]:
    """What a policy sets of warnings ends with its rollout. Threads share the filters, and would
    put back each other's.
    """
    alone = threading.current_thread() is threading.main_thread()
    return warnings.catch_warnings() if alone else nullcontext()


def _noted(recording: Recording, restarts: int) -> Recording:
    """The recording with the number of restarts in it."""
    if not restarts:
        return recording
    served = {**recording.episode.served, "restarts": str(restarts)}
    episode = dataclasses.replace(recording.episode, served=served)
    return dataclasses.replace(recording, episode=episode)


def _made(policy: PolicySpec) -> AdaptedPolicy:
    """A fresh policy; one that cannot be made fails its own rollouts and no others."""
    try:
        return policy.make()
    except ConfigError as error:
        raise RolloutError(str(error)) from error
