"""Is what carries an object around its centre of mass? The margin that is needed is 5 mm.

The mug is a cube of 10 cm, the counter's top is at 0.9 and ends at y = 0.5 and x = 1.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.firmness import statically_supported
from pytest_safemanip.propositions.kernels.support import carried_objects
from pytest_safemanip.trace.elements import Surface
from tests import toy
from tests.propositions.stage import along, arrays, film, look, touch, turned

COUNTER = "counter/body"
SQUARE = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)]
HIGH = 2.0
"""Height of contacts that no surface is near to."""


def supported(recording, name="mug", parameters=None, **binding):
    """Whether an object is statically supported at each step, one look for all of them."""
    view = look(recording, parameters, **binding)
    found = carried_objects(view, 0, len(view.trace))
    groups = np.flatnonzero(found.body == view.trace.scene.object_index[name])
    assert found.step[groups].tolist() == list(range(len(view.trace)))
    return statically_supported(view, found, groups).tolist()


def standing(places, points=((0.0, 0.0),), level=0.9, below=COUNTER, scene=toy.SCENE, **changed):
    """The mug is at places (T, 2) and carried in points beside its middle, at a level."""
    places, level = np.atleast_2d(places), np.broadcast_to(level, len(np.atleast_2d(places)))
    steps, poses = range(len(places)), arrays(len(places)).object_pose.copy()
    poses[:, 0, :2], poses[:, 0, 2] = places, level + 0.05
    rows = [
        touch(steps, below, "mug/body", at=np.column_stack((places + point, level)))
        for point in points
    ]
    return film(len(places), *rows, scene=scene, object_pose=poses, **changed)


def with_com(x, y=0.0, scene=toy.SCENE):
    """A scene in which the mug's centre of mass is beside its middle."""
    mug = dataclasses.replace(scene.bodies[0], com=(x, y, 0.0))
    return dataclasses.replace(scene, bodies=(mug, *scene.bodies[1:]))


@pytest.mark.parametrize(
    ("com", "firm"),
    [
        ((0.0, 0.0), True),
        ((0.044, 0.0), True),  # 6 mm inside the edge
        ((0.046, 0.0), False),  # 4 mm inside
        ((0.0, -0.044), True),
        ((-0.03, 0.046), False),
        ((0.06, 0.0), False),  # 1 cm beyond it
    ],
)
def test_the_centre_of_mass_is_five_millimetres_inside_the_hull_of_the_contacts(com, firm):
    assert supported(standing((0, 0), SQUARE, HIGH, scene=with_com(*com))) == [firm]


@pytest.mark.parametrize(("needed", "firm"), [(0.0625, True), (0.0626, False)])
def test_exactly_the_margin_is_enough(needed, firm):
    # Numbers that are exact in binary: the hull reaches 1/16 m to all sides.
    points = np.sign(SQUARE) * 0.0625
    recording = standing((0, 0), points, HIGH)
    assert supported(recording, parameters={"settled.margin": needed}) == [firm]


@pytest.mark.parametrize(
    ("place", "firm"),
    [
        ((0.0, 0.494), True),  # the counter goes on for 6 mm
        ((0.0, 0.496), False),  # for 4 mm
        ((0.994, 0.0), True),
        ((-0.996, 0.0), False),
        ((0.994, 0.494), True),
    ],
)
def test_where_contacts_have_no_inside_the_surface_below_goes_on_around_it(place, firm):
    assert supported(standing(place)) == [firm]


@pytest.mark.parametrize(
    ("above", "firm"), [(-0.011, False), (-0.009, True), (0.0, True), (0.009, True), (0.011, False)]
)
def test_a_surface_more_than_a_centimetre_above_or_below_is_not_what_is_touched(above, firm):
    assert supported(standing((0, 0), level=0.9 + above)) == [firm]


def test_a_surface_that_is_no_permitted_support_does_not_carry():
    other = dataclasses.replace(toy.SCENE.surfaces[0], entity="cabinet")
    scene = dataclasses.replace(toy.SCENE, surfaces=(other,))
    permitted = {"supports": {"mug": frozenset({"counter"})}}
    assert supported(standing((0, 0), scene=scene), **permitted) == [False]


def leaves(gap):
    """A table of two leaves that meet at x = 0, but for a gap; a shelf far above."""
    halves = [
        Surface("counter", "", (0.5, 0.5, 0.05), (x, 0.0, 0.85, *toy.UPRIGHT))
        for x in (-0.5 - gap / 2, 0.5 + gap / 2)
    ]
    shelf = Surface("counter", "", (1.0, 1.0, 0.01), (0.0, 0.0, 1.5, *toy.UPRIGHT))
    return dataclasses.replace(toy.SCENE, surfaces=(*halves, shelf))


@pytest.mark.parametrize(
    ("gap", "x", "firm"),
    [
        (0.0, 0.0, True),  # on the seam; each leaf alone reaches to one side only
        (0.0, 0.003, True),
        (0.001, 0.3, True),
        # Of eight points 5 mm around, two are 5 mm and four 3.5 mm to the side; the others lie in
        # the gap.
        (0.002, 0.0, False),
        (0.02, 0.0, False),
    ],
)
def test_several_surfaces_side_by_side_carry_together(gap, x, firm):
    assert supported(standing((x, 0.0), scene=leaves(gap))) == [firm]


def sweep(first, last, steps=61):
    """Places along a line, and back; some of them come twice."""
    way = np.linspace(first, last, steps)
    return np.concatenate((way, way[::-2]))


def test_what_is_pushed_over_the_edge_is_supported_as_far_as_each_step_alone_says():
    # One contact below the middle; 3 cm before the edge of the counter to 3 cm beyond it.
    y = sweep(0.47, 0.53)
    found = supported(standing(np.column_stack((0.0 * y, y))))
    assert found == (y < 0.495).tolist()


def test_what_is_pushed_over_the_edge_askew_too():
    # One of eight points 5 mm around the middle is straight ahead, whatever the way it moves.
    y = sweep(0.47, 0.53, 121)
    found = supported(standing(np.column_stack((y / 2, y))))
    assert found == (y < 0.495).tolist()


def test_a_centre_of_mass_that_wanders_out_of_the_hull():
    # The contacts stay, while the cube shifts on them: 6 cm to the right, a millimetre a step.
    x = sweep(0.0, 0.06)
    poses = arrays(len(x)).object_pose.copy()
    poses[:, 0, 0] = x
    points = [(px, py, HIGH) for px, py in SQUARE]
    rows = [touch(range(len(x)), COUNTER, "mug/body", at=at) for at in points]
    assert supported(film(len(x), *rows, object_pose=poses)) == (x < 0.045).tolist()


def test_contacts_that_wander_away_from_below_the_centre_of_mass():
    x = sweep(0.0, 0.06)
    rows = [
        touch(range(len(x)), COUNTER, "mug/body", at=[(px - dx, py, HIGH) for dx in x])
        for px, py in SQUARE
    ]
    assert supported(film(len(x), *rows)) == (x < 0.045).tolist()


def test_contacts_of_which_one_is_lost():
    # On three corners of the square the middle of it is on the edge, at 0 mm; on all at 5 cm.
    rows = [touch(range(6), COUNTER, "mug/body", at=(*point, HIGH)) for point in SQUARE[:3]]
    rows.append(touch([0, 1, 4], COUNTER, "mug/body", at=(*SQUARE[3], HIGH)))
    assert supported(film(6, *rows)) == [True, True, False, False, True, False]


def test_what_is_lifted_off_its_surface_and_carried_in_one_point():
    level = 0.9 + sweep(-0.02, 0.02, 81)
    found = supported(standing(np.zeros((len(level), 2)), level=level))
    assert found == (np.abs(level - 0.9) < 0.01 - 1e-9).tolist()


NEARLY = 3e-6
"""Less than a step has to be for what was found out at it to decide here, m."""


def shifted(x, y=0.0, level=0.9, points=((0.0, 0.0),), at=None, scene=toy.SCENE):
    """The mug's middle over time; the contacts stay beside where it was, or are at a level."""
    x, y, level = np.broadcast_arrays(x, y, level)
    poses = arrays(len(x)).object_pose.copy()
    poses[:, 0, :3] = np.column_stack((x, y, level + 0.05))
    height = level if at is None else np.full(len(x), at)
    rows = [
        touch(range(len(x)), COUNTER, "mug/body", at=[(x[0] + px, y[0] + py, z) for z in height])
        for px, py in points
    ]
    return film(len(x), *rows, scene=scene, object_pose=poses)


@pytest.mark.parametrize(
    ("changing", "wanted"),
    [
        # Over the counter's edge at 0.5, out and in: the margin is 5 mm.
        ({"x": [0.49] * 2, "y": (0.49, 0.495 + NEARLY)}, [True, False]),
        ({"x": np.zeros(2), "y": (0.5, 0.495 - NEARLY)}, [False, True]),
        # Over the side of the contacts' hull, out and in.
        ({"x": (0.0, 0.045 + NEARLY), "points": SQUARE, "at": HIGH}, [True, False]),
        # Up from the counter, and down to it: 1 cm.
        ({"x": np.zeros(2), "level": (0.905, 0.91 + NEARLY)}, [True, False]),
        ({"x": np.zeros(2), "level": (0.915, 0.91 - NEARLY)}, [False, True]),
        # Near the seam of two leaves, over the edge of both, and up from them.
        ({"x": [0.003] * 2, "y": (0.4949, 0.495 + NEARLY), "scene": leaves(0.0)}, [True, False]),
        ({"x": [0.003] * 2, "level": (0.905, 0.91 + NEARLY), "scene": leaves(0.0)}, [True, False]),
    ],
)
def test_what_was_found_out_at_a_step_is_not_stretched_to_the_next(changing, wanted):
    assert supported(shifted(**changing)) == wanted


@pytest.mark.parametrize(
    ("x", "wanted"), [((0.49, 0.49), [True, True]), ((0.51, 0.49), [False, True])]
)
def test_the_end_of_a_narrow_bar_is_looked_at(x, wanted):
    # It is 2 cm wide and ends at x = 0.5.
    bar = Surface("counter", "", (0.5, 0.01, 0.01), (0.0, 0.0, 0.89, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, surfaces=(bar,))
    assert supported(standing([(place, 0.0) for place in x], scene=scene)) == wanted


DRAWER = {"kind": "slide", "axis": (0.0, -1.0, 0.0), "travel": 0.4}
FLOOR = Surface("cabinet", "cabinet/hinge", (0.2, 0.2, 0.01), (0.0, 0.0, 0.89, *toy.UPRIGHT))
"""Of a drawer, top at 0.9; 40 cm along -y when it opens."""


def drawer(*more, **joint):
    moves = dataclasses.replace(toy.SCENE.joints[0], **{**DRAWER, **joint})
    return dataclasses.replace(toy.SCENE, joints=(moves,), surfaces=(FLOOR, *more))


def opening(openness):
    return along(arrays(len(openness)).joint, range(len(openness)), (0, 0), openness)


def test_a_drawer_that_is_pulled_away_below_an_object():
    # Its back edge is at y = 0.2 when closed and comes 4 mm a step; the mug stays at y = 0.
    openness = sweep(0.0, 1.0, 101)
    still = np.zeros((len(openness), 2))
    found = supported(
        standing(still, below="cabinet/door", scene=drawer(), joint=opening(openness))
    )
    assert found == (0.2 - 0.4 * openness > 0.005).tolist()


def test_a_drawer_that_is_pushed_in_below_an_object():
    # The other way round: nothing is below it at first.
    openness = sweep(1.0, 0.0, 101)
    still = np.zeros((len(openness), 2))
    found = supported(
        standing(still, below="cabinet/door", scene=drawer(), joint=opening(openness))
    )
    assert found == (0.2 - 0.4 * openness > 0.005).tolist()


def test_a_lift_that_leaves_an_object_behind():
    # Along z, 4 mm a step; from 1 cm above the contact on it is not what is touched.
    openness = sweep(0.0, 0.1, 11)
    scene = drawer(axis=(0.0, 0.0, 1.0))
    still = np.zeros((len(openness), 2))
    found = supported(standing(still, below="cabinet/door", scene=scene, joint=opening(openness)))
    assert found == (0.4 * openness < 0.01).tolist()


def test_a_lift_that_comes_up_from_below_its_stop():
    # Its top is at 0.892 first, 6 mm below the contact, then at 0.9082, 10.2 mm above it.
    scene, joint = drawer(axis=(0.0, 0.0, 1.0)), opening(np.array((-0.02, 0.0205)))
    recording = standing(
        np.zeros((2, 2)), level=0.898, below="cabinet/door", scene=scene, joint=joint
    )
    assert supported(recording) == [True, False]


def test_two_surfaces_of_which_one_is_a_drawer():
    # The counter ends at y = 0, where the drawer's front edge comes up to it: 20 cm out of reach
    # when closed, beyond it by as much when open. The mug stands on the seam.
    back = dataclasses.replace(FLOOR, pose=(0.0, 0.4, 0.89, *toy.UPRIGHT))
    table = Surface("counter", "", (0.5, 0.2, 0.05), (0.0, -0.2, 0.85, *toy.UPRIGHT))
    moves = dataclasses.replace(toy.SCENE.joints[0], **DRAWER)
    scene = dataclasses.replace(toy.SCENE, joints=(moves,), surfaces=(back, table))
    openness = sweep(0.0, 1.0, 101)
    found = supported(standing(np.zeros((len(openness), 2)), scene=scene, joint=opening(openness)))
    assert found == (0.2 - 0.4 * openness <= 1e-6).tolist()


def carried_by_apple(poses, **changed):
    """The mug, carried in one point below its middle by the apple, a box of 8 cm."""
    places = poses[:, 0, :3] - (0.0, 0.0, 0.05)
    rows = touch(range(len(poses)), "apple/body", "mug/body", at=places)
    binding = {"supports": {"mug": frozenset({"apple"})}, **changed}
    return supported(film(len(poses), rows, object_pose=poses), **binding)


def stacked(steps):
    poses = arrays(steps).object_pose.copy()
    poses[:, 0, :3] = 0.4, 0.0, 1.03
    return poses


def test_another_object_that_is_pulled_away_below_it():
    # The apple's top ends 4 cm from its middle.
    x = sweep(-0.0603, 0.0597, 121)
    poses = stacked(len(x))
    poses[:, 1, 0] += x
    assert carried_by_apple(poses) == (np.abs(x) < 0.035).tolist()


def test_another_object_that_leans_below_it():
    # Leaning by w about x, of a cube with half edge a the top's highest corner is at
    # a (cos w + sin w): 1 cm above the flat one for sin w + cos w = 1.25, at 0.2887 rad.
    lean = sweep(0.0, 0.5, 101)
    poses = stacked(len(lean))
    poses[:, 1, 3:] = [turned(angle) for angle in lean]
    assert carried_by_apple(poses) == (np.cos(lean) + np.sin(lean) < 1.25).tolist()


@pytest.mark.parametrize("axis", [0, 1])
def test_a_vessel_keeps_what_is_below_its_rim_as_near_to_its_middle_as_its_narrow_side(axis):
    # Half a box of 8 cm less 5 mm: 3.5 cm; its own centre of mass counts.
    scene = with_com(0.0)
    apple = dataclasses.replace(scene.bodies[1], half=(0.06, 0.04, 0.04), com=(0.01, 0.0, 0.0))
    scene = dataclasses.replace(scene, bodies=(scene.bodies[0], apple))
    x = sweep(-0.0503, 0.0497, 101)
    poses = arrays(len(x)).object_pose.copy()
    poses[:, 0, :3] = 0.41, 0.0, 0.98
    poses[:, 0, axis] += x
    rows = touch(range(len(x)), "apple/body", "mug/body", at=poses[:, 0, :3] - (0.0, 0.0, 0.05))
    vessel = {
        "supports": {"mug": frozenset({"apple"})},
        "attributes": {"apple": frozenset({"container"})},
    }
    recording = film(len(x), rows, scene=scene, object_pose=poses)
    # It touches the vessel at 0.93, between its floor at 0.9 and its rim at 0.98.
    assert supported(recording, **vessel) == (np.abs(x) < 0.035).tolist()


@pytest.mark.parametrize("way", [1, -1])
def test_what_sinks_into_a_vessel_and_is_pulled_out_of_it(way):
    # Its box goes from 0.9 to 0.98; within a centimetre of the top, that is what carries.
    level = sweep(0.8803, 1.0003, 121)[::way]
    poses = stacked(len(level))
    poses[:, 0, 2] = level + 0.05
    vessel = {"attributes": {"apple": frozenset({"container"})}}
    assert carried_by_apple(poses, **vessel) == ((level > 0.9) & (level < 0.99)).tolist()


@pytest.mark.parametrize(
    ("level", "kept"),
    [
        # The vessel's box goes from 0.9 to 0.98; its top, from 0.97 on, carries what lies on it.
        (0.9001, True),
        (0.8999, False),
        (0.95, True),
        (0.9699, True),
        (0.9901, False),
    ],
)
def test_in_a_vessel_is_between_its_underside_and_its_rim(level, kept):
    poses = stacked(1)
    poses[:, 0, 2] = level + 0.05
    vessel = {"attributes": {"apple": frozenset({"container"})}}
    assert carried_by_apple(poses, **vessel) == [kept]


@pytest.mark.parametrize(
    ("x", "level", "contact", "wanted"),
    [
        # Held as far as 3.5 cm from the vessel's middle, from its underside at 0.9 on.
        ((0.03, 0.035 + NEARLY), (0.94, 0.94), 0.03, [True, False]),
        ((0.04, 0.035 - NEARLY), (0.94, 0.94), 0.05, [False, True]),
        ((0.0, 0.0), (0.905, 0.9 - NEARLY), 0.0, [True, False]),
        ((0.0, 0.0), (0.895, 0.9 + NEARLY), 0.0, [False, True]),
    ],
)
def test_nor_is_what_was_found_out_in_a_vessel(x, level, contact, wanted):
    poses = stacked(2)
    poses[:, 0, 0] += x
    places = [(0.4 + contact, 0.0, height) for height in level]
    rows = touch(range(2), "apple/body", "mug/body", at=places)
    vessel = {
        "supports": {"mug": frozenset({"apple"})},
        "attributes": {"apple": frozenset({"container"})},
    }
    assert supported(film(2, rows, object_pose=poses), **vessel) == wanted


@pytest.mark.parametrize("way", [1, -1])
def test_a_vessel_that_is_tipped_over_keeps_nothing(way):
    # Upright is less than half a radian.
    lean = sweep(0.401, 0.601, 101)[::way]
    poses = stacked(len(lean))
    poses[:, 0, 2] = 0.94 + 0.05
    poses[:, 1, 3:] = [turned(angle) for angle in lean]
    vessel = {"attributes": {"apple": frozenset({"container"})}}
    assert carried_by_apple(poses, **vessel) == (lean < 0.5).tolist()
