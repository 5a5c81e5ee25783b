"""Searches for a way to do a plan: skills are rehearsed in the simulator, in one way after another.

Depth first: where a skill fails, or knocks against something, in all of its ways, the one before it
is done in another way. What is found is then done: with the same bits, if nothing disturbs it, and
from what is seen, if something does.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, IllHeld, Motion, NoWay, SkillFailed, fold_arm
from pytest_safemanip.expert.robot.choices import GRASP, Alternatives, Choices
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.world.knocks import Watch
from pytest_safemanip.sim.rehearsal import Rehearsal

BUDGET = 12_000
"""Control steps that are rehearsed for one plan at most."""
MOST_TRIES, MOST_AGAIN = 24, 6
"""Ways to do a skill that are tried, and of one that has been done before, in another state."""
OTHERS_FIRST, OTHERS = 2, 1
"""Choices that are other than usual at a time: of the first skill, before which nothing can be done
otherwise, and of a later one."""
MOST_ILL = 3
"""Ways that fail for how something is held before it is given up that another one helps."""
MOST_LATE = 2
"""Ways that run out of time before it is given up that another one is quicker."""
MOST_DONE = 4
"""Ways that were done before it is given up that another one helps with what comes after it."""
MOVED = 0.02
"""Share of its travel by which a joint has moved at least."""
FOLDED = "arm folded first"
"""What may be chosen of any skill."""
STEP_BACK, BACK = Call("step back", (), "step back"), 0.45
"""What may help in the end, for success often asks for a hand that is far from everything, and how
far the base draws back then, m: RoboCasa asks for 25 cm, and the hand may come from beyond."""
PATIENCE = 40
"""Control steps of holding still after the plan, in which the task's success may still show."""
SETTLES = 20
"""Control steps after success in which the robot comes to rest, and may still knock."""


@dataclass(frozen=True)
class _Way:
    """A skill, how it is done, and what follows it."""

    call: Call
    choices: Choices
    upcoming: Sequence[Call]


_State = tuple[int, dict[str, Any]]
"""How many control steps were rehearsed, and all that the arm knows."""


class Search:
    """A search for one plan.

    Args:
        arm: the arm.
        rehearsal: tries steps.
        ways_on: what a part of a plan comes to in the present state, and what does instead.
        perform: the motion of a call.
        whole: whether the task is to succeed in the end.
    """

    def __init__(
        self,
        arm: Arm,
        rehearsal: Rehearsal,
        ways_on: Callable[[Any], Sequence[Sequence[Any]]],
        perform: Callable[[Call], Motion],
        whole: bool = True,
    ) -> None:
        self._arm, self._rehearsal, self._whole = arm, rehearsal, whole
        self._ways_on, self._perform = ways_on, perform
        self._ways, self._best = list[_Way](), list[_Way]()
        self._length, self._left = 0, BUDGET
        self._done, self._reason = -1, ""
        self._hopeless = self._ill = self._late = False
        self._visited: set[int] = set()
        self.log: list[str] = []

    def plan(self, entries: Sequence[Any]) -> Motion:
        """Do a plan.

        Raises:
            SkillFailed: where no way was found, after what was found.
        """
        arm, saved = self._arm, self._arm.save()
        self._rehearsal.begin()
        found = self._solve(tuple(entries), 0)
        if found:
            self._rehearsal.keep()
        else:
            self._rehearsal.undo()
        arm.restore(saved)
        for way in self._ways if found else self._best:
            yield from self._do(way)
            if self._over():
                return
        if not found:
            raise SkillFailed(self._reason)

    def _do(self, way: _Way) -> Motion:
        """Do a skill as it was rehearsed.

        Raises:
            SkillFailed: if it fails, for something else than the script moved something.
        """
        self._arm.choices, self._arm.upcoming = way.choices, way.upcoming
        try:
            for action in self._motion(way.call):
                yield action
                if self._over():
                    return
        except SkillFailed as error:
            raise SkillFailed(f"{way.call.text}: {error}") from error

    def _over(self) -> bool:
        """Whether the rollout ends here."""
        return self._arm.step.success and not self._rehearsal.patient

    def _solve(self, entries: tuple[Any, ...], number: int) -> bool:
        if not entries:
            return not self._whole or self._hold() or self._step_back()
        if not isinstance(entries[0], Call):
            ways = self._ways_on(entries[0])
            return any(self._solve((*way, *entries[1:]), number) for way in ways)
        call, rest = entries[0], entries[1:]
        most = MOST_AGAIN if number in self._visited else MOST_TRIES
        self._visited.add(number)
        done = ill = late = 0
        alternatives = Alternatives(OTHERS if number else OTHERS_FIRST)
        for choices in itertools.islice(alternatives, most):
            if self._left <= 0:
                return False
            state, depth = self._begin(), len(self._ways)
            self._arm.upcoming = [c for entry in rest for c in self._named(entry)]
            reason, success = self._try(call, choices)
            hopeless, ill = self._hopeless, ill + self._ill
            self.log.append(f"{number} {call.text} [{choices}]: {reason or 'ok'}")
            if not reason:
                done += 1
                self._ways.append(_Way(call, choices, self._arm.upcoming))
                if not success and number > self._done:
                    self._done, self._best = number, self._ways[:]
                if success or self._solve(rest, number + 1):
                    self._rehearsal.keep()
                    return True
                if self._ill:
                    alternatives.prefer(GRASP)
            elif number > self._done and not choices.decided:
                self._reason = f"{call.text}: {reason}"
            self._undo(state)
            del self._ways[depth:]
            hopeless &= not choices.decided
            late += self._late
            if hopeless or done == MOST_DONE or late == MOST_LATE or (number and ill == MOST_ILL):
                break
        self._late = late == MOST_LATE
        return False

    def _try(self, call: Call, choices: Choices) -> tuple[str, bool]:
        """Rehearse a skill.

        Returns:
            What is wrong with it, empty if nothing is; whether the task succeeded.
        """
        arm = self._arm
        # A try without any control step is not free, or such skills would be tried for ever.
        self._left -= 1
        self._hopeless = self._ill = self._late = False
        arm.choices, before = choices, arm.step.joint[:, 0].copy()
        watch = Watch(arm, call.roles)
        try:
            for action in self._motion(call):
                if not self._step(action):
                    self._late = True
                    return "there is no time left", False
                if self._over():
                    return watch.wrong(arm.step) or self._later(watch), True
                if wrong := watch.wrong(arm.step):
                    self._ill = watch.slipped
                    return wrong, False
        except SkillFailed as error:
            # What the skill itself moved may have been moved otherwise.
            moved = float(np.abs(arm.step.joint[:, 0] - before).max(initial=0.0)) > MOVED
            self._hopeless = isinstance(error, NoWay) and not moved
            self._ill = isinstance(error, IllHeld)
            return str(error), False
        finally:
            # Last, for the arm's posture is what it hangs on least often.
            choices.choose(FOLDED, (False, True))
        return watch.left(arm.step), False

    def _later(self, watch: Watch) -> str:
        """What is wrong while the robot comes to rest after success, empty if nothing is."""
        state, wrong = self._begin(), ""
        for _ in range(SETTLES):
            if wrong or not self._step(self._arm.hold()):
                break
            wrong = watch.wrong(self._arm.step)
        self._undo(state)
        return wrong

    def _named(self, entry: Any) -> Sequence[Call]:
        """The calls of a part of a plan."""
        if isinstance(entry, Call):
            return [entry]
        return [call for part in self._ways_on(entry)[0] for call in self._named(part)]

    def _motion(self, call: Call) -> Motion:
        arm = self._arm
        if arm.choices.decided.get(FOLDED):
            yield from fold_arm(arm, required=False)
        if call is STEP_BACK:
            yield from arm.drive(arm.base - BACK * arm.forward)
        else:
            yield from self._perform(call)

    def _step(self, action: Array) -> bool:
        arm = self._arm
        if self._length >= self._rehearsal.horizon:
            return False
        self._left -= 1
        self._length += 1
        arm.see(self._rehearsal.step(action))
        arm.truth.at(arm.truth.index + 1)
        return True

    def _begin(self) -> _State:
        """Begin a trial."""
        self._rehearsal.begin()
        return self._length, self._arm.save()

    def _undo(self, state: _State) -> None:
        """End the newest trial: all is as it was."""
        self._rehearsal.undo()
        self._length = state[0]
        self._arm.restore(state[1])

    def _hold(self) -> bool:
        """Hold still until the task succeeds."""
        state = self._begin()
        for _ in range(PATIENCE):
            if self._rehearsal.patient or not self._step(self._arm.hold()):
                break
            if self._arm.step.success:
                self._rehearsal.keep()
                return True
        self._reason = "the task did not succeed"
        self._undo(state)
        return self._rehearsal.patient

    def _step_back(self) -> bool:
        """Draw back and hold still until the task succeeds."""
        state, choices = self._begin(), Choices()
        reason, success = self._try(STEP_BACK, choices)
        if not reason and (success or self._hold()):
            self._ways.append(_Way(STEP_BACK, choices, ()))
            self._rehearsal.keep()
            return True
        self._undo(state)
        return False


def rehearsed(arm: Arm, calls: Sequence[Call], perform: Callable[[Call], Motion]) -> Motion:
    """Motions, one after the other, in the first of their ways that knock against nothing.

    Args:
        arm: the arm.
        calls: what is done.
        perform: begins the motion of a call.

    Raises:
        SkillFailed: if there is none.
    """
    if arm.rehearsal is None:
        for call in calls:
            yield from perform(call)
        return
    allowed, arm.permissions = arm.permissions, None
    search = Search(arm, arm.rehearsal, lambda calls: [calls], perform, whole=False)
    yield from search.plan(calls)
    arm.permissions, arm.choices = allowed, Choices()
