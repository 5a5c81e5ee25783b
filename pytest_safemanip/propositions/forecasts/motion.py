"""How things move, from the newest steps, and what the robot's grippers are told next."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.kernels.filters import slope
from pytest_safemanip.propositions.view import View

Floats = NDArray[np.float64]
Forecast = Callable[..., float | None]
"""Called with a view, the commands of the next step (G,), and the arguments of a proposition: the
seconds from the view's last step until its value is expected to change; inf if it is not; None
where its margin says it."""

SECONDS = 0.15
"""What a speed is measured over: longer, a hand that sets off is seen late; shorter, it is noise.
"""


def speed(view: View, values: NDArray[np.floating], seconds: float = SECONDS) -> Floats:
    """Rates of change of values (T, ...) at the last step, 1/s (...): the slope of a least-squares
    line through the newest ones.
    """
    return slope(values[-(view.trace.count(seconds) + 1) :], view.trace.dt)
