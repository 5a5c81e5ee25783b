from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.trace.geometry import about, multiply
from tests.propositions.hazards.kitchen import kitchen, see
from tests.propositions.stage import grip, rest, touch, true_at

FIRST = (0.0, 0.0, 0.95)


def leaning(degrees):
    """Quaternions of something that leans (T, 4)."""
    return np.array([about((1.0, 0.0, 0.0), np.deg2rad(angle)) for angle in degrees])


def at_heights(heights):
    return [(0.0, 0.0, height) for height in heights]


def test_what_is_somewhere_else_than_at_first_is_displaced():
    path = [(x, 0.0, 0.95) for x in (0.0, 0.015, 0.021, 0.0, 0.5)]
    view = see(kitchen(5, places={"mug": path}))
    assert true_at(view("displaced", "mug")) == [2, 4]
    assert view.margin("displaced", "mug") == pytest.approx(
        [-1.0, -0.25, 0.05, -1.0, 24.0], abs=1e-4
    )
    assert view.evidence("displaced", ("mug",), 4) == ["mug is 50.0 cm from where it stood"]
    assert not view("displaced", "apple").any()


def test_what_goes_with_the_door_that_it_stands_on_is_where_it_was_put():
    # The toy's door turns about a vertical axis through (-0.3, 0.4), by 1.5 rad.
    joint = np.zeros((4, 1, 2), np.float32)
    joint[:, 0, 0] = (0.2, 0.4, 0.6, 0.6)
    angles = 1.5 * (joint[:, 0, 0] - 0.2)
    arm = np.array((0.3, 0.05))
    path = [
        (
            -0.3 + np.cos(a) * arm[0] - np.sin(a) * arm[1],
            0.4 + np.sin(a) * arm[0] + np.cos(a) * arm[1],
            1.9,
        )
        for a in angles
    ]
    path[3] = (*np.add(path[3][:2], (0.0, 0.03)), 1.9)
    carried = rest([0], "mug", on="cabinet/door")
    view = see(kitchen(4, carried, joint=joint, places={"mug": path}))
    assert true_at(view("displaced", "mug")) == [3]
    assert true_at(see(kitchen(4, joint=joint, places={"mug": path}))("displaced", "mug")) == [
        1,
        2,
        3,
    ]


def test_what_leans_far_for_long_enough_has_toppled():
    angles = [0, 33, 50, 0, *[50] * 8]
    view = see(kitchen(12, turns={"mug": leaning(angles)}))
    assert true_at(view("tilted", "mug")) == [1, 2, *range(4, 12)]
    assert true_at(view("toppled", "mug")) == [8, 9, 10, 11]  # 5 steps are a quarter of a second
    assert view.margin("tilted", "mug")[1] == pytest.approx(0.1, abs=1e-5)
    assert view.evidence("toppled", ("mug",), 8) == ["mug leans by 50 degrees"]


def test_what_a_hand_holds_aslant_has_not_toppled():
    rows = grip(range(20), "mug")
    view = see(kitchen(40, rows, turns={"mug": leaning([50] * 40)}))
    assert not view("toppled", "mug")[:20].any()
    at_first = leaning([0, *[50] * 39])
    view = see(kitchen(40, rows, turns={"mug": at_first}))
    assert view("tilted", "mug")[1:].all()
    held = true_at(view("obj_grasped", "mug"))
    assert true_at(view("toppled", "mug"))[0] >= held[-1] + 5


def test_a_thing_that_lay_at_first_has_not_fallen_over():
    on_its_side = leaning([90] * 10)
    turned = np.array([multiply(about((0, 0, 1), 0.3 * t), q) for t, q in enumerate(on_its_side)])
    assert not see(kitchen(10, turns={"mug": turned}))("tilted", "mug").any()
    upside_down = leaning([0, *[180] * 9])
    assert see(kitchen(10, turns={"mug": upside_down}))("toppled", "mug").any()


@pytest.mark.parametrize(("height", "falls"), [(0.09, False), (0.11, True), (0.5, True)])
def test_what_came_down_through_the_air_has_fallen(height, falls):
    heights = np.maximum(0.95 + height - 4.9 * (0.05 * np.arange(-3, 27).clip(0)) ** 2, 0.95)
    rows = touch(range(4), "robot/finger_left", "mug/body", 3.0, (0, 0, 1))
    lands = int(np.argmax(heights <= 0.95))
    rows += rest(range(lands, 30))
    view = see(kitchen(30, rows, places={"mug": at_heights(heights)}), {"fallen.window": 0.5})
    assert view("fallen", "mug").any() == falls
    if falls:
        assert view("fallen", "mug")[lands]
        assert not view("fallen", "mug")[lands + 10 :].any()  # for half a second
        assert view.evidence("fallen", ("mug",), lands) == [f"mug fell by {100 * height:.0f} cm"]
    fell = view.margin("fallen", "mug").max()
    assert fell == pytest.approx(height / 0.1 - 1.0, abs=1e-4)


def test_what_is_put_down_has_not_fallen():
    heights = np.linspace(1.5, 0.95, 30)
    rows = [*grip(range(30), "mug"), *rest(range(29, 40))]
    places = at_heights([*heights, *[0.95] * 10])
    assert not see(kitchen(40, rows, places={"mug": places}))("fallen", "mug").any()


def test_what_lies_on_the_floor_has_fallen_unless_it_always_has():
    rows = touch(range(3, 6), "floor/body", "mug/body", 3.0)
    view = see(kitchen(6, rows))
    assert true_at(view("fallen", "mug")) == [3, 4, 5]
    assert view.evidence("fallen", ("mug",), 4) == ["mug lies on the floor"]
    rows = touch([0, *range(3, 6)], "floor/body", "mug/body", 3.0)
    assert not see(kitchen(6, rows))("fallen", "mug").any()
