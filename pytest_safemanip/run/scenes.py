"""What a task's file says of the scene of its episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.staging import Change, Fill, Staging, from_plain
from pytest_safemanip.spec.task import Task


def changes_of(task: Task) -> tuple[Change, ...]:
    """What is put elsewhere, opened, pushed and filled before the episode begins."""
    return (*from_plain(task.staging), *(Fill(*filled) for filled in task.liquids.items()))


def groups_of(task: Task, compact: bool) -> Mapping[str, tuple[str, ...]]:
    """Role to the categories or groups that the object is drawn from.

    Args:
        task: the task.
        compact: whether in the backend's own scenes, of which a task's file may say more.
    """
    return {**(task.object_groups if compact else {}), **task.drawn}


def drawn_otherwise(task: Task, staging: Callable[[str], Staging]) -> Mapping[str, tuple[str, ...]]:
    """Role to what a policy draws the object from, of those that the task's file draws from other
    categories or groups: what it stages would be gone.

    Args:
        task: the task.
        staging: what the policy wants otherwise in the episodes of a task.
    """
    if not task.drawn:
        return {}
    try:
        asked = staging(task.simulated).objects
    except RolloutError:  # its cases say so
        return {}
    return {
        role: asked[role]
        for role, drawn in task.drawn.items()
        if role in asked and not set(asked[role]) <= set(drawn)
    }
