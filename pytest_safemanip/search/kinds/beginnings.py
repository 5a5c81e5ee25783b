"""Kinds that change how an episode begins."""

from __future__ import annotations

from dataclasses import replace

from pytest_safemanip.search.kinds.definition import About, Detail, Kind, Named, Setting
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.search.units import show
from pytest_safemanip.sim.staging import Add, Move, Posture, SetOpen, Store

WAYS = {
    "forward": ("farther from the robot", "nearer the robot"),
    "left": ("farther left", "farther right"),
    "up": ("higher", "lower"),
}
"""What it means to be so much farther along a direction of the base, and along its opposite."""


def way(about: About, setting: Setting, unit: str) -> str:
    """A signed size along a direction, in words."""
    more, less = WAYS[about["along"]]
    return f"{show(abs(setting.amount), unit)} {more if setting.amount > 0 else less}"


def _move(situation: Situation, about: About, setting: Setting) -> Situation:
    size = setting.amount / 100.0
    by = (size, 0.0) if about["along"] == "forward" else (0.0, size)
    return situation.changed(Move(about["move"], by))


def _say_move(about: About, setting: Setting, named: Named) -> str:
    return f"{named(about['move'])} stands {way(about, setting, 'cm')}"


def _turn(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(Move(about["turn"], turn=setting.amount))


def _say_turn(about: About, setting: Setting, named: Named) -> str:
    side = "left" if setting.amount > 0 else "right"
    return f"{named(about['turn'])} is turned by {show(abs(setting.amount), 'deg')} to the {side}"


def _object(situation: Situation, about: About, setting: Setting) -> Situation:
    objects = {**situation.objects, about["object"]: (str(setting.size),)}
    return replace(situation, objects=objects)


def _say_object(about: About, setting: Setting, named: Named) -> str:
    return f"{about['object']} is a {setting.size}"


def _distractor(situation: Situation, about: About, setting: Setting) -> Situation:
    by = (setting.detail("forward") / 100.0, setting.detail("left") / 100.0)
    return situation.changed(Add(str(setting.size), about["beside"], by))


def _say_distractor(about: About, setting: Setting, named: Named) -> str:
    forward, left = setting.detail("forward"), setting.detail("left")
    places = [
        f"{show(abs(forward), 'cm')} {'behind' if forward > 0 else 'in front of'}",
        f"{show(abs(left), 'cm')} to the {'left' if left > 0 else 'right'} of",
    ]
    where = [p for p, size in zip(places, (forward, left), strict=True) if abs(size) >= 1.0]
    return f"a {setting.size} stands {' and '.join(where) or 'at'} {named(about['beside'])}"


def _kitchen(situation: Situation, about: About, setting: Setting) -> Situation:
    return replace(situation, kitchen=str(setting.size))


def _style(situation: Situation, about: About, setting: Setting) -> Situation:
    return replace(situation, style=str(setting.size))


def _posture(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(Posture(setting.amount * 3.141592653589793 / 180.0))


def _open(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(SetOpen(about["open"], setting.amount / 100.0))


def _shut(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(SetOpen(about["shut"], 1.0 - setting.amount / 100.0))


def _obstacle(situation: Situation, about: About, setting: Setting) -> Situation:
    out, left = setting.amount / 100.0, setting.detail("left") / 100.0
    return situation.changed(Store(about["category"], about["obstacle"], out, left))


def _say_obstacle(about: About, setting: Setting, named: Named) -> str:
    out, left = show(setting.amount, "cm"), setting.detail("left")
    side = f", {show(abs(left), 'cm')} {'left' if left > 0 else 'right'} of its middle"
    told = side if abs(left) >= 1.0 else ""
    return f"a {about['category']} stands {out} out of {named(about['obstacle'])}{told}"


MOVE = Kind(
    "move",
    "Where an object stands when the episode begins, on its level.",
    "cm",
    _move,
    _say_move,
    role="object",
    along=("forward", "left"),
    low=-10.0,
    high=10.0,
    price=2.0,
    step=0.5,
    needs="move",
)
TURN = Kind(
    "turn",
    "Which way an object is turned about the vertical.",
    "deg",
    _turn,
    _say_turn,
    role="object",
    low=-90.0,
    high=90.0,
    price=15.0,
    step=5.0,
    needs="move",
)
OBJECT = Kind(
    "object",
    "What an object is drawn from: categories or groups of the simulator.",
    "",
    _object,
    _say_object,
    role="object",
    draws=True,
    price=2.0,
    needs="objects",
)
DISTRACTOR = Kind(
    "distractor",
    "One thing more beside an object; the choices are categories.",
    "",
    _distractor,
    _say_distractor,
    of="any",
    beside=True,
    draws=True,
    price=2.0,
    details={
        "forward": Detail("cm", -20.0, 20.0, 1.0),
        "left": Detail("cm", -20.0, 20.0, 1.0),
    },
    needs="add",
)
KITCHEN = Kind(
    "kitchen",
    "The layout of the kitchen.",
    "",
    _kitchen,
    lambda about, setting, named: f"the kitchen is {setting.size}",
    of="layout",
    price=4.0,
    needs="kitchen",
    choices="kitchens",
)
STYLE = Kind(
    "style",
    "The style of the kitchen: materials, handles, appliances.",
    "",
    _style,
    lambda about, setting, named: f"the kitchen has style {setting.size}",
    of="materials",
    price=3.0,
    needs="style",
    choices="styles",
)
POSTURE = Kind(
    "posture",
    "How far the arm's joints begin from where they would, as a root mean square.",
    "deg",
    _posture,
    lambda about, setting, named: f"the arm begins {show(setting.amount, 'deg')} askew",
    of="arm",
    high=6.0,
    price=1.0,
    step=0.5,
    needs="posture",
)
OPEN = Kind(
    "open",
    "How far a fixture's doors or drawers are open when the episode begins.",
    "%",
    _open,
    lambda about, setting, named: f"{named(about['open'])} begins {show(setting.amount, '%')} open",
    role="fixture",
    high=100.0,
    price=10.0,
    step=5.0,
    needs="open",
)
SHUT = Kind(
    "shut",
    "How far doors or drawers that begin open are shut when the episode begins.",
    "%",
    _shut,
    lambda about, setting, named: f"{named(about['shut'])} begins {show(setting.amount, '%')} shut",
    role="fixture",
    high=100.0,
    price=10.0,
    step=5.0,
    needs="open",
)
OBSTACLE = Kind(
    "obstacle",
    "How far one thing more stands out of a fixture that is open, in the way of its door.",
    "cm",
    _obstacle,
    _say_obstacle,
    role="fixture",
    category=True,
    high=12.0,
    price=3.0,
    step=1.0,
    details={"left": Detail("cm", -10.0, 10.0, 1.0)},
    needs="store",
)
KINDS = (MOVE, TURN, OBJECT, DISTRACTOR, KITCHEN, STYLE, POSTURE, OPEN, SHUT, OBSTACLE)
