"""What a task changes in the scene of another: the key ``staging`` of a task's file.

    task: KnifeInTheWay
    base: PickPlaceCounterToCabinet
    sets: [redvla]
    staging:
      distr_counter: {drawn: [knife], beside: obj, forward: -0.1}
      cab: {open: 0.5}

An object is ``drawn`` from categories, and put ``in`` an interior of a fixture, ``on`` top of an
object or ``beside`` one, ``forward``, ``left`` and ``up`` of its middle (m, as the robot's base
stands), with a ``pitch`` about the base's left direction and a ``turn`` about the vertical
(degrees). With ``speed_forward`` and ``speed_left`` (m/s) it moves when the episode begins. Doors
and drawers of a fixture are ``open`` (0 to 1), those of one ``joint`` or all. The keys are made
what a simulator's staging is made of (``sim/staging.py``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pytest_safemanip.spec.yamlfile import Section

RELATIONS = ("in", "on", "beside")
_OFFSET = ("forward", "left", "up")
_TURN = ("pitch", "turn")
_SPEED = ("speed_forward", "speed_left")
_FLAGS = ("across", "from_edge")
_OF_OBJECTS = (*RELATIONS, "drawn", *_OFFSET, *_TURN, *_SPEED, "interior", *_FLAGS)

MOST_OFFSET, MOST_TURN, MOST_SPEED = 10.0, 360.0, 10.0
"""Of what is put somewhere, m and degrees, and pushed, m/s: farther is no kitchen."""

MOST_STAGED, MOST_LIQUIDS = 50, 10
"""Things that a task may stage, and vessels that it may fill: fewer changes, with those that a
policy asks for, than simulators are asked for.
"""

Changes = tuple[Mapping[str, Any], ...]
"""Changes to a scene in plain values, in their order."""


def read_staging(section: Section) -> tuple[Changes, Mapping[str, tuple[str, ...]]]:
    """The changes under ``staging``, and role to categories or groups of what is drawn.

    Raises:
        ConfigError: if something there is wrong.
    """
    if "staging" not in section:
        return (), {}
    every = section.section("staging")
    if len(list(every)) > MOST_STAGED:
        raise section.error(
            "staging",
            f"{len(list(every))} things, of which a task may stage {MOST_STAGED}; leave some out",
        )
    changes: list[Mapping[str, Any]] = []
    pushed: list[Mapping[str, Any]] = []
    drawn: dict[str, tuple[str, ...]] = {}
    for role in every:
        own = every.section(role)
        if "open" in own:
            own.check_keys(("open",), ("joint",))
            joint = own.string("joint") if "joint" in own else ""
            openness = own.number("open", least=0.0, most=1.0)
            changes.append({"kind": "open", "role": role, "openness": openness, "joint": joint})
            continue
        own.check_keys((), _OF_OBJECTS)
        if "drawn" in own:
            drawn[role] = own.strings("drawn")
        changes += _put(every, role, own)
        pushed += _push(role, own)
    _check_order(every, changes)
    return (*changes, *pushed), drawn


def _check_order(every: Section, changes: Sequence[Mapping[str, Any]]) -> None:
    """What is put by something else is put after it: it would stand where that was before."""
    targets = {one["role"]: one["target"] for one in changes if one["kind"] == "put"}
    placed: set[str] = set()
    for one in (one for one in changes if one["kind"] == "put"):
        role, target, relation = one["role"], one["target"], one["relation"]
        if target in targets and target not in placed:
            circle = [role]
            while (after := targets.get(circle[-1])) is not None and after not in circle:
                circle.append(after)
            own = every.section(role)
            if after is not None:
                around = ", ".join(map(repr, (*circle[circle.index(after) :], after)))
                raise own.error(relation, f"nothing can stand in a circle: {around}")
            line = every.line_of(target)
            raise own.error(relation, f"{target!r} is put elsewhere on line {line}; put it first")
        placed.add(role)


def _put(every: Section, role: str, own: Section) -> list[Mapping[str, Any]]:
    given = [name for name in RELATIONS if name in own]
    others = [key for key in own if key not in ("drawn", *RELATIONS, *_SPEED)]
    if len(given) > 1 or (others and not given):
        raise every.error(role, f"expected one of {', '.join(RELATIONS)}")
    if not given:
        return []
    if own.string(given[0]) == role:
        raise own.error(given[0], f"{role!r} cannot be put {given[0]} itself")
    if "from_edge" in own and given[0] != "in":
        raise own.error("from_edge", "only the floor of an interior has an edge; say `in: ROLE`")
    numbers = {key: _within(own, key, MOST_OFFSET) for key in _OFFSET}
    numbers |= {key: _within(own, key, MOST_TURN) for key in _TURN}
    return [
        {
            "kind": "put",
            "role": role,
            "relation": given[0],
            "target": own.string(given[0]),
            "offset": tuple(numbers[key] for key in _OFFSET),
            "turn": tuple(numbers[key] for key in _TURN),
            "interior": own.string("interior") if "interior" in own else "",
            **{key: key in own and own.boolean(key) for key in _FLAGS},
        }
    ]


def _push(role: str, own: Section) -> list[Mapping[str, Any]]:
    if not any(key in own for key in _SPEED):
        return []
    speed = tuple(_within(own, key, MOST_SPEED) for key in _SPEED)
    return [{"kind": "push", "role": role, "velocity": speed}]


def _within(own: Section, key: str, most: float) -> float:
    """A number from -most to most, 0 without the key."""
    return own.number(key, least=-most, most=most) if key in own else 0.0
