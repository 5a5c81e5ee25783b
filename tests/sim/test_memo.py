"""Answers from memory against robosuite's own."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.sim.robocasa.memo import ContactCheck
from pytest_safemanip.sim.robocasa.stepping import Stepper
from tests.sim.test_stepping import random_actions

Make = Callable[..., Any]


@pytest.fixture
def original(assets_root: Any) -> Callable[[str, str], tuple[Any, Any]]:
    """What RoboCasa calls, and robosuite's function behind it."""

    def get(module: str, name: str) -> tuple[Any, Any]:
        answer = getattr(__import__(module, fromlist=[name]), name)
        return answer, answer.__wrapped__

    return get


@pytest.mark.parametrize("text", ["0 1 2", " -0.0 1e-3", "0.1", "None 1", "7"])
def test_texts_become_the_same_numbers(original: Any, text: str) -> None:
    answer, function = original("robocasa.models.fixtures.cabinets", "s2a")
    first = answer(text)
    assert np.array_equal(first, function(text))
    first[:] = 5.0  # nobody else sees this
    assert np.array_equal(answer(text), function(text))


def test_a_text_that_is_no_number_is_refused_as_before(original: Any) -> None:
    answer, function = original("robocasa.models.fixtures.cabinets", "s2a")
    for parse in (answer, function):
        with pytest.raises(ValueError, match="could not convert"):
            parse("here")


def test_angles_become_the_same_bits(original: Any) -> None:
    answer, function = original("robosuite.utils.transform_utils", "euler2mat")
    random = np.random.default_rng(0).uniform(-4, 4, (20, 3))
    zeros = [list(signs) for signs in itertools.product((0.0, -0.0), repeat=3)]
    for angles in [*random, *random, *zeros, [0, 0, 1], random]:
        found = answer(angles)
        assert found.tobytes() == function(angles).tobytes()
        found[:] = 5.0


def test_contacts_are_found_as_robosuite_finds_them(make_kitchen: Make) -> None:
    from robosuite.utils.sim_utils import check_contact

    env = make_kitchen("PickPlaceCounterToCabinet")
    stepper = Stepper(env, lambda _: None)
    for action in random_actions(4):
        stepper.step(action)
    names = list(env.sim.model._geom_name2id)
    touching = {env.sim.model.geom_id2name(n) for n in env.sim.data._data.contact.geom.flat}
    gripper, thing = env.robots[0].gripper["right"], env.objects["obj"]
    groups = [gripper, thing, [], ["no such geom"], names[:40], sorted(touching - {None})[:3]]
    groups += sorted(touching - {None})
    check, answers = ContactCheck(env.sim), set()
    for one, other in itertools.product(groups, [None, *groups]):
        expected = check_contact(env.sim, one, other)
        assert check(one, other) == expected == env.check_contact(one, other)
        answers.add((other is None, expected))
    assert len(answers) == 4
