"""Ways to do the same skill otherwise: where the base stands, how the hand is tipped, how fast."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Variation:
    """How a skill differs from its usual way.

    Attributes:
        aside: how much farther to the left the base stands, m.
        ahead: how much farther ahead, m.
        pitch: how much farther the hand is tipped forward, degrees.
        yaw: how much farther it is turned to the left about the vertical, degrees.
        pace: factor on all speeds.
        folds: whether the arm is folded first.
    """

    aside: float = 0.0
    ahead: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    pace: float = 1.0
    folds: bool = False

    def __str__(self) -> str:
        said = [
            f"base {abs(100 * self.aside):.0f} cm to the {'left' if self.aside > 0 else 'right'}",
            f"base {100 * self.ahead:+.0f} cm ahead",
            f"hand tipped by {self.pitch:+.0f} degrees",
            f"hand turned by {self.yaw:+.0f} degrees",
            f"{self.pace:g} times as fast",
            "arm folded first",
        ]
        differs = [
            ours != usual for ours, usual in zip(vars(self).values(), vars(USUAL).values(), strict=True)
        ]
        return ", ".join(text for text, other in zip(said, differs, strict=True) if other) or "usual"


USUAL = Variation()

VARIATIONS = (
    USUAL,
    Variation(pace=0.5),
    Variation(aside=0.1),
    Variation(aside=-0.1),
    Variation(pitch=15.0),
    Variation(pitch=-15.0),
    Variation(ahead=-0.06),
    Variation(folds=True),
    Variation(aside=0.2),
    Variation(aside=-0.2),
    Variation(yaw=20.0),
    Variation(yaw=-20.0),
    Variation(aside=0.1, pitch=15.0),
    Variation(aside=-0.1, pitch=15.0),
    Variation(aside=0.1, pitch=-15.0),
    Variation(aside=-0.1, pitch=-15.0),
    Variation(pitch=30.0),
    Variation(ahead=0.05),
    Variation(aside=0.15, folds=True, pace=0.5),
    Variation(aside=-0.15, folds=True, pace=0.5),
)
"""The cheapest first."""
