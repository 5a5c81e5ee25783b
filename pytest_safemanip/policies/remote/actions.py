"""Converts a model's outputs to actions that the environment can execute."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import printable
from pytest_safemanip.policies.remote.embodiment import PANDA_OMRON, Embodiment

PARTS = PANDA_OMRON.parts
"""Where a GR00T model's outputs are in an action."""
ACTION_SIZE = PANDA_OMRON.action_size


class ActionError(ValueError):
    """Actions that cannot be executed; names the entry of the reply, and the index in it."""


@dataclass(frozen=True)
class Chunk:
    """Actions to be executed before the model is asked again.

    Attributes:
        actions: (H, A), float64, in the environment's order, entries in [-1, 1].
        clipped: how many entries were beyond; normal for models that predict unbounded values.
    """

    actions: NDArray[np.float64]
    clipped: int


def chunk_of(
    values: NDArray[Any],
    steps: int,
    label: Callable[[int, int], str],
    robot: Embodiment = PANDA_OMRON,
) -> Chunk:
    """The first actions of an answer, as the environment takes them.

    Args:
        values: (H, A), H >= steps.
        steps: how many are executed.
        label: names a row and a column of ``values`` in the words of the reply.
        robot: whose actions they are.

    Raises:
        ActionError: if one of them is not finite, or there are too few.
    """
    if len(values) < steps:
        raise ActionError(f"{len(values)} actions, but {steps} are executed before the next call")
    actions = np.array(values[:steps], np.float64)
    bad = np.argwhere(~np.isfinite(actions))
    if len(bad):
        row, column = (int(n) for n in bad[0])
        more = f", and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise ActionError(
            f"{label(row, column)} is {actions[row, column]}{more}: the action of step {row} of "
            f"the {steps} that are executed"
        )
    for column, (below, above) in robot.switches.items():
        actions[:, column] = np.where(actions[:, column] < 0.5, below, above)
    clipped = int((np.abs(actions) > 1.0).sum())
    return Chunk(np.clip(actions, -1.0, 1.0), clipped)


def flat(
    reply: Mapping[Any, Any], key: str, robot: Embodiment = PANDA_OMRON
) -> NDArray[np.float64]:
    """The rows of a reply that has whole actions in one entry.

    Returns:
        (H, A).

    Raises:
        ActionError: if the entry is missing, not numeric, or not (A,) or (H, A).
    """
    if key not in reply:
        raise ActionError(f"the reply has no {key!r}; it has {_names(reply)}")
    values = _numbers(reply[key], key)
    rows = values[None] if values.ndim == 1 else values
    if rows.ndim != 2 or rows.shape[1] != robot.action_size:
        raise ActionError(
            f"{key!r} has shape {values.shape}, expected (H, {robot.action_size}): is another "
            "robot's model being served?"
        )
    return rows


def parted(reply: Mapping[Any, Any], prefix: str) -> NDArray[np.float64]:
    """The rows of a reply that has an entry for each part of an action.

    Args:
        reply: parts (1, H, D) or (H, D), by :data:`PARTS` with a prefix.
        prefix: before their names.

    Returns:
        (H, 12).

    Raises:
        ActionError: if a part is missing, not numeric, or of another shape.
    """
    columns: list[NDArray[np.float64]] = []
    for part, where in PARTS.items():
        key, size = prefix + part, where.stop - where.start
        if key not in reply:
            raise ActionError(f"the reply has no {key!r}; it has {_names(reply)}")
        given = _numbers(reply[key], key)
        values = given[0] if given.ndim == 3 and len(given) == 1 else given
        if values.ndim == 1 and size == 1:
            values = values[:, None]
        if values.ndim != 2 or values.shape[1] != size:
            raise ActionError(f"{key!r} has shape {given.shape}, expected (1, H, {size})")
        if columns and len(values) != len(columns[0]):
            raise ActionError(
                f"{key!r} has {len(values)} steps, the parts before {len(columns[0])}"
            )
        columns.append(values)
    return np.concatenate(columns, axis=1)


def part_label(prefix: str, robot: Embodiment = PANDA_OMRON) -> Callable[[int, int], str]:
    """Names an entry of a reply with parts, for :func:`chunk_of`."""

    def label(row: int, column: int) -> str:
        part, where = next((p, w) for p, w in robot.parts.items() if w.start <= column < w.stop)
        return f"{prefix}{part}[{row}, {column - where.start}]"

    return label


def flat_label(key: str, robot: Embodiment = PANDA_OMRON) -> Callable[[int, int], str]:
    """Names an entry of a reply with whole actions, for :func:`chunk_of`."""
    inner = part_label("", robot)
    return lambda row, column: f"{key}[{row}, {column}] ({inner(row, column).partition('[')[0]})"


def _numbers(value: Any, key: str) -> NDArray[np.float64]:
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise ValueError(f"{array.dtype} is no number's type")
        return array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ActionError(
            f"{key!r} is not an array of numbers ({printable(str(error), 100)})"
        ) from error


def _names(reply: Mapping[Any, Any]) -> str:
    return ", ".join(printable(repr(key), 40) for key in list(reply)[:12]) or "nothing"
