"""Hypothesis strategies for contacts and recordings: a few events each, so that they shrink."""

from __future__ import annotations

from hypothesis import strategies as st

from pytest_safemanip.fuzz.events import (
    Carry,
    Drift,
    Drive,
    Grip,
    Hit,
    Look,
    Move,
    PlaceHand,
    PlaceObject,
    Pour,
    Press,
    Rest,
    Run,
    Spill,
    TouchKnob,
    Wash,
)
from pytest_safemanip.fuzz.film import Event, contact_rows, rendered
from pytest_safemanip.fuzz.scenes import DOOR, LIMB, PLACES, TAP, scenes
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts

FORCES = (3.1, 0.7, 0.3, 6.3, 31.0, 97.0, 163.0)
"""Newtons on either side of the usual limits; the first is what failures shrink to."""
NORMALS = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, -0.8, 0.6), (0.0, 1.0, 0.0))
SHIFTS = (0.0, 0.007, -0.021, 0.037, -0.063)
"""Metres to the side of a place; none moves an object by just as much as a grasp allows."""
VELOCITIES = ((0.31, 0.0, 0.0), (0.0, 0.0, 0.0), (0.013, 0.011, -0.007), (-0.7, 0.9, 0.3))
"""Metres, or radians, per second."""
MAX_STEPS = 30
MAX_EVENTS = 8


def _stretches(longest: int) -> st.SearchStrategy[range]:
    first, count = st.integers(0, MAX_STEPS - 1), st.integers(1, longest)
    return st.builds(lambda first, count: range(first, first + count), first, count)


_when = _stretches(MAX_STEPS // 2)
_any = st.integers(0, 17)
_hands = st.integers(0, 1)
_shift = st.tuples(st.sampled_from(SHIFTS), st.sampled_from(SHIFTS))
_places = st.sampled_from(sorted(PLACES))
_forces = st.sampled_from(FORCES)
_velocities = st.sampled_from(VELOCITIES)
_rates = st.sampled_from((0.53, -0.53))
_presses = st.builds(Press, _when, _any, _any, _forces, st.sampled_from(NORMALS))
_rare: st.SearchStrategy[Event] = st.one_of(
    st.builds(Run, _when, _any),
    st.builds(Spill, _when, _any, _places),
    st.builds(Look, _when, _shift),
).filter(bool)
"""Together as frequent as one of the others: a filter keeps Hypothesis from taking them apart."""
_events: st.SearchStrategy[Event] = st.one_of(
    st.builds(Grip, _when, _any, st.sampled_from((5.3, 0.3)), st.booleans(), _hands),
    st.builds(Rest, _when, _any, st.sampled_from(("counter", "cab", "floor"))),
    st.builds(PlaceObject, _when, _any, _places, _shift, st.sampled_from((0.0, 0.31, 1.57))),
    st.builds(PlaceHand, _when, _places, _shift, _hands),
    st.builds(Drift, _when, st.integers(0, 3), _velocities, _velocities),
    st.builds(Drive, _when, _shift),
    st.builds(Move, _when, st.sampled_from((DOOR, TAP)), st.sampled_from((0.97, 0.03)), _rates),
    st.builds(Hit, _stretches(4), _any, _forces, _rates, st.sampled_from((0.51, 0.97, 0.03))),
    st.builds(Carry, _when, _any, _places, st.booleans(), _velocities, _hands),
    st.builds(Pour, _when, _any, _places),
    st.builds(Wash, _when),
    st.builds(TouchKnob, _when),
    _rare,
    st.builds(Press, _when, st.just(LIMB), _any, _forces, st.just(NORMALS[1])),
    _presses,
)


def contacts(scene: Scene, length: int) -> st.SearchStrategy[Contacts]:
    """Contacts that come and go between the parts of a scene, over ``length`` steps."""
    presses = st.lists(_presses, max_size=MAX_EVENTS)
    return presses.map(lambda events: contact_rows(scene, length, events))


@st.composite
def recordings(
    draw: st.DrawFn,
    scene: st.SearchStrategy[Scene] | None = None,
    min_steps: int = 1,
    max_steps: int = MAX_STEPS,
) -> Recording:
    """Recordings in which anything may happen.

    Args:
        draw: Hypothesis's.
        scene: where, one of :func:`scenes`.
        min_steps: control steps at least.
        max_steps: control steps at most.
    """
    place = draw(_SCENES if scene is None else scene)
    # Half of them have all the steps that they may have.
    length = min(draw(st.integers(min_steps, 2 * max_steps - min_steps)), max_steps)
    happens = draw(_EVENT_LISTS)
    tail = draw(st.integers(0, min(3, length - 1)))
    return rendered(place, length, tail, happens)


_SCENES = scenes()
_MUCH = st.lists(_events, min_size=MAX_EVENTS, max_size=2 * MAX_EVENTS)
_EVENT_LISTS = st.one_of(st.lists(_events, max_size=MAX_EVENTS), _MUCH, _MUCH)
"""Failures shrink to the first kind, in which little happens."""
