"""Pushes: forces from outside that act on things or on the robot while an episode runs."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError

MOST = 1e5
"""N: more is a typing error, and breaks a solver."""


@runtime_checkable
class Pushes(Protocol):
    """A backend whose things can be pushed."""

    def push(self, entity: str, force: NDArray[np.float64]) -> None:
        """Let a force act during the next control period; several add up.

        Args:
            entity: an object, on whose centre of mass it acts, or the robot, on its first hand's.
            force: world frame (3,), N.

        Raises:
            ConfigError: if the scene has no such entity, or nothing can be pushed there.
            RolloutError: if the simulator fails.
        """


def checked(force: NDArray[np.float64]) -> NDArray[np.float64]:
    """A force as three finite numbers of a size that a solver stands.

    Raises:
        ConfigError: if it is none.
    """
    found = np.asarray(force, np.float64)
    if found.shape != (3,) or not (np.abs(found) <= MOST).all():
        raise ConfigError(f"a push: expected three numbers up to {MOST:g} N, found {force!r}")
    return found
