"""A copy of the state of a running simulation.

After a control step, MuJoCo's derived arrays (poses, contacts) lag the state by one substep, and
bringing the live data up to date would change what follows. So the state is copied, and what is
derived from it is computed in the copy: bit-neutral for the run.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Scratch:
    """A copy of a simulation's state.

    Args:
        model: its ``MjModel``.
        live: its ``MjData``, which is only read.

    Attributes:
        model: its ``MjModel``.
        data: ``MjData`` that nothing but the reader uses.
        state: what was copied last.
    """

    def __init__(self, model: Any, live: Any) -> None:
        self.model, self._live = model, live
        self.data = mujoco.MjData(model)
        self.state = np.empty(mujoco.mj_stateSize(self.model, _STATE))

    def take(self) -> None:
        """Copy the present state; nothing is derived from it yet."""
        mujoco.mj_getState(self.model, self._live, self.state, _STATE)
        mujoco.mj_setState(self.model, self.data, self.state, _STATE)
