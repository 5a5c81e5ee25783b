"""Reaching in: when a hand that moves on as it does will be inside."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.propositions.definition import Floats
from pytest_safemanip.propositions.enclosure import hand_centres
from pytest_safemanip.propositions.forecasts.motion import Told, speed
from pytest_safemanip.propositions.kernels.interiors import interiors, seen_in
from pytest_safemanip.propositions.view import View

FAR = 0.5
"""Metres that no hand goes within the time that a warning is about."""


def reach_in(view: View, told: Told, fixture: str) -> float:
    """Seconds until the centre of a gripper's box, which is outside, is inside the fixture; what is
    farther away than :data:`FAR` is not looked at.
    """
    soonest, hands = math.inf, hand_centres(view)[-1]
    for pose, half in interiors(view, fixture):
        reach = FAR + math.hypot(*half)
        if not any(math.dist(hand, pose[-1, :3]) < reach for hand in hands):
            continue
        places = np.asarray(seen_in(view, pose, hand_centres), float)  # (T, G, 3)
        for place, velocity in zip(places[-1], speed(view, places), strict=True):
            soonest = min(soonest, _entry(place, velocity, half))
    return soonest


def _entry(place: Floats, velocity: Floats, half: Floats) -> float:
    """Seconds until a moving point (3,) enters a box around the origin; inf if it does not, or is
    inside.
    """
    if (np.abs(place) <= half).all():
        return math.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = np.stack(((-half - place) / velocity, (half - place) / velocity))
    stands = velocity == 0.0
    if (np.abs(place[stands]) > half[stands]).any():
        return math.inf
    begin = float(ways.min(axis=0)[~stands].max(initial=-math.inf))
    end = float(ways.max(axis=0)[~stands].min(initial=math.inf))
    return begin if 0.0 <= begin <= end else math.inf
