"""What the hand is told to do, as a function of time, whatever the rate of recording."""

from __future__ import annotations

import numpy as np

from tests.physics.world import BAR_HEIGHT, FINGER_OPEN, TIMESTEP, Place, bar_at

REACH = 0.15
"""How far the hand stays away before it closes in on something, m."""
LIFTED = 1.15
"""Height at which the hand carries things over others, m."""


class Script:
    """Targets of the hand and states of the tap and the burner, piece by piece.

    Args:
        place: where the hand starts.
    """

    def __init__(self, place: Place) -> None:
        self._target = np.array((*place, 0.0))
        self._finger, self._opens = FINGER_OPEN, True
        self._runs, self._burns = False, False
        self._pieces: list[np.ndarray] = []
        self._length = 0
        self.marks: dict[str, float] = {"start": 0.0}

    @property
    def commands(self) -> np.ndarray:
        """Of each substep: x, y, z, roll, finger, whether it is told to open, whether water runs,
        whether the burner is lit (S, 8).
        """
        return np.concatenate(self._pieces)

    @property
    def time(self) -> float:
        """Seconds so far."""
        return self._length * TIMESTEP

    def mark(self, name: str) -> Script:
        """Give the present time a name."""
        self.marks[name] = self.time
        return self

    def to(
        self,
        seconds: float,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        roll: float | None = None,
    ) -> Script:
        """Move there, gently at both ends."""
        before = self._target.copy()
        for index, value in enumerate((x, y, z, roll)):
            if value is not None:
                self._target[index] = value
        s = np.linspace(0.0, 1.0, self._count(seconds))[:, None]
        return self._add(before + (3 * s**2 - 2 * s**3) * (self._target - before))

    def wait(self, seconds: float) -> Script:
        """Stay."""
        return self._add(np.tile(self._target, (self._count(seconds), 1)))

    def close(self, seconds: float = 0.4, hold: float = 0.1) -> Script:
        """Close the fingers, as firmly as they can and not all at once."""
        self._opens = False
        for finger in np.linspace(self._finger, 0.0, self._count(seconds)):
            self._finger = float(finger)
            self.wait(TIMESTEP)
        return self.wait(hold)

    def open(self, seconds: float = 0.4, to: float = FINGER_OPEN) -> Script:
        """Open the fingers."""
        self._finger, self._opens = to, True
        return self.wait(seconds)

    def water(self, runs: bool) -> Script:
        """Turn the tap."""
        self._runs = runs
        return self

    def burner(self, burns: bool) -> Script:
        """Light the burner, or turn it off."""
        self._burns = burns
        return self

    def approach(self, place: Place) -> Script:
        """Stand in front of a place, then go there."""
        x, y, z = place
        return self.to(0.6, x, y - REACH, max(z, LIFTED)).to(0.3, z=z).to(0.4, y=y)

    def pick(self, place: Place) -> Script:
        """Fetch what stands at a place, and lift it."""
        return self.approach(place).close().to(0.4, z=LIFTED)

    def put(self, place: Place) -> Script:
        """Bring what is held to a place, and let go of it."""
        x, y, z = place
        self.to(0.7, x, y, LIFTED).to(0.5, z=z).wait(0.1)
        return self.let_go()

    def let_go(self) -> Script:
        """Open, and back off."""
        return self.mark("let go").open().to(0.4, y=float(self._target[1]) - REACH)

    def swing(self, seconds: float, start: float, end: float) -> Script:
        """Lead the handle of the door from one angle to another."""
        s = np.linspace(0.0, 1.0, self._count(seconds))
        angles = start + (3 * s**2 - 2 * s**3) * (end - start)
        way = np.array([(*bar_at(a), BAR_HEIGHT, 0.0) for a in angles])
        self._target = way[-1].copy()
        return self._add(way)

    def _count(self, seconds: float) -> int:
        return round(seconds / TIMESTEP)

    def _add(self, way: np.ndarray) -> Script:
        rest = np.tile((self._finger, self._opens, self._runs, self._burns), (len(way), 1))
        self._pieces.append(np.hstack((way, rest)))
        self._length += len(way)
        return self
