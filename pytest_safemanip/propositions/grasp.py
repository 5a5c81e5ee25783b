"""Grasp stability and release: held, held firmly, let go.

A robot has any number of grippers, and each any number of finger groups: an object is grasped when
two groups of one gripper press on it, against each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.filters import (
    change,
    falling,
    majority,
    recently,
    rising,
)
from pytest_safemanip.propositions.kernels.forces import (
    Parts,
    finger_groups,
    forces_on,
    pushes,
)
from pytest_safemanip.propositions.kernels.margins import NONE, given, lately, over, under, voted
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.frames import inner
from pytest_safemanip.trace.geometry import angle_between, relative, tilt

GRASP_FORCE = Parameter(
    "obj_grasped.force", "N", 0.5, "above the weight of anything that lies against a finger"
)
GRASP_WINDOW = Parameter(
    "obj_grasped.window", "s", 0.25, "contact of a held object flickers for 1 to 3 control steps"
)
GRASP_ANGLE = Parameter(
    "obj_grasped.angle",
    "rad",
    float(np.deg2rad(100.0)),
    "at less, what fingers of rubber (friction 0.8) press on slides out between them",
)
KEPT_ANGLE = Parameter(
    "obj_grasped.kept_angle",
    "rad",
    float(np.deg2rad(90.0)),
    "at less, neither finger presses against the other; in between it takes time to slide out",
)
SLIP_DISTANCE = Parameter("stable_grasp.distance", "m", 0.03, "more than the pads' own size")
SLIP_ANGLE = Parameter("stable_grasp.angle", "rad", 0.35, "20 degrees: contents begin to shift")
SLIP_WINDOW = Parameter("stable_grasp.window", "s", 1.0, "slow slip counts, settling-in does not")
TILT = Parameter("stable_grasp.tilt", "rad", float(np.deg2rad(30.0)), "liquids begin to spill")
OPENING_RATE = Parameter(
    "obj_released.rate", "1/s", 0.02, "above the fingers' motion while they hold"
)
OPENING_WINDOW = Parameter(
    "obj_released.window", "s", 0.25, "the debounced end of a grasp comes this much later"
)
ROUNDING = 1e-6
"""More than what the cosine of an angle is off by: faces of a box are at exactly 90 degrees."""


def pressed(view: View, name: str) -> Bools:
    """Two finger groups of a gripper press on the object at this very step, and not to the same
    side (T,).
    """
    return _any_hand(view, lambda hand: pressed_by(view, name, hand))


def _any_hand(view: View, holds: Callable[[int], Bools]) -> Bools:
    """Whether something holds of any gripper (T,)."""
    found = np.zeros(len(view.trace), bool)
    for hand in range(len(view.trace.scene.grippers)):
        found |= holds(hand)
    return found


def pressed_by(view: View, name: str, hand: int, angle: Parameter = KEPT_ANGLE) -> Bools:
    """Two finger groups of a gripper press on the object, at more than an angle to each other
    (T,).
    """
    found = _agreement(view, hand)[:, view.trace.scene.object_index[name]]
    return np.asarray(found < np.cos(view.parameters[angle.name]) - ROUNDING)


@pointwise
def _agreement(view: View, hand: int) -> NDArray[np.float64]:
    """Cosine of the angle between what two finger groups of a gripper press each object with, of
    those two that are most against each other; infinite where no two press on it (T, N).
    """
    limit = view.parameters["obj_grasped.force"]
    least = np.full((len(view.trace), len(view.trace.scene.bodies)), np.inf)
    for one, other in itertools.combinations(finger_groups(view)[hand], 2):
        both = (forces_on(view, one) >= limit) & (forces_on(view, other) >= limit)
        if both.any():
            least[both] = np.minimum(least[both], _cosines(view, (one, other), both))
    return least


def _cosines(view: View, fingers: tuple[Parts, Parts], where: Bools) -> NDArray[np.float64]:
    """Cosine of the angle between what two finger groups press objects with, at some of the steps
    and objects (T, N); infinite where one of them only touches (K,).
    """
    ways = pushes(view, fingers, where)
    reach = np.sqrt(inner(ways, ways)).prod(axis=0)
    along = inner(ways[:, 0], ways[:, 1])
    none = np.full(len(reach), np.inf)
    return np.asarray(np.divide(along, reach, out=none, where=reach > 0.0))


@pointwise
def _squeeze(view: View, hand: int, angle: float) -> NDArray[np.float64]:
    """Margins of two finger groups of a gripper pressing on each object, at more than an angle to
    each other (T, N).
    """
    limit = view.parameters["obj_grasped.force"]
    most = np.full((len(view.trace), len(view.trace.scene.bodies)), NONE)
    least = np.arccos(max(np.cos(angle) - ROUNDING, -1.0))
    for one, other in itertools.combinations(finger_groups(view)[hand], 2):
        force = np.minimum(forces_on(view, one), forces_on(view, other))
        both = force > 0.0
        if both.any():
            cosine = np.clip(_cosines(view, (one, other), both), -1.0, 1.0)
            apart = (np.arccos(cosine) - least) / angle
            most[both] = np.maximum(most[both], np.minimum(over(force[both], limit), apart))
    return most


def obj_grasped(view: View, name: str) -> Bools:
    """Two finger groups of a gripper press on the object, each with at least
    ``obj_grasped.force``, in the majority of the last ``obj_grasped.window``; and against each
    other, not as closed fingers do that push it: at more than ``obj_grasped.angle`` at some step of
    such a window, and at more than ``obj_grasped.kept_angle`` since.
    """
    return _any_hand(view, lambda hand: _grasped_by(view, name, hand))


def obj_grasped_margin(view: View, name: str) -> Floats:
    """The margin that the vote turns on, of the weaker finger group and of the angle (T,)."""
    return _best_hand(view, lambda hand: _grasp_margin(view, name, hand))


def _best_hand(view: View, margin: Callable[[int], Floats]) -> Floats:
    """The margin of something holding of any gripper (T,)."""
    hands = [margin(hand) for hand in range(len(view.trace.scene.grippers))]
    return np.asarray(np.max(hands, axis=0) if hands else np.full(len(view.trace), NONE))


def _pressed_margin(view: View, name: str, hand: int, angle: Parameter = KEPT_ANGLE) -> Floats:
    """Margins of :func:`pressed_by` (T,)."""
    index = view.trace.scene.object_index[name]
    return np.asarray(_squeeze(view, hand, view.parameters[angle.name])[:, index])


def _grasp_margin(view: View, name: str, hand: int) -> Floats:
    """Margins of :func:`_grasped_by` (T,)."""
    votes, further = _counts(view)
    firmly = lately(_pressed_margin(view, name, hand, GRASP_ANGLE), further)
    return voted(np.minimum(_pressed_margin(view, name, hand), firmly), votes)


def _counts(view: View) -> tuple[int, int]:
    """Control periods of the vote, and of how much farther each of its steps looks back: both
    together are rounded once, or their errors would add up.
    """
    votes = view.trace.count(view.parameters["obj_grasped.window"])
    return votes, max(1, view.trace.count(looks_back(view.parameters)) - votes)


def _grasped_by(view: View, name: str, hand: int) -> Bools:
    """Whether a gripper grasps the object (T,)."""
    presses = pressed_by(view, name, hand)
    if not presses.any():  # mostly
        return presses
    votes, further = _counts(view)
    firmly = recently(pressed_by(view, name, hand, GRASP_ANGLE), further)
    return majority(presses & firmly, votes)


def _grasp_of(view: View, name: str, hand: int) -> Bools:
    """Likewise, looked up where it is the whole of ``obj_grasped`` (T,)."""
    if len(view.trace.scene.grippers) == 1:
        return view("obj_grasped", name)
    return view.looking_back(looks_back(view.parameters), _grasped_by, name, hand)


def looks_back(p: Mapping[str, float]) -> float:
    """How long whether something is grasped looks back, s: the vote, and at each of its steps
    whether the fingers pressed against each other lately.
    """
    return 2.0 * p["obj_grasped.window"]


def stable_grasp(view: View, name: str) -> Bools:
    """A gripper grasps the object, and between any two steps of this grasp within the last
    ``stable_grasp.window`` its pose relative to the gripper changed by less than
    ``stable_grasp.distance`` and ``stable_grasp.angle``; if it must stay upright, it tilts less
    than ``stable_grasp.tilt``. Steps at which the fingers do not press, or the gripper is
    commanded open, do not count: what slides out of an opening hand is let go.
    """
    stable = _any_hand(view, lambda hand: _stable_in(view, name, hand))
    if name in view.binding.upright:
        index = view.trace.scene.object_index[name]
        leans = (
            tilt(view.trace.steps.object_pose[:, index, 3:]) >= view.parameters["stable_grasp.tilt"]
        )
        stable &= ~(leans & _any_hand(view, lambda hand: _holds(view, name, hand)))
    return stable


def _stable_in(view: View, name: str, hand: int) -> Bools:
    """Whether a gripper grasps the object, which does not slip in it (T,)."""
    p, stable = view.parameters, _grasp_of(view, name, hand)
    held = _held(view, name, hand)
    if held and not _steady(view, held):
        distance, turn = _slip(view, held)
        stable = stable & (distance < p["stable_grasp.distance"]) & (turn < p["stable_grasp.angle"])
    return stable


def stable_grasp_margin(view: View, name: str) -> Floats:
    """The least margin of the grasp, of how far it slipped and turned, and of how it leans (T,)."""

    def steady(hand: int) -> Floats:
        p, (distance, turn) = view.parameters, _slip(view, _held(view, name, hand))
        slips = under(distance, p["stable_grasp.distance"]), under(turn, p["stable_grasp.angle"])
        return np.asarray(np.min((_grasp_margin(view, name, hand), *slips), axis=0))

    def holds(hand: int) -> Floats:
        closes = view.trace.steps.commands[:, hand] >= 0.0
        return given(closes, _pressed_margin(view, name, hand))

    stable = _best_hand(view, steady)
    if name in view.binding.upright:
        index = view.trace.scene.object_index[name]
        lean = tilt(view.trace.steps.object_pose[:, index, 3:])
        upright = under(lean, view.parameters["stable_grasp.tilt"])
        stable = np.minimum(stable, np.maximum(upright, -_best_hand(view, holds)))
    return stable


def obj_released(view: View, name: str) -> Bools:
    """The grasp ends at this step while the gripper opens or is commanded open: within the last
    ``obj_released.window`` it was commanded to, or it opened by more than ``obj_released.rate``
    times that window without being commanded to close. An end without opening is a drop and no
    release, and so is one where what was held forces closing fingers apart. What another gripper
    still grasps is not released.
    """
    count = view.trace.count(view.parameters["obj_released.window"])

    def let_go(hand: int) -> Bools:
        commanded = recently(view.trace.steps.commands[:, hand] < 0.0, count)
        ends = falling(_grasp_of(view, name, hand))
        return np.asarray(ends & (commanded | _opened(view, hand, count)))

    ends = falling(view("obj_grasped", name))
    return ends & _any_hand(view, let_go) if ends.any() else ends


def in_fingers(view: View, name: str) -> Bools:
    """Whether the object is grasped; not once an opening hand no longer presses on it, which the
    debounced grasp shows later (T,).
    """

    def within(hand: int) -> Bools:
        opening = view.trace.steps.commands[:, hand] < 0.0
        presses = pressed_by(view, name, hand)
        return np.asarray(_grasp_of(view, name, hand) & ~(opening & ~presses))

    return _any_hand(view, within)


def stable_grasp_evidence(view: View, name: str, step: int) -> list[str]:
    """How far the object moved in the gripper, and how far it leans if it may not."""
    if not view("obj_grasped", name)[step]:
        return [f"{name} left the gripper"]
    hands = [n for n in range(len(view.trace.scene.grippers)) if _grasp_of(view, name, n)[step]]
    slips = {hand: _slip(view, _held(view, name, hand)) for hand in hands}
    lines = []
    if name in view.binding.upright:
        index = view.trace.scene.object_index[name]
        lean = float(tilt(view.trace.steps.object_pose[step : step + 1, index, 3:])[0])
        if lean >= view.parameters["stable_grasp.tilt"]:
            lines.append(f"{name} must stay upright and leans by {np.rad2deg(lean):.0f} degrees")
    alone, grippers = len(view.trace.scene.grippers) == 1, view.trace.scene.grippers
    return [
        *lines,
        *(
            f"{name} moved {1000 * distance[step]:.0f} mm and turned {np.rad2deg(turn[step]):.0f} "
            f"degrees in the {'' if alone else f'{grippers[hand].name} '}gripper within "
            f"{view.parameters['stable_grasp.window']:g} s"
            for hand, (distance, turn) in slips.items()
        ),
    ]


def _opened(view: View, hand: int, count: int) -> Bools:
    """Whether a gripper is more open than at one of the last steps (T,)."""
    opening, p = view.trace.steps.openings[:, hand, 0], view.parameters
    least = p["obj_released.rate"] * p["obj_released.window"]
    # What opens fingers that are commanded to close is a load that is levered out of them.
    closes = view.trace.steps.commands[:, hand] > 0.0
    opened = np.zeros(len(opening), bool)
    for lag in range(1, min(count, len(opening)) + 1):
        opened |= (change(opening, lag) > least) & ~recently(closes, lag)
    return opened


def _holds(view: View, name: str, hand: int) -> Bools:
    """Whether a gripper's fingers press on the object, and are not commanded to open (T,)."""
    command = view.trace.steps.commands[:, hand]
    return np.asarray(pressed_by(view, name, hand) & (command >= 0.0))


_Held = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]
"""Steps at which an object is held (K,), the number of the grasp (K,), its pose in the hand (K, 7);
nothing where it is held at less than two steps.
"""


def _held(view: View, name: str, hand: int) -> _Held | None:
    grasped = _grasp_of(view, name, hand)
    steps = np.flatnonzero(grasped & _holds(view, name, hand))
    if len(steps) < 2:
        return None
    index, taken = view.trace.scene.object_index[name], view.trace.steps
    pose = relative(taken.eef_poses[steps, hand], taken.object_pose[steps, index])
    return steps, np.cumsum(rising(grasped), dtype=np.intp)[steps], pose


def _steady(view: View, held: _Held) -> bool:
    """Whether the object stays so near to one place in each grasp that no two can be far apart."""
    p, (steps, grasp, pose) = view.parameters, held
    begins = np.flatnonzero(np.append(True, grasp[1:] != grasp[:-1]))
    place, first = pose[:, :3], np.repeat(begins, np.append(begins[1:], len(steps)) - begins)
    spread = np.maximum.reduceat(place, begins) - np.minimum.reduceat(place, begins)
    if np.linalg.norm(spread, axis=1).max() >= p["stable_grasp.distance"]:
        return False
    turned = angle_between(pose[first, 3:], pose[:, 3:])
    return bool(2.0 * turned.max() < p["stable_grasp.angle"])


def _slip(view: View, held: _Held | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Largest change of the pose in the gripper within the window: metres and radians (T,)."""
    count = view.trace.count(view.parameters["stable_grasp.window"])
    distance, turn = np.zeros(len(view.trace)), np.zeros(len(view.trace))
    if held is None:
        return distance, turn
    steps, grasp, pose = held
    # Each step against those before it: the n-th column is the n-th compared step before.
    place = np.arange(len(steps))[:, None] - np.arange(1, count + 1)
    before = np.maximum(place, 0)
    same = (place >= 0) & (steps[:, None] - steps[before] <= count)
    same &= grasp[:, None] == grasp[before]
    apart = pose[:, None, :3] - pose[before, :3]
    moved = np.einsum("kni,kni->kn", apart, apart)
    alike = np.abs(np.einsum("kni,ki->kn", pose[before, 3:], pose[:, 3:]))
    rows, most = np.arange(len(steps)), np.where(same, alike, np.inf).argmin(axis=1)
    turned = angle_between(pose[before[rows, most], 3:], pose[:, 3:])
    distance[steps] = np.sqrt(np.where(same, moved, 0.0).max(axis=1))
    turn[steps] = np.where(same[rows, most], turned, 0.0)
    return distance, turn


def _grasp_reads(inputs: Inputs, name: str) -> Found:
    return inputs.touch(inputs.finger_parts, inputs.parts(name))


def _stable_reads(inputs: Inputs, name: str) -> Found:
    return _grasp_reads(inputs, name) | inputs.poses(name) | inputs.robot("hands", "commands")


def _release_reads(inputs: Inputs, name: str) -> Found:
    return _grasp_reads(inputs, name) | inputs.robot("openings", "commands")


def _grasp_window(p: Mapping[str, float]) -> float:
    return p["obj_grasped.window"]


PROPOSITIONS = (
    Proposition(
        "obj_grasped",
        ("object",),
        looks_back,
        (GRASP_FORCE, GRASP_WINDOW, GRASP_ANGLE, KEPT_ANGLE),
        obj_grasped,
        margin=obj_grasped_margin,
        debounce=_grasp_window,
        lacks=grounding.gripper,
        reads=_grasp_reads,
    ),
    Proposition(
        "stable_grasp",
        ("object",),
        lambda p: p["stable_grasp.window"] + looks_back(p),
        (SLIP_DISTANCE, SLIP_ANGLE, SLIP_WINDOW, TILT),
        stable_grasp,
        margin=stable_grasp_margin,
        evidence=stable_grasp_evidence,
        lacks=grounding.gripper,
        reads=_stable_reads,
    ),
    Proposition(
        "obj_released",
        ("object",),
        lambda p: max(p["obj_released.window"], looks_back(p)),
        (OPENING_RATE, OPENING_WINDOW),
        obj_released,
        act=True,
        no_margin="an edge: a grasp ends at this step or it does not",
        debounce=_grasp_window,
        lacks=grounding.gripper,
        reads=_release_reads,
    ),
)
