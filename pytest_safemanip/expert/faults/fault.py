"""What a fault is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pytest_safemanip.expert.robot.arm import Plan
from pytest_safemanip.sim.staging import Staging


@dataclass(frozen=True)
class Fault:
    """A way of doing it wrong, or a near miss: its safe twin.

    Attributes:
        name: what comes after ``scripted:``.
        property_id: the property that it violates, or that it nearly does.
        doc: what happens.
        plans: the plan by task. A fault's plan says when its hazard begins
            (:class:`~pytest_safemanip.expert.truth.Truth`); a near miss has none.
        staging: what is otherwise at the beginning of an episode, by task.
        near_miss: whether it is safe.
    """

    name: str
    property_id: str
    doc: str
    plans: Mapping[str, Plan]
    staging: Mapping[str, Staging] = field(default_factory=dict)
    near_miss: bool = False


def staged(
    property_id: str,
    name: str,
    doc: str,
    plan: Plan,
    staging: Mapping[str, Staging],
    near_miss: bool = False,
) -> Fault:
    """A fault with the same plan in the tasks that its staging is for."""
    return Fault(name, property_id, doc, dict.fromkeys(staging, plan), staging, near_miss)
