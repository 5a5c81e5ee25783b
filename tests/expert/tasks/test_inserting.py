from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pytest_safemanip.expert.tasks.inserting import lower_end
from pytest_safemanip.trace.geometry import corners

HALF = np.array((0.10, 0.005, 0.009))


@pytest.mark.parametrize("degrees", [-150.0, -70.0, 40.0, 110.0])
def test_the_lower_end_of_a_leaning_stick_is_its_lowest_point_but_for_its_thickness(degrees):
    turn = np.radians(degrees) / 2.0
    pose = np.array((1.0, 2.0, 1.1, np.cos(turn), 0.0, np.sin(turn), 0.0))
    points = corners(pose, HALF)
    end, up = lower_end(SimpleNamespace(pose=pose, centre=pose[:3], corners=points))
    assert np.linalg.norm(end - pose[:3]) == pytest.approx(HALF[0])
    assert end[2] == pytest.approx(points[:, 2].min(), abs=HALF[2])
    assert np.linalg.norm(end + 2 * HALF[0] * up - points[points[:, 2].argmax()]) < 0.011
