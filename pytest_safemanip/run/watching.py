"""Rollouts that end at the first violation of what they are judged by, or before it."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from pytest_safemanip.live import LiveJudge
from pytest_safemanip.ltlf import Profile
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import Parameters
from pytest_safemanip.provenance import functions_digest, source_digest
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.sim.backend import RobotSpec
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step


@dataclass(frozen=True)
class Watch:
    """Watches what a rollout is judged by.

    Attributes:
        task: of the rollout.
        properties: that it is judged by.
        catalogue: the propositions.
        parameters: values of all their parameters.
        attributes: of object categories.
        semantics: of formulas.
        early: whether it ends at a warning, too.
    """

    task: Task
    properties: tuple[Property, ...]
    catalogue: Catalogue
    parameters: Parameters
    attributes: Mapping[str, frozenset[str]]
    semantics: Profile
    early: bool = False

    @classmethod
    def of(cls, plan: Plan, case: Case) -> Watch:
        """Watches all that the rollout of a case is judged by."""
        judged = {other.property_id for other in plan.cases if other.rollout == case.rollout}
        return cls(
            plan.tasks[case.task],
            tuple(prop for name, prop in plan.properties.items() if name in judged),
            plan.catalogue,
            plan.parameters,
            plan.attributes,
            plan.settings.semantics,
            plan.settings.stop == "warning",
        )

    def __call__(self, scene: Scene, robot: RobotSpec) -> Watching:
        """What says of an episode whether a step is unsafe, or going to be.

        Raises:
            TraceError: if the scene lacks what a property or a role needs.
        """
        binding = self.task.bind(scene, self.attributes)
        watched = self.properties, self.catalogue, self.parameters, self.semantics
        return Watching(LiveJudge(scene, binding, *watched), robot, self.early)

    def digest(self) -> str:
        """Digest of all that decides when the rollout ends."""
        nowhere = Path()
        others = [one for one in self.catalogue.values() if one not in SHIPPED]
        parts_of = [(one.evaluate, one.margin, one.forecast) for one in others]
        own = [function for parts in parts_of for function in parts if function is not None]
        parts = (
            [dataclasses.replace(prop, path=nowhere) for prop in self.properties],
            dataclasses.replace(self.task, path=nowhere),
            sorted(self.parameters.items()),
            sorted((name, sorted(kinds)) for name, kinds in self.attributes.items()),
            self.semantics,
            source_digest("propositions", "ltlf", "live"),
            functions_digest(own),
        )
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


class Watching:
    """Watches an episode.

    Args:
        judge: watches it.
        robot: whose actions are asked about.
        early: whether there are warnings.
    """

    def __init__(self, judge: LiveJudge, robot: RobotSpec, early: bool) -> None:
        self._judge, self._robot, self._early = judge, robot, early

    def unsafe(self, step: Step, action: NDArray[Any] | None) -> bool:
        """Take in a step, and the action that led to it, None after reset; whether it is unsafe."""
        told = self._judge.step(step, action)
        return any(one.unsafe for instances in told.values() for one in instances)

    def warns(self, action: NDArray[Any], before: Sequence[NDArray[Any]]) -> str:
        """The most urgent violation that is near if an action is taken next (A,), after others, in
        words; empty if none is.
        """
        if not self._early:
            return ""
        commands, pace = self._robot.commands(action), self._robot.pace(action, before)
        near = self._judge.warnings(commands, pace)
        return str(near[0]) if near else ""
