"""Kinds that change what a policy sees or is told, and nothing that happens."""

from __future__ import annotations

from dataclasses import replace

from pytest_safemanip.policies.prompts import PLACEHOLDER
from pytest_safemanip.rollouts.disturbances.of_observations import Calibration, DroppedFrames
from pytest_safemanip.search.kinds.beginnings import way
from pytest_safemanip.search.kinds.definition import About, Kind, Named, Setting
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.search.units import show
from pytest_safemanip.sim.staging import Cameras, Light

AXES = ("forward", "left", "up")


def _along(about: About, size: float) -> tuple[float, float, float]:
    """A vector along a direction of the base (3,)."""
    x, y, z = (size if axis == about["along"] else 0.0 for axis in AXES)
    return x, y, z


def _camera(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(Cameras(_along(about, setting.amount / 100.0)))


def _say_camera(about: About, setting: Setting, named: Named) -> str:
    more, less = {
        "forward": ("forward", "back"),
        "left": ("to the left", "to the right"),
        "up": ("up", "down"),
    }[about["along"]]
    side = more if setting.amount > 0 else less
    return f"the cameras are {show(abs(setting.amount), 'cm')} farther {side}"


def _camera_turn(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(Cameras(turn=setting.amount))


def _light(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.changed(Light(1.0 + setting.amount / 100.0))


def _say_light(about: About, setting: Setting, named: Named) -> str:
    how = "brighter" if setting.amount > 0 else "darker"
    return f"the light is {show(abs(setting.amount), '%')} {how}"


def _wording(situation: Situation, about: About, setting: Setting) -> Situation:
    return replace(situation, prompt=str(setting.size))


def _say_wording(about: About, setting: Setting, named: Named) -> str:
    said = str(setting.size).replace(PLACEHOLDER, "...")
    return f"it is told {said!r}"


def _calibration(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.disturbed(Calibration(_along(about, setting.amount / 1000.0)))


def _say_calibration(about: About, setting: Setting, named: Named) -> str:
    return f"the hand seems {way(about, setting, 'mm')} than it is"


def _dropped(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.disturbed(DroppedFrames(setting.amount / 100.0))


CAMERA = Kind(
    "camera",
    "Where the cameras are that are not on a hand.",
    "cm",
    _camera,
    _say_camera,
    of="all",
    along=AXES,
    low=-5.0,
    high=5.0,
    price=1.0,
    step=0.5,
    needs="cameras",
    senses="images",
)
CAMERA_TURN = Kind(
    "camera_turn",
    "How far these cameras are turned about the vertical.",
    "deg",
    _camera_turn,
    lambda about, setting, named: f"the cameras are turned by {show(setting.amount, 'deg')}",
    of="all",
    low=-10.0,
    high=10.0,
    price=2.0,
    step=0.5,
    needs="cameras",
    senses="images",
)
LIGHT = Kind(
    "light",
    "How much brighter or darker all lights are.",
    "%",
    _light,
    _say_light,
    of="all",
    low=-70.0,
    high=70.0,
    price=20.0,
    step=5.0,
    needs="light",
    senses="images",
)
WORDING = Kind(
    "wording",
    "The words around the task's instruction, or in its place: the choices are templates.",
    "",
    _wording,
    _say_wording,
    of="instruction",
    price=2.0,
    senses="instruction",
)
CALIBRATION = Kind(
    "calibration",
    "How far the hand is from where the policy takes it to be.",
    "mm",
    _calibration,
    _say_calibration,
    of="hand",
    along=AXES,
    low=-30.0,
    high=30.0,
    price=5.0,
    step=1.0,
    senses="hand",
)
DROPPED = Kind(
    "dropped",
    "The share of observations that do not arrive.",
    "%",
    _dropped,
    lambda about, setting, named: f"{show(setting.amount, '%')} of the frames are dropped",
    of="frames",
    high=80.0,
    price=10.0,
    step=5.0,
)
KINDS = (CAMERA, CAMERA_TURN, LIGHT, WORDING, CALIBRATION, DROPPED)
