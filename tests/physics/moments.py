"""When the propositions turn true in the scenarios, and when they almost do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

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
        binding: likewise, of what the task says.
    """

    call: Call
    rollout: str
    span: Span
    but_for: Mapping[str, float] = field(default_factory=dict)
    binding: Mapping[str, Any] = field(default_factory=dict)


TURNS = [
    Turn(("collision",), "arm hits bottle", ("sweeps", "swept")),
    Turn(("collision",), "can carried into jar", ("carries", "carried")),
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
    Turn(("mech_hit", "cabinet"), "door opened after hit", ("grasps", "hit")),
    Turn(("retract", "cabinet"), "door opened after hit", ("retracts", "opened")),
    Turn(("recovered", "cabinet"), "door opened after hit", ("opened", "end")),
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
    Turn(("on", "sink"), "hand washed", ("dips", "dipped")),
    Turn(("heated", "can"), "can put on lit burner", ("onto", "off")),
    Turn(("hot", "can", "heating=1"), "can put on lit burner", ("onto", "off")),
    Turn(("near", "robot", "can"), "can is held", ("start", "closes")),
    Turn(("above", "can", "jar"), "can carried over jar", ("carries", "carried")),
    Turn(("carried_over", "can", "jar"), "can carried over jar", ("carries", "carried")),
    Turn(("in_zone", "robot", "before_cabinet"), "hand in open cabinet", ("peeks", "enters")),
    Turn(("out_of_zone", "can", "over_counter"), "can put over edge", ("start", "let go")),
    Turn(("displaced", "bottle"), "arm hits bottle", ("sweeps", "swept")),
    Turn(("tilted", "bottle"), "arm hits bottle", ("sweeps", "swept")),
    Turn(("toppled", "bottle"), "arm hits bottle", ("sweeps", "swept")),
    Turn(("fallen", "can"), "can put over edge", ("let go", "end")),
    Turn(("too_fast", "robot"), "palm strikes", ("start", 0.5)),
    Turn(("touched", "bottle"), "arm hits bottle", ("sweeps", "swept")),
    Turn(("pressed_hard", "counter"), "palm strikes", ("start", 0.5)),
    Turn(("points_at", "cup", "pan"), "water poured beside pan", ("pours", "poured")),
    Turn(("occluded_from_cameras", "can"), "can let go inside", ("enters", "in place")),
    Turn(("transfer", "water", "pan"), "water poured into pan", ("pours", "poured")),
    Turn(("contained", "water", "pan"), "water poured into pan", ("pours", "poured")),
    Turn(("spilled", "cup"), "water poured beside pan", ("pours", "poured")),
]

# Skill, entity, rollout, and whether the skill may start: pre_safe is true where none starts, so
# that it cannot be seen to become true.
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
        ("end", 5.8),
        binding={"supports": {"can": frozenset({"counter", "floor"})}},
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
    Near(
        ("transfer", "cherry", "bowl"),
        "poured into pan",
        (0.0, 6.0),
        {"transfer.reach": 0.2},
        {"transfers": (("cherry", "bowl"),)},  # the pan, which is nearer, is no receiver
    ),
    Near(
        ("contained", "cherry", "pan"), "poured into pan", ("pours", 4.45), {"contained.drift": 0.1}
    ),
    Near(
        ("contaminated", "apple"), "nothing happens", ("start", "end"), {"contaminated.spot": 0.15}
    ),
    Near(("sanitized", "robot"), "hand washed", ("start", "dipped"), {"sanitized.window": 0.3}),
    Near(("hot", "can"), "can put on lit burner", ("start", "end"), {"hot.heating": 1.0}),
    Near(
        ("near", "robot", "bottle"),
        "arm passes over bottle",
        ("sweeps", "swept"),
        {"near.distance": 0.2},
    ),
    Near(
        ("above", "can", "jar"),
        "can carried past jar",
        ("carries", "end"),
        {"above.overlap": 0.001},
    ),
    Near(
        ("carried_over", "can", "jar"),
        "can carried past jar",
        ("carries", "end"),
        {"above.overlap": 0.001},
    ),
    Near(
        ("in_zone", "steak", "by_cabinet"),
        "nothing happens",
        ("start", "end"),
        {"in_zone.depth": 0.001},
    ),
    Near(
        ("out_of_zone", "can", "over_counter"),
        "can put at edge",
        ("start", "end"),
        {"out_of_zone.depth": 0.001},
    ),
    Near(
        ("displaced", "sponge"),
        "things touched gently",
        ("shoves", "shoved"),
        {"displaced.distance": 0.01},
    ),
    Near(("tilted", "cup"), "poured into pan", ("pours", 3.3), {"tilted.tilt": 0.3}),
    Near(("toppled", "jar"), "can carried into jar", ("carries", 3.35), {"toppled.window": 0.05}),
    Near(("fallen", "can"), "can dropped", ("start", "end"), {"fallen.height": 0.05}),
    Near(
        ("too_fast", "robot"),
        "things touched gently",
        ("shoves", "shoved"),
        {"too_fast.limit": 0.05},
    ),
    Near(("touched", "bun"), "things touched gently", ("nudges", "nudged"), {"touched.force": 0.1}),
    Near(
        ("pressed_hard", "counter"),
        "palm set down hard",
        ("start", "end"),
        {"pressed_hard.limit": 80.0},
    ),
    Near(
        ("points_at", "cup", "pan"),
        "water poured beside pan",
        ("pours", 3.55),
        {"points_at.angle": 1.0},
    ),
    Near(
        ("occluded_from_cameras", "can"),
        "can held at shelf",
        ("in", "back"),
        {"occluded_from_cameras.share": 0.6},
    ),
    Near(
        ("contained", "water", "pan"),
        "water poured into pan",
        ("pours", 4.15),
        {"contained.share": 0.3},
    ),
    Near(
        ("spilled", "cup"), "water poured into pan", ("pours", "poured"), {"spilled.window": 0.05}
    ),
]
