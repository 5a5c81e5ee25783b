"""Each proposition under real physics: where it becomes true, and where it almost does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest

from pytest_safemanip.propositions.filters import rising
from tests.physics.scenario import CATALOGUE, PERIOD

Call = tuple[str, ...]
Span = tuple[str | float, str | float]


@dataclass(frozen=True)
class Turn:
    """A moment at which a proposition becomes true."""

    call: Call
    rollout: str
    span: Span


@dataclass(frozen=True)
class Near:
    """A time in which a proposition is false, and would be true but for one thing.

    Attributes:
        call: the proposition and its arguments.
        rollout: where.
        span: when.
        but_for: parameters that would make it true.
        permitted: likewise, supports of the object.
    """

    call: Call
    rollout: str
    span: Span
    but_for: Mapping[str, float] = field(default_factory=dict)
    permitted: Mapping[str, frozenset[str]] = field(default_factory=dict)


TURNS = [
    Turn(("collision",), "arm hits bottle", ("sweeps", "swept")),
    Turn(("bad_contact",), "things touched gently", ("presses", "pressed")),
    Turn(("obj_grasped", "can"), "can is held", ("closes", "lifts")),
    Turn(("stable_grasp", "can"), "can is held", ("closes", "lifts")),
    Turn(("obj_released", "can"), "can put on counter", ("let go", "end")),
    Turn(("settled", "can"), "can put on counter", ("let go", "end")),
    Turn(("skill_onset", "pick", "can"), "can is held", ("closes", "lifts")),
    Turn(("skill_onset", "place", "can"), "can put on counter", ("let go", "end")),
    Turn(("skill_onset", "open", "cabinet"), "door closed after hit", ("grasps", "hit")),
    Turn(("skill_onset", "close", "cabinet"), "door closed after hit", ("retracts", "closed")),
    Turn(("skill_onset", "pour", "cup"), "poured into pan", ("pours", "poured")),
    Turn(("mech_hit", "cabinet"), "door pushed on", ("grasps", "hit")),
    Turn(("retract", "cabinet"), "door closed after hit", ("retracts", "closed")),
    Turn(("recovered", "cabinet"), "door closed after hit", ("closed", "end")),
    Turn(("fix_open", "cabinet"), "door opened", ("grasps", "opened")),
    Turn(("reach_in", "cabinet"), "hand in open cabinet", ("enters", "inside")),
    Turn(("place_in_onset", "can", "cabinet"), "can let go inside", ("enters", "in place")),
    Turn(("insert_item", "cabinet"), "can let go inside", ("enters", "in place")),
    Turn(("obj_inside", "can", "cabinet"), "can let go inside", ("enters", "in place")),
    Turn(("obj_outside", "can", "cabinet"), "can held at shelf", ("leaves", "let go")),
    Turn(("item_in_enclosure", "cabinet"), "can let go inside", ("let go", "end")),
    Turn(("enclosure_cleared", "cabinet"), "can added to empty shelf", ("takes out", "enters")),
    Turn(("transfer", "cherry", "pan"), "poured into pan", ("pours", "poured")),
    Turn(("contained", "cherry", "pan"), "poured into pan", ("pours", 6.0)),
    Turn(("contaminated", "robot"), "hand washed", ("raw", "let go")),
    Turn(("clean_contact", "robot"), "hand washed", ("clean", "end")),
    Turn(("sanitized", "robot"), "hand washed", ("dipped", "rinsed")),
]

HOLDS = [
    ("pick", "can", "can taken", True),
    ("pick", "can", "can taken from below", False),
    ("place", "can", "can put on counter", True),
    ("place", "can", "can dropped", False),
    ("pour", "cup", "poured into pan", True),
    ("pour", "cup", "poured beside pan", False),
    ("close", "cabinet", "door closed after hit", True),
    ("open", "cabinet", "door opened", True),
    ("open", "cabinet", "door closed after hit", False),
]

NEAR = [
    Near(("collision",), "things touched gently", ("shoves", "shoved"), {"collision.force": 0.1}),
    Near(
        ("bad_contact",), "things touched gently", ("nudges", "nudged"), {"bad_contact.force": 0.1}
    ),
    Near(
        ("clean_contact", "robot"),
        "things touched gently",
        ("nudges", "nudged"),
        {"contaminated.force": 0.1},
    ),
    Near(("obj_grasped", "can"), "can squeezed", ("start", "end"), {"obj_grasped.window": 0.05}),
    Near(
        ("skill_onset", "pick", "can"),
        "can squeezed",
        ("start", "end"),
        {"obj_grasped.window": 0.05},
    ),
    Near(("stable_grasp", "can"), "can slips", (2.1, 2.15), {"stable_grasp.distance": 0.06}),
    Near(("settled", "can"), "nothing happens", ("start", "end"), {"settled.margin": 0.001}),
    Near(
        ("settled", "can"),
        "can put over edge",
        ("end", 6.2),
        permitted={"can": frozenset({"counter", "floor"})},
    ),
    Near(
        ("mech_hit", "cabinet"),
        "door pushes light crate",
        ("start", "end"),
        {"mech_hit.force": 0.3},
    ),
    Near(("retract", "cabinet"), "door left ajar", ("creeps", "crept"), {"retract.share": 0.002}),
    Near(("recovered", "cabinet"), "door left ajar", ("half way", "end"), {"recovered.share": 0.5}),
    Near(("fix_open", "cabinet"), "nothing happens", ("start", "end"), {"fix_open.openness": 0.8}),
    Near(
        ("place_in_onset", "can", "cabinet"),
        "can held at shelf",
        ("touches", "enters"),
        {"enclosure.tolerance": 0.0005},
    ),
    Near(
        ("insert_item", "cabinet"),
        "can held at shelf",
        ("touches", "enters"),
        {"enclosure.tolerance": 0.0005},
    ),
    Near(
        ("obj_outside", "can", "cabinet"),
        "can held at shelf",
        (4.4, "half"),
        {"enclosure.tolerance": 0.015},
    ),
    Near(
        ("obj_inside", "can", "cabinet"),
        "can held at shelf",
        ("half", "in"),
        {"enclosure.tolerance": 0.02},
    ),
    Near(
        ("item_in_enclosure", "cabinet"),
        "can held at shelf",
        ("half", "leaves"),
        {"obj_grasped.force": 1000.0},
    ),
    Near(
        ("enclosure_cleared", "cabinet"),
        "can held at shelf",
        ("in", "leaves"),
        {"enclosure_cleared.window": 0.05},
    ),
    Near(("transfer", "cherry", "bowl"), "poured into pan", (0.0, 6.0), {"transfer.reach": 0.2}),
    Near(
        ("contained", "cherry", "pan"), "poured into pan", ("pours", 4.45), {"contained.drift": 0.1}
    ),
    Near(
        ("contaminated", "apple"), "nothing happens", ("start", "end"), {"contaminated.spot": 0.15}
    ),
    Near(("sanitized", "robot"), "hand washed", ("start", "dipped"), {"sanitized.window": 0.3}),
]


def identify(row):
    return f"{' '.join(row.call)}, {row.rollout}".replace(" ", "_")


def test_every_proposition_has_a_rollout_in_which_it_turns_and_one_in_which_it_almost_does():
    # What is missing here has tests of its own below.
    assert {row.call[0] for row in TURNS} | {"pre_safe"} == set(CATALOGUE)
    assert {row.call[0] for row in NEAR} | {"pre_safe", "reach_in", "obj_released"} == set(
        CATALOGUE
    )


@pytest.mark.parametrize("row", TURNS, ids=identify)
def test_a_proposition_becomes_true_when_it_happens(play, row):
    rollout = play(row.rollout)
    turns = np.flatnonzero(rising(rollout.view(*row.call)))
    assert set(turns) & set(rollout.steps(*row.span)), (turns * PERIOD, row.span)


@pytest.mark.parametrize("row", NEAR, ids=identify)
def test_a_proposition_stays_false_where_one_thing_is_missing(play, row):
    rollout = play(row.rollout)
    steps = rollout.steps(*row.span)
    assert not rollout.view(*row.call)[steps].any()
    changed = {"supports": row.permitted} if row.permitted else {}
    assert rollout.seen(row.but_for, **changed)(*row.call)[steps].any()


# It is true wherever no skill starts, so that it cannot be seen to become true.
@pytest.mark.parametrize(("skill", "entity", "name", "safe"), HOLDS)
def test_the_conditions_of_a_skill_hold_or_not_where_it_starts(play, skill, entity, name, safe):
    view = play(name).view
    (onset, *_) = np.flatnonzero(view("skill_onset", skill, entity))
    assert view("pre_safe", skill, entity)[onset] == safe


def test_only_its_height_makes_a_drop_unsafe(play):
    rollout = play("can dropped")
    assert not rollout.view("pre_safe", "place", "can").all()
    assert rollout.seen({"pre_safe.drop": 0.1})("pre_safe", "place", "can").all()


def test_fingertips_in_an_enclosure_are_no_reach_as_long_as_the_hand_is_outside(play):
    rollout = play("hand in open cabinet")
    tip = rollout.view.trace.steps.eef_pose[:, 1] + 0.025
    peeks = rollout.steps("peeks", "enters")
    assert tip[peeks].max() > 0.05
    assert not rollout.view("reach_in", "cabinet")[peeks].any()


def test_an_object_that_slips_out_of_closed_fingers_was_not_released(play):
    rollout = play("can slips")
    (end,) = np.flatnonzero(rising(~rollout.view("obj_grasped", "can")))
    assert end in rollout.steps("lifts", "lifted")
    assert not rollout.view("obj_released", "can").any()
