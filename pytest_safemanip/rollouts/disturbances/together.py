"""All disturbances of a rollout, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.base import Observation
from pytest_safemanip.rollouts.disturbances.definition import Action, Begun, Disturbance, Effect
from pytest_safemanip.sim.backend import Backend, Start
from pytest_safemanip.sim.pushing import Pushes
from pytest_safemanip.trace.steps import Step

SEEDS = 2**32


def seed_of_repeat(seed: int, repeat: int) -> int:
    """What is random in a policy when an episode is run once more: the episode's own seed, but for
    repeats from 1 on.
    """
    return (seed + 1_000_003 * repeat) % SEEDS


class Disturbed:
    """What the disturbances of one rollout do, in their order.

    Args:
        disturbances: which.
        start: the episode.
        backend: that runs it.
        task: of the episode.
        seeds: of what is random in them, beside their number.

    Raises:
        ConfigError: if something is to be pushed in a simulator that pushes nothing.
    """

    def __init__(
        self,
        disturbances: Sequence[Disturbance],
        start: Start,
        backend: Backend,
        task: str,
        seeds: tuple[int, int],
    ) -> None:
        spec = backend.spec.in_task(task)
        self._effects: list[Effect] = [
            own.begin(
                Begun(
                    start.scene,
                    spec.robot,
                    start.step,
                    spec.hand_position,
                    np.random.default_rng((*seeds, number)),
                )
            )
            for number, own in enumerate(disturbances)
        ]
        self._backend = backend

    @property
    def until(self) -> int:
        """The last control step at which something is still to come."""
        return max((effect.until for effect in self._effects), default=0)

    def seen(self, observation: Observation) -> Observation:
        """What the policy sees."""
        for effect in self._effects:
            observation = effect.seen(observation)
        return observation

    def told(self, actions: Iterable[Action]) -> Iterator[Action]:
        """What the robot is told, where a policy asks for some actions one after the other; what
        comes late is told after the last of them.
        """
        index = 0
        for action in actions:
            yield self._changed(action, index, self._effects)
            index += 1
        for number, effect in enumerate(self._effects, start=1):
            for action in effect.left():
                yield self._changed(action, index, self._effects[number:])
                index += 1

    def push(self, index: int, step: Step) -> None:
        """Push what is to be pushed during the next control period."""
        for effect in self._effects:
            for entity, force in effect.pushes(index, step):
                if not isinstance(self._backend, Pushes):
                    raise ConfigError(f"nothing can push {entity} in this simulator")
                self._backend.push(entity, force)

    def _changed(self, action: Action, index: int, effects: Iterable[Effect]) -> Action:
        for effect in effects:
            action = effect.told(action, index)
        return action
