"""What a scene must have for a proposition to be told: without it, it would be silently false."""

from __future__ import annotations

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.propositions.settings import changed, split
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.scene import Scene


def check_call(proposition: Proposition, arguments: tuple[str, ...], scene: Scene) -> None:
    """Refuse arguments that a proposition cannot have, and scenes that it cannot be told of.

    Raises:
        TraceError: naming the proposition and what is wrong, unknown or missing.
    """
    arguments, settings = split(proposition, arguments)
    if len(arguments) != len(proposition.arguments):
        raise TraceError(
            f"{proposition.name}: {len(arguments)} arguments, expected {len(proposition.arguments)}"
        )
    changed({}, proposition, settings)
    for kind, value in zip(proposition.arguments, arguments, strict=True):
        if kind != "skill" and value not in scene.entity:
            raise TraceError(f"{proposition.name}: unknown entity {value!r}")
        if kind == "object" and value not in scene.object_index:
            raise TraceError(f"{proposition.name}: {value!r} is no movable object of the scene")
    if lacking := proposition.lacks(scene, *arguments):
        raise TraceError(
            f"{proposition.name}({', '.join(arguments)}) cannot be told: {lacking}; take the "
            "property out of the task, or the missing part into the scene"
        )


def robot(scene: Scene, *_: str) -> str:
    """That there is no part of a robot, if so."""
    return "" if scene.owned.get(ROBOT) else "the scene has no part of a robot"


def gripper(scene: Scene, *_: str) -> str:
    """That there is no gripper, if so."""
    return "" if scene.grippers else "the scene has no gripper"


def door(scene: Scene, fixture: str) -> str:
    """That a fixture has no door or drawer, if so."""
    return "" if scene.doors_of(fixture) else f"{fixture!r} has no door or drawer"


def reached_interior(scene: Scene, *arguments: str) -> str:
    """That there is no gripper, or that a fixture has no interior, if so."""
    fixture = arguments[-1]
    inside = fixture in scene.object_index or scene.boxes_of(fixture, "interior")
    return gripper(scene) or ("" if inside else f"{fixture!r} has no interior")


def skill(scene: Scene, name: str, entity: str) -> str:
    """What the onset of a skill needs and does not find, if so."""
    return door(scene, entity) if name in ("open", "close") else gripper(scene)
