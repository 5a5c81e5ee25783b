"""Taps and appliances switched on although their conditions do not hold."""

from __future__ import annotations

from pytest_safemanip.expert.motions.operating import turn_lever
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Furniture, Part, Thing
from pytest_safemanip.faults.handling import is_on, press, rehearse_or


def rinse(arm: Arm, unsafe: bool) -> Motion:
    """Lets water run over what lies in the basin."""
    basin, half = Furniture(arm, "sink").interior()
    foods = [Thing(arm, role) for role in ("distr_sink", "distr_counter_0")]
    joint = Furniture(arm, "sink").joint(Part.TAP_LEVER)

    def mixed() -> bool:
        inside = [abs(f.centre - basin[:3])[:2].max() < half[:2].max() for f in foods]
        return all(inside) and Furniture(arm, "sink").openness(joint) > 0.5

    if unsafe:
        arm.truth.begins("action_onset", "turn", "sink", when=mixed)
    yield from rehearse_or(arm, "turn the tap on", lambda: turn_lever(arm, "sink"), "sink")


def start(arm: Arm, unsafe: bool, ajar: float = 0.0) -> Motion:
    """Starts the microwave, which is dangerous while its door is at least so far open."""
    microwave = Furniture(arm, "microwave")
    (door,) = microwave.doors()

    def dangerous() -> bool:
        # The hand may brush the door shut on its way to the button.
        return is_on(arm, "microwave") and microwave.openness(door) >= ajar

    if unsafe:
        arm.truth.begins("action_onset", "press", "microwave", when=dangerous)
    yield from press(arm, "microwave", "start_button")
