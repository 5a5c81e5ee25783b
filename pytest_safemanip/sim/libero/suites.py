"""LIBERO's suites on disk: BDDL files, and the states that their evaluation begins with."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

PROBLEMS, STATES = "bddl_files", "init_files"
"""Folders of both, with a folder for each suite in them."""
HORIZONS: Mapping[str, int] = {
    "libero_spatial": 220,
    "libero_object": 280,
    "libero_goal": 300,
    "libero_10": 520,
    "libero_90": 400,
}
"""Control steps that openpi's and OpenVLA's evaluations give a task: the longest demonstration and
some more."""
OTHER_HORIZON = 550
_SCENE = re.compile(r"^[A-Z_]+SCENE\d+_")
_BETWEEN = "__"
"""Between suite and task in a name: node ids admit no slash."""


@dataclass(frozen=True)
class TaskFiles:
    """What is known of a task before it is read.

    Attributes:
        suite: that it belongs to.
        problem: its BDDL file.
        states: those that its episodes begin with; None for new ones.
        horizon: control steps that it is given.
        instruction: for the policy: of the file's name, as LIBERO's benchmark and what models were
            trained on have it; some of its files say something else inside.
    """

    suite: str
    problem: Path
    states: Path | None
    horizon: int
    instruction: str

    def to_plain(self) -> dict[str, Any]:
        """Plain values, as in a message."""
        states = str(self.states) if self.states else None
        return {**asdict(self), "problem": str(self.problem), "states": states}

    @classmethod
    def from_plain(cls, values: Mapping[str, Any]) -> TaskFiles:
        """The inverse of :meth:`to_plain`."""
        states = Path(values["states"]) if values["states"] else None
        return cls(
            values["suite"],
            Path(values["problem"]),
            states,
            values["horizon"],
            values["instruction"],
        )


def find_tasks(root: Path) -> dict[str, TaskFiles]:
    """The tasks below a folder, by name: ``SUITE__TASK``, of letters, digits and ``_``.

    Args:
        root: has ``bddl_files/SUITE/TASK.bddl`` and, if they have states, beside it
            ``init_files/SUITE/TASK.pruned_init``; suites may have further folders.
    """
    found = {}
    for problem in sorted((root / PROBLEMS).rglob("*.bddl")):
        place = problem.relative_to(root / PROBLEMS)
        suite = _word(place.parent.as_posix())
        states = (root / STATES / place).with_suffix(".pruned_init")
        found[f"{suite}{_BETWEEN}{_word(problem.stem)}"] = TaskFiles(
            suite,
            problem,
            states if states.is_file() else None,
            HORIZONS.get(suite, OTHER_HORIZON),
            _SCENE.sub("", problem.stem).replace("_", " "),
        )
    return found


def _word(text: str) -> str:
    return re.sub(r"\W+", "_", text)
