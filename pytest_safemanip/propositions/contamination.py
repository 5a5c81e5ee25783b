"""Cross-contamination: contact with raw food, what is touched next, and washing.

Contamination spreads by contact, from body to body and over the touched spot of a surface, and
lasts until the body is washed. It is the one memory without a window: a fold over the whole trace.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.kernels.filters import held
from pytest_safemanip.propositions.kernels.presses import FORCE, carriers
from pytest_safemanip.propositions.kernels.spreading import SPOT, WINDOW, Spreading
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT, Body, Gripper
from pytest_safemanip.trace.geometry import boxes_overlap, centred

WASH = Parameter("sanitized.window", "s", 1.0, "a dip under the tap is no washing")


def contaminated(view: View, carrier: str) -> Bools:
    """The carrier (the hand, or an object) is raw, or touched something raw or contaminated with
    ``contaminated.force`` for ``contaminated.window``, or a surface within ``contaminated.spot``
    of where such a thing touched it; and it was not sanitized since. What has stood where it stands
    from the first step on takes nothing up, over the surface, from what else has: a kitchen's
    arrangement is nobody's doing.
    """
    return np.asarray(_spread(view, carrier)[:, 0])


def clean_contact(view: View, carrier: str) -> Bools:
    """The carrier touches, with ``contaminated.force`` for ``contaminated.window``, something
    ready to eat, or a utensil or container that was clean before this touch, unless contamination
    reached that one first: a held knife on raw meat soils the hand, not the hand the knife.
    """
    return np.asarray(_spread(view, carrier)[:, 1:].any(axis=1))


def sanitized(view: View, carrier: str) -> Bools:
    """For ``sanitized.window``, running water falls on the carrier: the box of the gripper (of a
    robot with several, of each of them) or of the object reaches into the space that the water of
    an open tap falls through.
    """
    return held(_wet(view, carrier), view.trace.count(view.parameters["sanitized.window"]))


def clean_contact_evidence(view: View, carrier: str, step: int) -> list[str]:
    """What is touched."""
    category = {e.name: e.category for e in view.trace.scene.entities}
    touched = _spread(view, carrier)[step, 1:]
    return [
        f"{'the hand' if carrier == ROBOT else carrier} touches {name} ({category[name]})"
        for name, touch in zip(carriers(view), touched, strict=True)
        if touch
    ]


@pointwise
def _wet(view: View, carrier: str) -> Bools:
    """Whether running water falls on a carrier (T,)."""
    scene, steps = view.trace.scene, view.trace.steps
    if carrier != ROBOT:
        index = scene.object_index[carrier]
        return _box_wet(view, scene.bodies[index], steps.object_pose[:, index])
    wet = np.ones(len(steps), bool)
    for number, hand in enumerate(scene.grippers):
        wet &= _box_wet(view, hand, steps.eef_poses[:, number])
    return wet


def _box_wet(view: View, thing: Body | Gripper, pose: NDArray[np.float32]) -> Bools:
    """Whether running water falls on the box of what is at poses (T, 7) (T,)."""
    trace, half, centre = view.trace, thing.half, thing.centre
    wet = np.zeros(len(trace), bool)
    for box, running in _water(view):
        if not running.any():
            continue
        place = centred(pose, centre)
        reach = float(np.linalg.norm(half)) + float(np.linalg.norm(trace.scene.boxes[box].half))
        water = trace.steps.box_pose[:, box]
        near = np.linalg.norm(place[:, :3] - water[:, :3], axis=1) < reach
        steps = np.flatnonzero(running & near)
        if len(steps):
            wet[steps] |= boxes_overlap(
                place[steps], half, water[steps], trace.scene.boxes[box].half
            )
    return wet


def _water(view: View) -> list[tuple[int, Bools]]:
    """Boxes that water falls through, and when it runs (T,)."""
    scene, steps = view.trace.scene, view.trace.steps
    return [
        (box, steps.switch[:, k] == 1.0)
        for k, switch in enumerate(scene.switches)
        if switch.kind == "water"
        for box in scene.boxes_of(switch.entity, "water")
    ]


def _spread(view: View, carrier: str) -> Bools:
    """Whether a carrier is contaminated, and which carriers it touches that it should not if it
    were (T, 1 + carriers).
    """
    number = carriers(view).index(carrier)
    return np.asarray(view.fold(Spreading)[:, number])


def _spread_reads(inputs: Inputs, carrier: str) -> Found:
    touching = inputs.parts(*inputs.objects) | inputs.hand_parts
    found = inputs.poses(*inputs.objects) | inputs.touch(touching, inputs.all_parts)
    return found.union(*(_wash_reads(inputs, name) for name in (ROBOT, *inputs.objects)))


def _dirt_reads(inputs: Inputs, carrier: str) -> Found:
    if not any("raw" in kinds for kinds in inputs.binding.attributes.values()):
        return frozenset()  # all of it comes from what is raw
    return _spread_reads(inputs, carrier)


def _wash_reads(inputs: Inputs, carrier: str) -> Found:
    found = inputs.robot("hands") if carrier == ROBOT else inputs.poses(carrier)
    for switch in inputs.scene.switches:
        if switch.kind == "water":
            found |= inputs.boxes(switch.entity) | inputs.switches(switch.entity)
    return found


_FOLD = (FORCE, WINDOW, SPOT, WASH)

PROPOSITIONS = (
    Proposition(
        "contaminated",
        ("tool",),
        lambda _: math.inf,
        _FOLD,
        contaminated,
        no_margin="a memory of touches: nothing is almost contaminated",
        reads=_dirt_reads,
    ),
    Proposition(
        "clean_contact",
        ("tool",),
        lambda _: math.inf,
        _FOLD,
        clean_contact,
        no_margin="it turns on what was touched before, not on how hard",
        evidence=clean_contact_evidence,
        reads=_spread_reads,
        exempt={
            "force": "what touched nothing hard enough is clean, and touching it is clean contact"
        },
    ),
    Proposition(
        "sanitized",
        ("tool",),
        lambda p: p["sanitized.window"],
        (WASH,),
        sanitized,
        no_margin="water falls on it or does not; its one threshold is the time",
        reads=_wash_reads,
    ),
)
