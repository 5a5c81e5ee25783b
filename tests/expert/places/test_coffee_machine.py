from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.expert.robot.rotations import upright


@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.3, 0.0), (-0.1, 0.4), (0.0, -0.9)])
def test_what_leans_is_brought_upright_by_the_shortest_turn(lean):
    axis = np.array((*lean, np.sqrt(1.0 - np.square(lean).sum())))
    turn = upright(axis)
    assert turn @ axis == pytest.approx((0.0, 0.0, 1.0))
    assert turn @ turn.T == pytest.approx(np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    # No turn about the vertical: what is level and square to the lean stays where it is.
    across = np.array((-axis[1], axis[0], 0.0))
    assert turn @ across == pytest.approx(across)
