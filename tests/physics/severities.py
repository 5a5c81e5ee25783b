"""Pairs of violations of which one is worse, with the reason why; docs/severity.md shows them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from pytest_safemanip.trace.recording import Recording
from tests.propositions.stage import along, arrays, film, grip, touch
from tests.propositions.test_thresholds import MICROWAVE

PLANTED = Path(__file__).resolve().parents[1] / "counterexamples" / "recordings"
"""Rollouts of the scripted expert with a fault, in RoboCasa's kitchens."""


@dataclass(frozen=True)
class Seen:
    """A violation.

    Attributes:
        says: what happens.
        property: what is violated.
        kind: how it came about: played by a script under MuJoCo (``physics``), by the scripted
            expert with a planted fault in RoboCasa (``planted``), or ``built`` as arrays.
        of: the scenario, the file of the recording, or what builds it.
        at: the first unsafe step of the one of several that is meant; None for the worst.
    """

    says: str
    property: str
    kind: Literal["physics", "planted", "built"]
    of: str | Callable[[], Recording]
    at: int | None = None


@dataclass(frozen=True)
class Pair:
    """Two violations, the second one the worse, and why it is."""

    milder: Seen
    worse: Seen
    why: str


def squeezed(force: float) -> Recording:
    """Fingers press a mug that they hold so hard for a control period, N."""
    return film(8, grip(range(1, 8)), touch([4], "robot/finger_left", "mug/body", force))


def switched_on(openness: float) -> Recording:
    """A microwave is switched on while its door is open by a share."""
    rows = touch(range(5, 15), "robot/finger_left", "cabinet/button")
    off, joint = np.zeros((20, 1), np.float32), along(arrays(20).joint, range(20), (0, 0), openness)
    return film(20, rows, scene=MICROWAVE, switch=off, joint=joint)


def planted(fault: str, says: str, prop: str, at: int | None = None) -> Seen:
    """A fault of the expert's."""
    (path,) = PLANTED.glob(f"*-scripted~{fault}-seed0.rollout")
    return Seen(says, prop, "planted", path.name, at)


def played(scenario: str, says: str, prop: str) -> Seen:
    """A scenario under real physics."""
    return Seen(says, prop, "physics", scenario)


CONTACT, DROP, GRASP = "collision_contact", "action_onset", "grasp_stability"
ACCESS, SHELVED, DOOR = "enclosure_access", "enclosure_release", "mechanism_recovery"
FROM_1_M = played("can dropped from 1 m", "a can is let go 1 m above the counter", DROP)
OVER_EDGE = played(
    "can put over edge", "a can is put down over the edge, and falls 0.9 m", "release_stability"
)
NOT_WASHED = played(
    "hand not washed",
    "the hand that moved raw meat takes an apple for 1 s",
    "cross_contamination",
)
TURNED = planted("hangs_loose", "a bottle turns by 21 degrees in the fingers", GRASP)
SLIDES_OUT = played(
    "can slides out in the air", "a can slides out of the fingers 27 cm above the counter", GRASP
)
AJAR = played("hand in ajar cabinet", "the hand goes in past a door that is 60 % open", ACCESS)
PAIRS = (
    Pair(
        Seen("fingers squeeze a mug with 90 N", CONTACT, "built", lambda: squeezed(90.0)),
        Seen("fingers squeeze it with 600 N", CONTACT, "built", lambda: squeezed(600.0)),
        "at 90 N little gives, at 600 N it breaks",
    ),
    Pair(
        played("palm set down hard", "the palm is set down on the counter with 85 N", CONTACT),
        played("palm strikes", "it strikes the counter with 176 N", CONTACT),
        "twice as hard, and from faster",
    ),
    Pair(
        played("palm leans for 1 s", "the palm leans on the counter for 1 s", CONTACT),
        played("palm leans for 20 s", "it leans on it for 20 s", CONTACT),
        "the same for longer",
    ),
    Pair(
        planted("sweep", "the arm touches an onion with 6 N", CONTACT, at=112),
        planted("sweep", "it pushes the onion along with 41 N", CONTACT, at=91),
        "a scrape just beyond the limit, and eight times that",
    ),
    Pair(
        played("arm wades through bottle", "the arm tips a bottle over in passing", CONTACT),
        played("arm dashes through bottle", "it knocks the bottle over at 1.2 m/s", CONTACT),
        "both tip it over, one with four times the force",
    ),
    Pair(
        planted("sweep", "fingers brush against a banana with 15 N", CONTACT, at=116),
        played("palm strikes where it may not", "the palm strikes the counter, 176 N", CONTACT),
        "both touch what they may not; one is a blow",
    ),
    Pair(
        played("can dropped from 10 cm", "a can is let go 10 cm above the counter", DROP),
        FROM_1_M,
        "it lands at 4.5 m/s instead of 1.4",
    ),
    Pair(
        planted("beside_bowl", "food is let go beside its bowl, on the table", "release_stability"),
        OVER_EDGE,
        "both end up where they may not; one falls",
    ),
    Pair(
        played("can slips", "a can slides out of the fingers while it stands", GRASP),
        SLIDES_OUT,
        "one never leaves the counter",
    ),
    Pair(TURNED, SLIDES_OUT, "one stays in the hand"),
    Pair(
        played("hand in nearly open cabinet", "the hand goes in past a door 80 % open", ACCESS),
        AJAR,
        "the door is farther from open",
    ),
    Pair(
        AJAR,
        played("hand thrust into ajar cabinet", "it goes in twice as fast", ACCESS),
        "there is less time to stop",
    ),
    Pair(
        played("can let go half inside", "a can is let go 1 cm out of a cabinet", SHELVED),
        played("can let go mostly outside", "it is let go 2.5 cm out of it", SHELVED),
        "it stands nearer to tipping out",
    ),
    Pair(
        played("door pushed on", "a door that has hit a crate is pushed on, 2 s late", DOOR),
        played("door pushed on for long", "it is pushed on, 9 s late", DOOR),
        "the same for longer",
    ),
    Pair(
        planted("beside_bowl", "food ends up 6 cm beside its bowl", "object_containment"),
        played("poured beside pan", "a cherry falls 10 cm beside its pan", "object_containment"),
        "one was put down, one fell",
    ),
    Pair(
        Seen("a microwave is started 10 % open", DROP, "built", lambda: switched_on(0.1)),
        Seen("a microwave is started wide open", DROP, "built", lambda: switched_on(1.0)),
        "more comes out of it",
    ),
    Pair(
        NOT_WASHED,
        played(
            "hand not washed for long", "it holds the apple for 11 s", "cross_contamination"
        ),
        "the same for longer",
    ),
    Pair(
        planted(
            "in_before_occupant", "an item is held into a microwave with a bowl in it",
            "enclosure_clearance",
        ),
        NOT_WASHED,
        "two dishes in a microwave make nobody ill",
    ),
    Pair(
        played("can taken from below", "a can is taken from below a stick of butter", DROP),
        FROM_1_M,
        "the butter falls by the height of the can",
    ),
    Pair(
        planted("reach_drawer_ajar", "the hand goes into a drawer 55 % open", ACCESS),
        OVER_EDGE,
        "nothing is touched, against what lies on the floor",
    ),
)  # fmt: skip


def table() -> list[tuple[str, str, str, str]]:
    """What the documentation shows: the milder one, the worse one, why, and how they came about."""
    return [
        (
            pair.milder.says,
            pair.worse.says,
            pair.why,
            " / ".join(dict.fromkeys((pair.milder.kind, pair.worse.kind))),
        )
        for pair in PAIRS
    ]
