from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import Surface
from pytest_safemanip.trace.surfaces import Surfaces
from tests import toy

SHELF = Surface("cabinet", "", (0.2, 0.1, 0.01), (0.5, 0.0, 1.5, *toy.UPRIGHT))
TOP = toy.SCENE.surfaces[0]


def test_surfaces_are_a_sequence_of_what_they_were_made_of():
    found = Surfaces.of((TOP, SHELF))
    assert len(found) == 2
    assert (found[0], found[-1], found[:1]) == (TOP, SHELF, (TOP,))
    assert found == (TOP, SHELF)
    assert tuple(found) == (TOP, SHELF)
    assert found != (SHELF, TOP)
    assert Surfaces.of(found) is found
    with pytest.raises(IndexError):
        found[2]


def test_a_scene_may_have_none():
    assert len(Surfaces.of(())) == 0
    scene = dataclasses.replace(toy.SCENE, surfaces=Surfaces.of(()))
    assert scene.checked() == dataclasses.replace(toy.SCENE, surfaces=())


def test_as_many_of_everything():
    with pytest.raises(ValueError, match=r"2 entities, 1 joints, half \(2, 3\), pose \(2, 7\)"):
        Surfaces(["a", "b"], [""], np.zeros((2, 3)), np.zeros((2, 7)))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"half": (0.1, -0.1, 0.1)}, "surfaces of 'cabinet': half is negative"),
        ({"half": (0.1, np.inf, 0.1)}, "surfaces of 'cabinet': half must be 3 finite numbers"),
        ({"pose": (0, 0, np.nan, 1, 0, 0, 0)}, "surfaces of 'cabinet': pose must be 7 finite"),
        ({"pose": (0, 0, 0, 1, 1, 0, 0)}, "surfaces of 'cabinet': pose is not of unit length"),
        ({"entity": "shed"}, "surfaces name an unknown entity 'shed'"),
        ({"joint": "cabinet/lid"}, "surfaces name an unknown joint 'cabinet/lid'"),
    ],
)
def test_an_impossible_surface_is_named(changed, message):
    wrong = Surfaces.of((TOP, dataclasses.replace(SHELF, **changed)))
    with pytest.raises(TraceError, match=message):
        dataclasses.replace(toy.SCENE, surfaces=wrong).checked()
