"""How things move, from the newest steps, and what the robot is told next."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.kernels.filters import slope
from pytest_safemanip.propositions.view import View

Floats = NDArray[np.float64]


class Told(NamedTuple):
    """What the robot is told for the next step, which is known before it moves.

    Attributes:
        commands: to the grippers: above 0 closes, below 0 opens (G,).
        pace: share of its present speed that it is told to keep; 1 if nothing is known of it.
    """

    commands: NDArray[Any]
    pace: float = 1.0


Forecast = Callable[..., float | None]
"""Called with a view, a :class:`Told`, and the arguments of a proposition: the seconds from the
view's last step until its value is expected to change; inf if it is not; None where its margin says
it."""

SECONDS = 0.15
"""What a speed is measured over: longer, a hand that sets off is seen late; shorter, it is noise.
"""


def speed(view: View, values: NDArray[Any], seconds: float = SECONDS) -> Floats:
    """Rates of change of values (T, ...) at the last step, 1/s (...): the slope of a least-squares
    line through the newest ones.
    """
    return slope(values[-(view.trace.count(seconds) + 1) :], view.trace.dt)
