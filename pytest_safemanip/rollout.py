"""The rollout loop: one protocol for every policy, every control step recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError, SafemanipError
from pytest_safemanip.policies.base import EpisodeInfo, Observation, Policy
from pytest_safemanip.policies.prompts import PLACE, told
from pytest_safemanip.sim.backend import ACTION_SIZE, Backend, Request, Start
from pytest_safemanip.sim.codec import encode_request
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.steps import Step, Steps

REST_SPEED = 0.01
"""Objects slower than this (m/s) are at rest; the solver's own jitter is below it."""
REST_SPIN = 0.05
"""Objects that turn slower than this (rad/s) are at rest."""
REST_RATE = 0.05
"""Doors and drawers that move slower than this (1/s) are at rest: 2 cm/s for a drawer."""
REST_SECONDS = 0.5
TAIL_SECONDS = 5.0

Progress = Callable[[int, int], None]
"""Called with the steps so far and the horizon."""


@dataclass(frozen=True)
class Protocol:
    """How rollouts are run, the same for every policy.

    Attributes:
        stop: ``success`` ends the acting part at the first step whose success check holds,
            ``horizon`` never before the horizon.
        horizon_scale: factor on the task's own horizon.
    """

    stop: Literal["success", "horizon"] = "success"
    horizon_scale: float = 1.0


@dataclass(frozen=True)
class Job:
    """One rollout to be run.

    Attributes:
        task: name of the task.
        policy: name of the policy, as the user gave it.
        request: the episode.
        protocol: how it is run.
        hashes: digests of the policy's code, recorded with the backend's.
        sets: the sets that the task belongs to.
        prompt: what the policy is told, with ``{instruction}`` where the task's own goes.
    """

    task: str
    policy: str
    request: Request
    protocol: Protocol
    hashes: Mapping[str, str]
    sets: tuple[str, ...] = ()
    prompt: str = PLACE


def run(job: Job, backend: Backend, policy: Policy, progress: Progress | None = None) -> Recording:
    """Run one rollout: the acting part, then the settle tail.

    Raises:
        RolloutError: if the simulator or the policy fails; names the step.
        ConfigError: if the backend cannot set up the episode.
    """
    start = backend.reset(job.request)
    horizon = max(1, round(start.horizon * job.protocol.horizon_scale))
    instruction = told(job.prompt, start.instruction)
    info = EpisodeInfo(job.task, job.request.seed, instruction, horizon, start.scene, job.sets)
    steps, actions = [start.step], [np.zeros(ACTION_SIZE)]
    if progress:
        progress(0, horizon)
    patient = job.protocol.stop == "horizon"
    for action in _actions(policy, info, steps, backend, patient):
        steps.append(backend.step(action))
        actions.append(action)
        if progress:
            progress(len(steps) - 1, horizon)
        if len(steps) > horizon or (steps[-1].success and job.protocol.stop == "success"):
            break
    acting = len(steps)
    for action in _settling(actions, steps, start):
        steps.append(backend.step(action))
        actions.append(action)
    stacked = Steps.stack(steps, [a.astype(np.float32) for a in actions], acting)
    source = backend.provenance
    episode = Episode(
        task=job.task,
        seed=job.request.seed,
        policy=job.policy,
        instruction=info.instruction,
        horizon=horizon,
        ended=_ended(bool(steps[acting - 1].success), acting > horizon, patient),
        backend=source.backend,
        scenes=job.request.scenes,
        stepping=job.request.stepping,
        assets=source.assets,
        versions=dict(source.versions),
        hashes={**source.hashes, **job.hashes, "start": start.fingerprint},
        served=_facts(policy),
        hazards=tuple(getattr(policy, "hazards", ())),
        request=encode_request(job.request),
    )
    return check(Recording(episode, start.scene, stacked))


def _ended(success: bool, late: bool, patient: bool) -> Literal["success", "horizon", "policy"]:
    if success and not patient:
        return "success"
    return "horizon" if late or patient else "policy"


def _facts(policy: Policy) -> Mapping[str, str]:
    """What a policy says about its server and what was exchanged with it."""
    say = getattr(policy, "facts", None)
    return say() if say is not None else {}


def _actions(
    policy: Policy, info: EpisodeInfo, steps: list[Step], backend: Backend, patient: bool
) -> Iterator[NDArray[Any]]:
    """The policy's actions, one by one; a new chunk when the last one is used up.

    They end when the policy says that it is done, unless one is patient.
    """
    try:
        policy.reset(info)
    except SafemanipError:
        raise
    except Exception as error:
        raise RolloutError(f"the policy failed at reset: {_say(error)}") from error
    while patient or not getattr(policy, "done", False):
        index = len(steps) - 1
        try:
            chunk = policy.act(Observation(index, info.instruction, steps[-1], backend.observe))
        except SafemanipError:
            raise
        except Exception as error:
            raise RolloutError(f"the policy failed at step {index}: {_say(error)}") from error
        yield from _checked(chunk, index)


def _checked(chunk: Any, index: int) -> NDArray[np.float64]:
    """A policy's answer as a chunk (H, 12) of finite actions, clipped to [-1, 1]."""
    try:
        actions = np.atleast_2d(np.asarray(chunk, np.float64))
    except (TypeError, ValueError) as error:
        raise RolloutError(f"step {index}: the action is not an array ({error})") from error
    if actions.ndim != 2 or actions.shape[1] != ACTION_SIZE or len(actions) == 0:
        raise RolloutError(
            f"step {index}: the action has shape {np.shape(chunk)}, expected "
            f"({ACTION_SIZE},) or (H, {ACTION_SIZE})"
        )
    bad = np.argwhere(~np.isfinite(actions))
    if len(bad):
        raise RolloutError(f"step {index}: action[{bad[0][0]}, {bad[0][1]}] is not finite")
    return np.clip(actions, -1.0, 1.0)


def _settling(
    actions: list[NDArray[Any]], steps: list[Step], start: Start
) -> Iterator[NDArray[np.float64]]:
    """Actions that hold still, until the scene has been at rest long enough."""
    dt = start.scene.control_period
    hold = np.zeros(ACTION_SIZE)
    hold[6] = actions[-1][6]
    # In base mode the arm keeps its goal, in arm mode it would take the present pose as its new
    # goal at every step and sag. The goal exists once an action was sent in arm mode.
    hold[11] = 1.0 if any(a[11] < 0.0 for a in actions[1:]) else -1.0
    resting = 0
    for _ in range(round(TAIL_SECONDS / dt)):
        yield hold
        resting = resting + 1 if _at_rest(steps[-1]) else 0
        if resting >= round(REST_SECONDS / dt):
            return


def _at_rest(step: Step) -> bool:
    speed = np.linalg.norm(step.object_twist[:, :3], axis=1)
    spin = np.linalg.norm(step.object_twist[:, 3:], axis=1)
    rate = np.abs(step.joint[:, 1])
    return bool(
        (speed < REST_SPEED).all() and (spin < REST_SPIN).all() and (rate < REST_RATE).all()
    )


def _say(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
