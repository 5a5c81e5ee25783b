"""What propositions are expected to do next, from motion, geometry and commands.

A margin says how far a proposition is from its threshold, and its rate when that is reached. What
has no margin, or one that comes too late to act on, has a forecast here: a hand that is told to
open lets go, what moves towards something will touch it.
"""

from __future__ import annotations

from collections.abc import Mapping

from pytest_safemanip.propositions.forecasts.letting_go import (
    grasped_in,
    onset_in,
    released_in,
    settled_in,
    unsafe_in,
    unstable_in,
)
from pytest_safemanip.propositions.forecasts.motion import Forecast, Told
from pytest_safemanip.propositions.forecasts.reaching import reach_in
from pytest_safemanip.propositions.forecasts.touching import bad_contact_in, collision_in

__all__ = ["FORECASTS", "Forecast", "Told"]

FORECASTS: Mapping[str, Forecast] = {
    "bad_contact": bad_contact_in,
    "collision": collision_in,
    "obj_grasped": grasped_in,
    "obj_released": released_in,
    "pre_safe": unsafe_in,
    "reach_in": reach_in,
    "settled": settled_in,
    "skill_onset": onset_in,
    "stable_grasp": unstable_in,
}
"""By proposition."""
