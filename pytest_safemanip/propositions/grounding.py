"""What a scene must have for a proposition to be told: without it, it would be silently false."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.propositions.binding import OF_DOORS
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.propositions.settings import changed, split
from pytest_safemanip.trace.elements import ROBOT, Switch
from pytest_safemanip.trace.scene import Scene

PLACE = "place"
"""Kind of an argument that fills space: the robot, an object, a fixture or a zone."""
_PLACES = ("robot", "object", "fixture", "zone")


def find(known: Mapping[str, Proposition], name: str) -> Proposition:
    """The proposition of a name.

    Raises:
        ConfigError: if there is none.
    """
    if name not in known:
        hint = did_you_mean(name, known, "safemanip propositions")
        raise ConfigError(f"unknown proposition {name!r}; {hint}")
    return known[name]


def check_call(
    proposition: Proposition, arguments: tuple[str, ...], scene: Scene, zones: Collection[str]
) -> None:
    """Refuse arguments that a proposition cannot have, and scenes that it cannot be told of.

    Args:
        proposition: what is called.
        arguments: of the call, with what it sets.
        scene: the static part of the trace.
        zones: named regions of the binding.

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
        if kind != "skill" and value not in scene.entity and value not in zones:
            raise TraceError(f"{proposition.name}: unknown entity {value!r}")
        kinds = alternatives(kind)
        if kind in _UNCHECKED or any(_is(one, value, scene, zones) for one in kinds):
            continue
        if kind == "object":
            raise TraceError(f"{proposition.name}: {value!r} is no movable object of the scene")
        said = kind.replace(PLACE, f"{', '.join(_PLACES[:-1])} or {_PLACES[-1]}")
        raise TraceError(f"{proposition.name}: {value!r} is no {said}")
    if lacking := proposition.run(proposition.lacks, arguments, scene):
        raise TraceError(
            f"{proposition.name}({', '.join(arguments)}) cannot be told: {lacking}; take the "
            "property out of the task, or the missing part into the scene"
        )


KINDS = ("object", "fixture", "entity", "tool", "skill", "robot", "appliance", "zone", "liquid")
"""Kinds of arguments. An ``appliance`` is a fixture with a switch."""
_UNCHECKED = ("skill", "entity", "fixture", "tool")
"""Kinds of which propositions say themselves, with ``lacks``, what they need."""


def check_definition(proposition: Proposition) -> None:
    """Refuse kinds of arguments that do not exist.

    Raises:
        ConfigError: naming the proposition, its file and line, and what exists.
    """
    about = f"{proposition.place}: proposition {proposition.name!r}"
    kinds: object = proposition.arguments
    if isinstance(kinds, str) or not isinstance(kinds, tuple):
        meant = f"({kinds!r},)" if isinstance(kinds, str) else "('object',)"
        raise ConfigError(f"{about}: arguments: expected a tuple as {meant}, found {kinds!r}")
    for kind in kinds:
        for one in alternatives(kind) if isinstance(kind, str) else (repr(kind),):
            if one not in (*KINDS, PLACE):
                hint = did_you_mean(one, (*KINDS, PLACE))
                known = "" if hint.startswith("known") else f" known: {', '.join((*KINDS, PLACE))}"
                raise ConfigError(f"{about}: unknown kind of argument {one!r}; {hint}{known}")


def alternatives(kind: str) -> tuple[str, ...]:
    """The kinds that an argument of a kind may be of: ``object or fixture``."""
    return _PLACES if kind == PLACE else tuple(kind.split(" or "))


def _is(kind: str, value: str, scene: Scene, zones: Collection[str]) -> bool:
    """Whether something is of one kind."""
    match kind:
        case "robot":
            return value == ROBOT
        case "object":
            return value in scene.object_index
        case "appliance":
            return any(switch.entity == value for switch in scene.switches)
        case "liquid":
            return value in scene.particles
        case "zone":
            return value in zones
    return value in scene.entity and scene.entity[value].kind == kind


def solid(scene: Scene, *arguments: str) -> str:
    """Which argument fills no space, if so."""
    for name in arguments:
        if name == ROBOT and not scene.grippers:
            return "the scene has no gripper"
        is_fixture = name in scene.entity and scene.entity[name].kind == "fixture"
        if is_fixture and name not in scene.solid.entities:
            return f"{name!r} has no solid piece"
    return ""


def carried(scene: Scene, name: str, other: str) -> str:
    """What carrying an object over something needs and does not find, if so."""
    return gripper(scene) or solid(scene, other)


def liquid(scene: Scene, *_: str) -> str:
    """That there is no liquid, if so."""
    return "" if scene.liquids else "no liquid is simulated in the scene"


def camera(scene: Scene, *_: str) -> str:
    """That there is no camera, if so."""
    return "" if scene.cameras else "the scene has no camera"


def heat(scene: Scene, *_: str) -> str:
    """That nothing tells what a burner heats, if so."""
    return _burners(scene, scene.switches)


def precondition(scene: Scene, skill: str, entity: str) -> str:
    """That a skill turns burners of which nothing tells what they heat, if so."""
    if skill != "turn":
        return ""
    return _burners(scene, (s for s in scene.switches if s.entity == entity and s.joint))


def _burners(scene: Scene, switches: Iterable[Switch]) -> str:
    """That nothing tells what the burner of one of some switches heats, if so."""
    for switch in switches:
        told = [scene.boxes[box].name for box in scene.boxes_of(switch.entity, "burner")]
        if switch.kind == "burner" and switch.name not in told:
            return f"nothing tells what the burner {switch.name!r} of {switch.entity!r} heats"
    return ""


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
    return door(scene, entity) if name in OF_DOORS else gripper(scene)
