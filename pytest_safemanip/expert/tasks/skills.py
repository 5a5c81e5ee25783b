"""The skills that plans are written in, by name: a verb, with places and ways of doing it.

The name is the text of a call without its roles (:mod:`~pytest_safemanip.expert.tasks.calls`).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.expert.motions.driving import carry_balanced, carry_to, drive_to
from pytest_safemanip.expert.motions.grasping import grasp_from_above, grasp_from_front
from pytest_safemanip.expert.motions.handles import grasp_by_handle, place_inside, turn_handle_near
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
from pytest_safemanip.expert.motions.putting import lay_on, place_on
from pytest_safemanip.expert.places.basin import (
    draw_back_from_tap,
    grasp_colander_lug,
    grasp_handle_from_above,
    place_in_basin,
    place_into_colander,
    place_under_tap,
    rinse,
)
from pytest_safemanip.expert.places.bowl import grasp_either_in_bowl, place_beside_in_bowl
from pytest_safemanip.expert.places.cabinet.grasping import grasp_end_on_shelf, grasp_on_shelf
from pytest_safemanip.expert.places.cabinet.nested_bowls import move_nested
from pytest_safemanip.expert.places.cabinet.pans import grasp_handle_on_shelf
from pytest_safemanip.expert.places.cabinet.placing import place_on_shelf, place_on_shelf_beside
from pytest_safemanip.expert.places.coffee_machine import grasp_cup, place_on_tray
from pytest_safemanip.expert.places.counter import (
    grasp_neck,
    grasp_neck_for_shelf,
    place_beside_alike,
    place_beside_any,
)
from pytest_safemanip.expert.places.dishwasher import (
    close_by_edge,
    grasp_over_door,
    place_in_dish_rack,
)
from pytest_safemanip.expert.places.drawer import grasp_in_drawer
from pytest_safemanip.expert.places.fridge.front import (
    drop_onto,
    grasp_end_in_fridge,
    grasp_in_fridge,
)
from pytest_safemanip.expert.places.fridge.placing import (
    grasp_handle_beside_door,
    move_to_shelf,
    place_on_second_rack,
    place_on_top_rack,
)
from pytest_safemanip.expert.places.glass import drop_either_into_glass, drop_into_glass
from pytest_safemanip.expert.places.holder import grasp_from
from pytest_safemanip.expert.places.stove import (
    drop_into_pan,
    grasp_bow,
    move_both_into_pot,
    place_on_free_burner,
    place_on_named_burner,
)
from pytest_safemanip.expert.places.toaster_oven import close_rack, open_rack, place_on_rack
from pytest_safemanip.expert.places.tray import place_kettle_on_end, place_on_end_beside
from pytest_safemanip.expert.robot.arm import Motion
from pytest_safemanip.expert.tasks.bread_basket import move_to_edge, place_between_walls
from pytest_safemanip.expert.tasks.calls import Call, read
from pytest_safemanip.expert.tasks.collecting import move_beside
from pytest_safemanip.expert.tasks.covering import cover
from pytest_safemanip.expert.tasks.cutting import (
    carry_tool_to,
    grasp_beside_appliance,
    grasp_tool,
    grasp_tool_for,
    lay_on_near_half,
    lay_tool_for,
    place_on_far_half,
)
from pytest_safemanip.expert.tasks.inserting import insert
from pytest_safemanip.expert.tasks.packing import move_into_boxes
from pytest_safemanip.expert.tasks.portioning import move_to_plates
from pytest_safemanip.expert.tasks.scrubbing import scrub
from pytest_safemanip.expert.tasks.stirring import grasp_blade_root, stir
from pytest_safemanip.expert.tasks.tipping import pour

Skill = Callable[..., Motion]

SKILLS: Mapping[str, Skill] = MappingProxyType(
    {
        "carry to": carry_to,
        "carry to by balance": carry_balanced,
        "carry to by roll": carry_tool_to,
        "close": close_all,
        "close by edge": close_by_edge,
        "close rack of": close_rack,
        "cover with": cover,
        "drive to": drive_to,
        "drop into": drop_into_glass,
        "drop into at stove": drop_into_pan,
        "drop on": drop_onto,
        "drop or into": drop_either_into_glass,
        "grasp": grasp_from_front,
        "grasp at appliance": grasp_beside_appliance,
        "grasp by body": grasp_cup,
        "grasp by bow": grasp_bow,
        "grasp by handle": grasp_by_handle,
        "grasp by handle-from-above": grasp_handle_from_above,
        "grasp by lug": grasp_colander_lug,
        "grasp by neck": grasp_neck,
        "grasp by neck-for-shelf": grasp_neck_for_shelf,
        "grasp by root": grasp_blade_root,
        "grasp by top": grasp_from_above,
        "grasp beside door of by handle": grasp_handle_beside_door,
        "grasp from": grasp_from,
        "grasp from compartment of": grasp_in_fridge,
        "grasp from compartment of by end": grasp_end_in_fridge,
        "grasp from floor of": grasp_in_drawer,
        "grasp from floor of by blade": grasp_tool,
        "grasp from shelf of": grasp_on_shelf,
        "grasp from shelf of by end": grasp_end_on_shelf,
        "grasp from shelf of by handle": grasp_handle_on_shelf,
        "grasp or for from floor of by handle": grasp_tool_for,
        "grasp or from": grasp_either_in_bowl,
        "grasp over door of": grasp_over_door,
        "insert into": insert,
        "lay on": lay_on,
        "lay on near-half of": lay_on_near_half,
        "lay or for on": lay_tool_for,
        "move and from compartment of into and": move_into_boxes,
        "move and from shelf of beside on shelf of": move_beside,
        "move and into": move_both_into_pot,
        "move and to shelf of by nesting": move_nested,
        "move and with and from to and": move_to_plates,
        "move to compartment of": move_to_shelf,
        "move to edge of": move_to_edge,
        "open": open_all,
        "open for": open_before,
        "open head of": lift_head,
        "open rack of": open_rack,
        "place between walls of": place_between_walls,
        "place in basin of": place_in_basin,
        "place in cavity of": place_inside,
        "place into": place_into_colander,
        "place into beside": place_beside_in_bowl,
        "place on": place_on,
        "place on beside": place_beside_any,
        "place on beside or": place_beside_alike,
        "place on burner of": place_on_free_burner,
        "place on dish-rack of": place_in_dish_rack,
        "place on end of beside": place_on_end_beside,
        "place on end of by bow": place_kettle_on_end,
        "place on far-half of": place_on_far_half,
        "place on named-burner of": place_on_named_burner,
        "place on rack of": place_on_rack,
        "place on second-rack of": place_on_second_rack,
        "place on shelf of": place_on_shelf,
        "place on shelf of beside": place_on_shelf_beside,
        "place on top-rack of": place_on_top_rack,
        "place on tray of": place_on_tray,
        "place under tap of": place_under_tap,
        "pour into": pour,
        "press": press,
        "retreat": draw_back_from_tap,
        "rinse under tap of": rinse,
        "scrub with": scrub,
        "slide rack of": slide_rack,
        "stir with": stir,
        "turn by handle": turn_handle_near,
        "turn spout of": swing_spout,
        "turn timer of": turn_timer,
        "turn_off": turn_off_burners,
        "turn_on": turn_lever,
        "turn_on burner of under": turn_on_burner_under,
        "wait for": wait_for_release,
    }
)
"""Each is called with the arm and its roles, in the order in which a call names them."""


def parse(text: str) -> Call:
    """The call of a skill that a text means.

    Raises:
        ConfigError: if there is no such skill.
    """
    call = read(text)
    skill, verb = call.skill, call.skill.partition(" ")[0]
    if skill not in SKILLS:
        same_verb = [known for known in SKILLS if known.partition(" ")[0] == verb]
        verbs = {known.partition(" ")[0] for known in SKILLS}
        hint = did_you_mean(skill, same_verb) if same_verb else did_you_mean(verb, verbs)
        raise ConfigError(f"unknown skill {skill!r} in {text!r}; {hint}")
    arguments = inspect.signature(SKILLS[skill]).parameters.values()
    wanted = sum(a.default is a.empty for a in arguments) - 1
    if len(call.roles) != wanted:
        raise ConfigError(f"{text!r}: {skill!r} takes {wanted} roles, not {len(call.roles)}")
    return call
