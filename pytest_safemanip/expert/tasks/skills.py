"""The skills that plans are written in, by name: a verb, with places and ways of doing it.

The name is the text of a call without its roles (:mod:`~pytest_safemanip.expert.tasks.calls`).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.expert.motions.navigation import drive_to
from pytest_safemanip.expert.motions.operating import (
    close_all,
    lift_head,
    open_all,
    open_before,
    press,
    slide_rack,
    swing_spout,
    turn_lever,
    turn_off_burners,
    turn_on_burner_under,
    turn_timer,
    wait_for_release,
)
from pytest_safemanip.expert.robot.arm import Motion
from pytest_safemanip.expert.tasks.calls import Call, read
from pytest_safemanip.expert.tasks.covering import cover
from pytest_safemanip.expert.tasks.cutting import grasp_tool, place_tool
from pytest_safemanip.expert.tasks.handling import (
    GOALS,
    grasping,
    lay,
    place_alike,
    placing,
    turn_by_handle,
)
from pytest_safemanip.expert.tasks.inserting import insert
from pytest_safemanip.expert.tasks.rinsing import rinse
from pytest_safemanip.expert.tasks.scrubbing import scrub
from pytest_safemanip.expert.tasks.stirring import stir
from pytest_safemanip.expert.tasks.tipping import pour
from pytest_safemanip.expert.tasks.toaster_oven import close_rack, open_rack

Skill = Callable[..., Motion]

SKILLS: Mapping[str, Skill] = MappingProxyType(
    {
        "close": close_all,
        "close rack of": close_rack,
        "cover with": cover,
        "drive to": drive_to,
        "grasp": grasping(),
        "grasp by bow": grasping("bow"),
        "grasp by end": grasping("end"),
        "grasp by lug": grasping("lug"),
        "grasp or for": grasp_tool,
        "insert into": insert,
        "lay on": lay,
        "open": open_all,
        "open for": open_before,
        "open head of": lift_head,
        "open rack of": open_rack,
        **{name: placing(name) for name in GOALS},
        "place on beside or": place_alike,
        "place or for on": place_tool,
        "pour into": pour,
        "press": press,
        "rinse under tap of": rinse,
        "scrub with": scrub,
        "slide rack of": slide_rack,
        "stir with": stir,
        "turn by handle": turn_by_handle,
        "turn spout of": swing_spout,
        "turn timer of": turn_timer,
        "turn_off": turn_off_burners,
        "turn_on": turn_lever,
        "turn_on burner of under": turn_on_burner_under,
        "wait for": wait_for_release,
    }
)
"""Each is called with the arm and its roles, in the order in which a call names them."""


HELD: Mapping[str, int] = MappingProxyType(
    {
        **dict.fromkeys((*GOALS, "place on beside or", "place or for on"), 0),
        **dict.fromkeys(("insert into", "lay on", "pour into", "rinse under tap of"), 0),
        **dict.fromkeys(("scrub with", "stir with"), 1),
    }
)
"""Which of a skill's roles is in the hand when it begins, by name."""
SYNONYMS = {"pick": "grasp", "put": "place", "push": "slide", "shut": "close"}
"""Of skills' verbs, for the hint in an error."""


def parse(text: str) -> Call:
    """The call of a skill that a text means.

    Raises:
        ConfigError: if there is no such skill.
    """
    call = read(text)
    skill, verb = call.skill, call.skill.partition(" ")[0]
    if skill not in SKILLS:
        verbs = {known.partition(" ")[0] for known in SKILLS}
        alike = [known for known in SKILLS if verb in verbs and known.startswith(verb)]
        if not alike:
            hint = did_you_mean(SYNONYMS.get(verb, verb), verbs)
        elif skill == verb:  # "turn off" is as near to "turn_on" as to "turn_off"
            hint = f"known: {', '.join(alike)}"
        else:
            hint = did_you_mean(skill, alike)
        raise ConfigError(f"unknown skill {skill!r} in {text!r}; {hint}")
    arguments = inspect.signature(SKILLS[skill]).parameters.values()
    wanted = sum(a.default is a.empty for a in arguments) - 1
    if len(call.roles) != wanted:
        roles = "1 role" if wanted == 1 else f"{wanted} roles"
        raise ConfigError(f"{text!r}: {skill!r} takes {roles}, not {len(call.roles)}")
    return call
