"""The rollout loop: one protocol for every policy, every control step recorded."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal
from typing import Protocol as Interface

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import printable
from pytest_safemanip.policies.adapter import AdaptedPolicy
from pytest_safemanip.policies.base import EpisodeInfo, Observation, Permissions, Policy
from pytest_safemanip.policies.prompts import PLACEHOLDER, render_prompt
from pytest_safemanip.rollouts.disturbances.definition import Disturbance, to_plain
from pytest_safemanip.rollouts.disturbances.together import Disturbed, seed_of_repeat
from pytest_safemanip.sim.backend import Backend, Request, RobotSpec
from pytest_safemanip.sim.clearance import Foresees, blind
from pytest_safemanip.sim.codec import encode_request
from pytest_safemanip.sim.rehearsal import Rehearsal, Rehearses
from pytest_safemanip.trace.episode import LONGEST_FAILURE, Ended, Episode
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step, Steps

REST_SPEED = 0.01
"""Objects slower than this (m/s) are at rest; the solver's own jitter is below it."""
REST_SPIN = 0.05
"""Objects that turn slower than this (rad/s) are at rest."""
REST_RATE = 0.05
"""Doors and drawers that move slower than this (1/s) are at rest: 2 cm/s for a drawer."""
REST_SECONDS = 0.5
TAIL_SECONDS = 5.0
STILL = 0.002
"""What has moved less, in m, and in what an orientation or an opening is measured in, has not."""


class OnStep(Interface):
    """Is told how a rollout gets on."""

    def __call__(self, step: int, horizon: int, rehearsed: int | None = None) -> None:
        """A control step was made, or rehearsed.

        Args:
            step: how many were made.
            horizon: of the episode; 0 while it is set up.
            rehearsed: how many a script that plans has rehearsed; None while it rehearses nothing.
        """


"""Called with the steps so far and the horizon."""


class Watcher(Interface):
    """Says where an episode is to end early."""

    def unsafe(self, step: Step, action: NDArray[Any] | None) -> bool:
        """Take in a step, and the action that led to it, None after reset; whether it is unsafe."""

    def warns(self, action: NDArray[Any], before: Sequence[NDArray[Any]]) -> str:
        """Why the episode is to end before an action (A,) that comes after others, in a line; empty
        if it is not.
        """


class Watch(Interface):
    """Makes what watches an episode, from its scene and its robot."""

    def __call__(self, scene: Scene, robot: RobotSpec) -> Watcher:
        """For an episode."""


class _Blind:
    """Watches nothing."""

    def unsafe(self, step: Step, action: NDArray[Any] | None) -> bool:
        return False

    def warns(self, action: NDArray[Any], before: Sequence[NDArray[Any]]) -> str:
        return ""


@dataclass(frozen=True)
class Protocol:
    """The rollout protocol, the same for every policy.

    Attributes:
        stop: ``success`` ends the acting part at the first step whose success check holds,
            ``horizon`` never before the horizon, ``violation`` at the first step that succeeds or
            that is unsafe, ``warning`` before that, where a warning comes first.
        horizon_scale: factor on the task's own horizon.
        stall_s: seconds after which the acting part ends if nothing moves any more; None if
            it never does for that reason.
    """

    stop: Literal["success", "horizon", "violation", "warning"] = "success"
    horizon_scale: float = 1.0
    stall_s: float | None = None


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
        prompt: the prompt template, with ``{instruction}`` where the task's own goes.
        watch: says where the rollout is to end early; None if nothing does.
        binding: what the backend derived of the task; recorded with the rollout.
        permissions: what the task lets the robot touch, for a policy that reads it.
        disturbances: what goes wrong while it runs, in this order.
        repeat: how often the same was run before; see
            :attr:`~pytest_safemanip.trace.episode.Episode.repeat`.
    """

    task: str
    policy: str
    request: Request
    protocol: Protocol
    hashes: Mapping[str, str]
    sets: tuple[str, ...] = ()
    prompt: str = PLACEHOLDER
    watch: Watch | None = None
    binding: str = ""
    permissions: Permissions | None = None
    disturbances: tuple[Disturbance, ...] = ()
    repeat: int = 0


def run(job: Job, backend: Backend, policy: Policy, progress: OnStep | None = None) -> Recording:
    """Run one rollout: the acting part, then the settle tail.

    Raises:
        RolloutError: if the simulator or the policy fails; names the step.
        CannotStage: if the episode cannot begin as it is asked for.
        ConfigError: if the backend cannot set up the episode.
    """
    start = backend.reset(job.request)
    horizon = max(1, round(start.horizon * job.protocol.horizon_scale))
    instruction = render_prompt(job.prompt, start.instruction)
    actor = policy if isinstance(policy, AdaptedPolicy) else AdaptedPolicy(policy)
    robot = backend.spec.in_task(job.request.task).robot
    info = EpisodeInfo(
        job.request.task,
        seed_of_repeat(job.request.seed, job.repeat),
        instruction,
        horizon,
        start.scene,
        robot,
        job.sets,
        job.permissions,
    )
    steps, actions, clipped = [start.step], [np.zeros(robot.actions.size)], 0
    if progress:
        progress(0, horizon)
    patient = job.protocol.stop == "horizon"
    watcher: Watcher = job.watch(start.scene, robot) if job.watch else _Blind()
    unsafe, warned = watcher.unsafe(start.step, None), ""
    low, high = robot.actions.low, robot.actions.high
    seeds = (job.request.seed, job.repeat)
    disturbed = Disturbed(job.disturbances, start, backend, job.request.task, seeds)
    stall = _Stall(job.protocol.stall_s, start.scene.control_period)
    stalled = False

    def clip(asked: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal clipped
        action: NDArray[np.float64] = np.clip(asked, low, high)
        clipped += int(np.count_nonzero(action != asked))
        return action

    def rehearsed(count: int) -> None:
        if progress:
            progress(len(steps) - 1, horizon, count)

    asked = _actions(job.policy, actor, info, steps, backend, disturbed, patient, rehearsed)
    for told in disturbed.told(map(clip, asked)):
        action = np.clip(told, low, high)
        if warned := watcher.warns(action, actions[1:]):
            break
        disturbed.push(len(steps) - 1, steps[-1])
        steps.append(backend.step(action))
        actions.append(action)
        if progress:
            progress(len(steps) - 1, horizon)
        unsafe |= watcher.unsafe(steps[-1], action)
        stalled = stall.lasts(steps[-1]) and len(steps) > disturbed.until
        if len(steps) > horizon or (steps[-1].success and not patient) or unsafe or stalled:
            break
    acting = len(steps)
    hold = robot.actions.hold(actions[1:])
    for _ in settling(steps, start.scene.control_period):
        steps.append(backend.step(hold))
        actions.append(hold)
    stacked = Steps.stack(steps, [a.astype(np.float32) for a in actions], acting)
    source = backend.provenance
    served = actor.served_facts or ({"clipped": str(clipped)} if clipped else {})
    episode = Episode(
        task=job.task,
        seed=job.request.seed,
        policy=job.policy,
        instruction=info.instruction,
        horizon=horizon,
        ended=_ended(
            bool(steps[acting - 1].success), acting > horizon, patient, unsafe, stalled, warned
        ),
        backend=source.backend,
        scenes=job.request.scenes,
        stepping=job.request.stepping,
        assets=source.assets,
        versions=dict(source.versions),
        hashes={**source.hashes, **job.hashes, "start": start.fingerprint},
        served={**served, "entries": str(robot.actions.size)} if served else {},
        hazards=actor.hazards,
        patches=start.patches,
        request=encode_request(job.request),
        binding=job.binding,
        failure=actor.failure,
        disturbances=tuple(to_plain(job.disturbances)),
        repeat=job.repeat,
        warned=printable(warned, LONGEST_FAILURE - 3),
    )
    return check(Recording(episode, start.scene, stacked))


def _ended(
    success: bool, late: bool, patient: bool, unsafe: bool, stalled: bool, warned: str
) -> Ended:
    if warned:
        return "warning"
    if unsafe:
        return "violation"
    if success and not patient:
        return "success"
    if stalled and not late:
        return "stalled"
    return "horizon" if late or patient else "policy"


def _actions(
    name: str,
    policy: AdaptedPolicy,
    info: EpisodeInfo,
    steps: list[Step],
    backend: Backend,
    disturbed: Disturbed,
    patient: bool,
    rehearsed: Callable[[int], None],
) -> Iterator[NDArray[Any]]:
    """The policy's actions, one by one; a new chunk when the last one is used up.

    They end when the policy says that it is done, unless one is patient.

    Raises:
        RolloutError: if the policy fails, its answer is no action, or it still rehearses.
    """
    policy.reset(info)
    foresee = backend.clearance if isinstance(backend, Foresees) else blind
    actions = info.robot.actions
    rehearsal = (
        Rehearsal(backend, actions, info.horizon, patient, rehearsed)
        if isinstance(backend, Rehearses)
        else None
    )
    while patient or not policy.done:
        index = len(steps) - 1
        key = backend.spec.instruction
        seen = Observation(
            index, info.instruction, steps[-1], backend.observe, key, foresee, rehearsal
        )
        where = f"policy {name!r}, step {index}"
        with rehearsal.acting(where) if rehearsal else contextlib.nullcontext():
            answer = policy.act(disturbed.seen(seen))
        yield from actions.chunk(answer, where)


class _Stall:
    """Notices that neither the robot nor anything else has moved for a while.

    Args:
        seconds: how long; None for never.
        dt: the control period, s.
    """

    def __init__(self, seconds: float | None, dt: float) -> None:
        self._steps = None if seconds is None else max(1, round(seconds / dt))
        self._anchor: NDArray[np.float32] | None = None
        self._still = 0

    def lasts(self, step: Step) -> bool:
        """Take in a step; whether nothing has moved since long enough."""
        if self._steps is None:
            return False
        parts = (step.eef_poses, step.openings, step.base_pose, step.object_pose, step.joint[:, 0])
        now = np.concatenate([np.ravel(part) for part in parts])
        if self._anchor is None or np.abs(now - self._anchor).max() > STILL:
            self._anchor, self._still = now, 0
        self._still += 1
        return self._still > self._steps


def settling(steps: Sequence[Step], dt: float) -> Iterator[None]:
    """The control periods of the settle tail: until the scene has been at rest long enough.

    Args:
        steps: those so far; the caller adds each one that it is asked for.
        dt: the control period, s.
    """
    resting = 0
    for _ in range(round(TAIL_SECONDS / dt)):
        yield
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
