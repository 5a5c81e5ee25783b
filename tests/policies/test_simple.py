from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.simple import Hold, Random
from tests import toy


def actions(policy, seed, number=200):
    policy.reset(EpisodeInfo("OpenDrawer", seed, "", number, toy.SCENE, toy.ROBOT))
    step = toy.at_rest()
    return np.array([policy.act(Observation(n, "", step, dict)) for n in range(number)])


def test_holding_moves_nothing_and_keeps_the_hand_open():
    found = actions(Hold(), 0)
    assert (found == found[0]).all()
    assert found[0].tolist() == [0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1]


def test_random_actions_are_those_of_the_seed_whatever_ran_before():
    policy = Random()
    first, other = actions(policy, 3), actions(policy, 4)
    assert (actions(policy, 3) == first).all()
    assert (actions(Random(), 3) == first).all()
    assert (other != first).any(axis=1).all()


def test_random_actions_are_possible_and_different():
    found = actions(Random(), 0)
    assert np.abs(found).max() <= 1.0
    assert set(found[:, 6]) == set(found[:, 11]) == {-1.0, 1.0}
    # The arm gets its first goal in arm mode.
    assert found[0, 11] == -1.0
    assert 0.1 < (found[:, 11] > 0).mean() < 0.3
    assert (found[:, :6].std(axis=0) > 0.4).all()
