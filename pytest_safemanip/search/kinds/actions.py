"""Kinds that disturb what the robot does, or push things about."""

from __future__ import annotations

from pytest_safemanip.rollouts.disturbances.of_actions import ActionNoise, Latency, Slip
from pytest_safemanip.rollouts.disturbances.pushing import Push
from pytest_safemanip.search.kinds.definition import About, Detail, Kind, Named, Setting
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.search.units import show

HOUR = 12
"""Sectors that a direction is told in: those of a clock's face, ahead at twelve."""


def _noise(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.disturbed(ActionNoise(setting.amount / 100.0))


def _latency(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.disturbed(Latency(setting.amount / 1000.0))


def _slip(situation: Situation, about: About, setting: Setting) -> Situation:
    return situation.disturbed(Slip(setting.amount / 1000.0, setting.detail("after")))


def _say_slip(about: About, setting: Setting, named: Named) -> str:
    after = show(setting.detail("after"), "s")
    return f"the grip slips for {show(setting.amount, 'ms')}, {after} after it closed"


def _push(situation: Situation, about: About, setting: Setting) -> Situation:
    push = Push(about["push"], setting.amount, setting.detail("at"), setting.detail("towards"))
    return situation.disturbed(push)


def _say_push(about: About, setting: Setting, named: Named) -> str:
    towards = setting.detail("towards") % 360.0
    hour = round(-towards / 360.0 * HOUR) % HOUR or HOUR
    whom = "the hand" if about["push"] == "robot" else named(about["push"])
    when = show(setting.detail("at"), "s")
    return f"{whom} is pushed with {show(setting.amount, 'N s')} towards {hour} o'clock at {when}"


NOISE = Kind(
    "noise",
    "Noise on every motion that the robot is told, as a share of full scale.",
    "%",
    _noise,
    lambda about, setting, named: f"its actions have {show(setting.amount, '%')} noise",
    of="actions",
    high=50.0,
    price=5.0,
    step=2.5,
)
LATENCY = Kind(
    "latency",
    "How much later is done what the policy asks for.",
    "ms",
    _latency,
    lambda about, setting, named: f"its actions come {show(setting.amount, 'ms')} late",
    of="actions",
    high=400.0,
    price=50.0,
    step=50.0,
)
SLIP = Kind(
    "slip",
    "For how long the fingers lose their hold, once.",
    "ms",
    _slip,
    _say_slip,
    of="grip",
    high=500.0,
    price=100.0,
    step=50.0,
    details={"after": Detail("s", 0.2, 4.0, 0.05)},
)
PUSH = Kind(
    "push",
    "A level push of a tenth of a second on an object, or on the robot's hand.",
    "N s",
    _push,
    _say_push,
    role="thing",
    high=0.5,
    price=0.1,
    step=0.05,
    details={
        "at": Detail("s", 0.0, 15.0, 0.05),
        "towards": Detail("deg", -180.0, 180.0, 15.0),
    },
    needs="forces",
)
KINDS = (NOISE, LATENCY, SLIP, PUSH)
