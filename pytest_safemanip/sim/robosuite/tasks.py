"""robosuite's tasks: what is known of them before they are simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

ONE, SEVERAL = 500, 1000
"""Control steps: what robosuite's benchmark gives a task with one thing to handle (Zhu et al.,
arXiv:2009.12293), and what its environments have where nothing else is asked for."""


@dataclass(frozen=True)
class TaskModel:
    """A task of robosuite.

    Attributes:
        instruction: robosuite has none; for policies that take one.
        fixtures: the bodies that are furniture.
        horizon: control steps.
        arms: how many it needs.
        hand: the gripper that it puts on every arm; empty for the robot's own.
    """

    instruction: str
    fixtures: tuple[str, ...] = ("table",)
    horizon: int = ONE
    arms: int = 1
    hand: str = ""


_BINS = ("bin1", "bin2")
_PEGS = ("table", "peg1", "peg2")

TASKS: Mapping[str, TaskModel] = MappingProxyType(
    {
        "Lift": TaskModel("lift the cube"),
        "Stack": TaskModel("put the red cube on the green cube"),
        "Door": TaskModel("open the door", ("table", "Door")),
        "PickPlace": TaskModel("put each thing into its own compartment", _BINS, SEVERAL),
        "PickPlaceSingle": TaskModel("put the thing into its compartment", _BINS),
        "PickPlaceMilk": TaskModel("put the milk into its compartment", _BINS),
        "PickPlaceBread": TaskModel("put the bread into its compartment", _BINS),
        "PickPlaceCereal": TaskModel("put the cereal into its compartment", _BINS),
        "PickPlaceCan": TaskModel("put the can into its compartment", _BINS),
        "NutAssembly": TaskModel("fit each nut onto its peg", _PEGS, SEVERAL),
        "NutAssemblySingle": TaskModel("fit the nut onto its peg", _PEGS),
        "NutAssemblySquare": TaskModel("fit the square nut onto the square peg", _PEGS),
        "NutAssemblyRound": TaskModel("fit the round nut onto the round peg", _PEGS),
        "Wipe": TaskModel("wipe the table clean", hand="WipingGripper"),
        "TwoArmLift": TaskModel("lift the pot by both handles", arms=2),
        "TwoArmHandover": TaskModel("hand the hammer over", arms=2),
    }
)
