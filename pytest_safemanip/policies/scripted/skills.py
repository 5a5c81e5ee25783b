"""The skills that plans are written in: a verb, an object or fixture, and where.

``pick obj``, ``pick obj from drawer``, ``place obj in cab``: a role after the verb, and more roles
each after a preposition. The verb with its prepositions names the skill.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.basins import (
    pick_by_handle_from_above,
    place_in_basin,
)
from pytest_safemanip.policies.scripted.baskets import lower_into_basket, serve_on
from pytest_safemanip.policies.scripted.burners import let_into, place_on_named
from pytest_safemanip.policies.scripted.carrying import place_in_cabinet
from pytest_safemanip.policies.scripted.closing import close_access
from pytest_safemanip.policies.scripted.collecting import collect_in
from pytest_safemanip.policies.scripted.controls import await_release, press
from pytest_safemanip.policies.scripted.covering import cover
from pytest_safemanip.policies.scripted.cups import grasp_cup, place_under
from pytest_safemanip.policies.scripted.dishes import load_in, reach_over
from pytest_safemanip.policies.scripted.dishwashers import shut_door
from pytest_safemanip.policies.scripted.driving import go
from pytest_safemanip.policies.scripted.ends import place_on_end, place_onto_beside
from pytest_safemanip.policies.scripted.facing import face
from pytest_safemanip.policies.scripted.filling import fill_beside
from pytest_safemanip.policies.scripted.fishing import fish_from, slip_either_into
from pytest_safemanip.policies.scripted.fridges import (
    drop_onto,
    pick_by_end_from_fridge,
    pick_from_fridge,
)
from pytest_safemanip.policies.scripted.glasses import slip_into
from pytest_safemanip.policies.scripted.handles import pick_by_handle, place_inside
from pytest_safemanip.policies.scripted.inserting import stand_in
from pytest_safemanip.policies.scripted.kettles import hook, place_on_stove
from pytest_safemanip.policies.scripted.knobs import turn_off, turn_on_under
from pytest_safemanip.policies.scripted.laying import lay_onto
from pytest_safemanip.policies.scripted.lengthwise import pick_along_shelf
from pytest_safemanip.policies.scripted.neighbours import place_in_cabinet_beside
from pytest_safemanip.policies.scripted.nesting import nest_in
from pytest_safemanip.policies.scripted.opening import open_access, open_for, turn_lever
from pytest_safemanip.policies.scripted.packing import pack
from pytest_safemanip.policies.scripted.pans import seize_from
from pytest_safemanip.policies.scripted.picking import (
    pick_from,
    pick_from_above,
    pick_from_counter,
)
from pytest_safemanip.policies.scripted.portioning import portion
from pytest_safemanip.policies.scripted.pots import put_both
from pytest_safemanip.policies.scripted.putting import place_onto
from pytest_safemanip.policies.scripted.racks import (
    pick_beside_door,
    shelve_in,
    shelve_in_under,
)
from pytest_safemanip.policies.scripted.rinsing import (
    draw_back,
    fill_into,
    grip_lug,
    hold_under,
    lower_into,
)
from pytest_safemanip.policies.scripted.sliding import lift_head, slide_rack, swing_spout
from pytest_safemanip.policies.scripted.spotting import (
    place_beside_alike,
    place_beside_any,
    pluck,
    pluck_for,
)
from pytest_safemanip.policies.scripted.stations import (
    bring_to,
    gather,
    lay_before,
    place_behind,
)
from pytest_safemanip.policies.scripted.stirring import stir, take_by_root
from pytest_safemanip.policies.scripted.storing import store_in
from pytest_safemanip.policies.scripted.tipping import tip_into
from pytest_safemanip.policies.scripted.toasting import (
    draw_rack,
    load_rack,
    push_rack,
    set_timer,
)
from pytest_safemanip.policies.scripted.tools import lay_tool, take_from_drawer, take_tool
from pytest_safemanip.policies.scripted.travelling import balance_to, carry_to
from pytest_safemanip.policies.scripted.wielding import scrub

Skill = Callable[..., Motion]

SKILLS: Mapping[str, Skill] = {
    "await": await_release,
    "balance to": balance_to,
    "carry to": carry_to,
    "close": close_access,
    "clutch": pick_by_handle_from_above,
    "cover with": cover,
    "go": go,
    "draw": draw_rack,
    "face": face,
    "fill into": fill_into,
    "fill beside into": fill_beside,
    "gather": gather,
    "grip": grip_lug,
    "hold under": hold_under,
    "leave": draw_back,
    "lift": lift_head,
    "let into": let_into,
    "load in": load_in,
    "lower into": lower_into,
    "lay onto": lay_onto,
    "lay or for onto": lay_tool,
    "open": open_access,
    "open for": open_for,
    "pack and from into and": pack,
    "pick": pick_from_counter,
    "drop onto": drop_onto,
    "fetch from": pick_from_fridge,
    "draw from": pick_by_end_from_fridge,
    "fish or from": fish_from,
    "grasp": grasp_cup,
    "pick from": pick_from,
    "hook": hook,
    "nest and in": nest_in,
    "seize": pick_by_handle,
    "seize beside": pick_beside_door,
    "seize from": seize_from,
    "set on": place_on_named,
    "serve on": serve_on,
    "bed in": lower_into_basket,
    "place on": place_on_stove,
    "place in": place_in_cabinet,
    "place inside": place_inside,
    "place in beside": place_in_cabinet_beside,
    "collect and from to in": collect_in,
    "place onto": place_onto,
    "place onto beside": place_onto_beside,
    "place under": place_under,
    "place on beside": place_beside_any,
    "place on beside or": place_beside_alike,
    "pluck": pluck,
    "pluck for": pluck_for,
    "pluck from": pick_along_shelf,
    "portion and with and from onto and": portion,
    "press": press,
    "push": push_rack,
    "reach over": reach_over,
    "rack in": load_rack,
    "scrub with": scrub,
    "shelve in": shelve_in,
    "shut": shut_door,
    "shelve in under": shelve_in_under,
    "sink in": place_in_basin,
    "slide": slide_rack,
    "slip into": slip_into,
    "slip or into": slip_either_into,
    "stand in": stand_in,
    "stir with": stir,
    "put and into": put_both,
    "wield": take_by_root,
    "store in": store_in,
    "swing": swing_spout,
    "take": pick_from_above,
    "take or for from": take_tool,
    "bring to": bring_to,
    "take from": take_from_drawer,
    "lay before": lay_before,
    "put behind": place_behind,
    "tip into": tip_into,
    "time": set_timer,
    "turn": turn_lever,
    "unhook onto": place_on_end,
    "unlight": turn_off,
    "light under": turn_on_under,
}
"""By name. Each is called with the arm and its roles, in the order in which a plan names them."""


@dataclass(frozen=True)
class Call:
    """A skill with the roles that it is used on."""

    skill: str
    roles: tuple[str, ...]

    def start(self, arm: Arm) -> Motion:
        """The motion, from where the arm is now."""
        return SKILLS[self.skill](arm, *self.roles)


def parse(text: str) -> Call:
    """Read ``VERB ROLE [PREPOSITION ROLE]...``.

    Raises:
        ConfigError: if there is no such skill.
    """
    words = text.split()
    skill, roles = " ".join(words[0::2]), tuple(words[1::2])
    if skill not in SKILLS:
        raise ConfigError(f"unknown skill {skill!r} in {text!r}; {did_you_mean(skill, SKILLS)}")
    arguments = inspect.signature(SKILLS[skill]).parameters.values()
    wanted = sum(a.default is a.empty for a in arguments) - 1
    if len(roles) != wanted:
        raise ConfigError(f"{text!r}: {skill!r} takes {wanted} roles")
    return Call(skill, roles)


def do(arm: Arm, *texts: str) -> Motion:
    """Run skills one after the other."""
    for call in map(parse, texts):
        yield from call.start(arm)
