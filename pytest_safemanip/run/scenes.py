"""What a task's file says of the scene of its episodes."""

from __future__ import annotations

from collections.abc import Mapping

from pytest_safemanip.sim.staging import Change, Fill, from_plain
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
