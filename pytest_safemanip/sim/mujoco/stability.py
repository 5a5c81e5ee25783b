"""Whether physics came to numbers that are not finite."""

from __future__ import annotations

from typing import Any

import mujoco

from pytest_safemanip.errors import TraceError


def check_stable(data: Any) -> None:
    """Refuse what MuJoCo puts back to its beginning, with a warning alone.

    Args:
        data: ``MjData`` after some steps.

    Raises:
        TraceError: if its state was not finite.
    """
    kinds = mujoco.mjtWarning
    for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC):
        if data.warning[int(kind)].number:
            raise TraceError(
                "the physics of the model is unstable: it comes to numbers that are not finite"
            )
