"""Parameters that one call sets for itself."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.propositions.online import Online
from tests import toy
from tests.propositions.stage import BINDING, CATALOGUE, film, grip, look, rest

FIRM, LONG = ("obj_grasped", "mug", "force=20"), ("obj_grasped", "mug", "window=1")
CALLS = [("obj_grasped", "mug"), FIRM, LONG, ("obj_grasped", "mug", "window=1", "force=5")]


def held():
    """A mug that is held with 10 N for a second, and with 30 N for another one."""
    return film(60, grip(range(10, 30)), grip(range(30, 50), left=30.0, right=30.0))


def test_a_call_is_judged_by_its_own_parameters_and_others_by_the_general_ones():
    view = look(held())
    usual, firm, long, both = (np.flatnonzero(view(*call))[0] for call in CALLS)
    assert (usual, firm) == (12, 32)
    assert long == both == 20  # the majority of a second
    assert np.flatnonzero(view("obj_grasped", "mug"))[0] == 12


def test_a_part_and_evidence_follow_the_parameters_of_the_call():
    view = look(film(12, rest(range(12))))
    assert view.part("settled", "mug", first=8, stop=12).all()
    assert not view.part("settled", "mug", "margin=0.6", first=8, stop=12).any()
    view = look(film(12, grip(range(12))))
    (line,) = view.evidence("stable_grasp", ("mug", "window=2"), 11)
    assert line.endswith("within 2 s")


@pytest.mark.parametrize("every", [1, 7])
def test_step_by_step_the_calls_have_the_same_values(every):
    recording, view = held(), look(held())
    parameters = CATALOGUE.parameters({})
    online = Online(toy.SCENE, BINDING, parameters, CATALOGUE, CALLS, every)
    rows, margins = [], []
    for count, step in enumerate(recording.steps, start=1):
        rows.append(online.push(*step))
        if count % every == 0:
            margins.append([online.margin(call) for call in CALLS])
    told = np.stack([view.margin(*call) for call in CALLS], axis=1)
    assert margins == pytest.approx(told[every - 1 :: every], abs=1e-9)
    found = np.concatenate([*rows, online.flush()])
    assert np.array_equal(found, np.stack([view(*call) for call in CALLS], axis=1))


@pytest.mark.parametrize(
    ("setting", "error", "message"),
    [
        ("windw=1", TraceError, "obj_grasped: no parameter 'windw'; did you mean 'window'"),
        ("window=0", ConfigError, "parameter obj_grasped.window: expected a number above 0"),
        ("window=long", TraceError, "obj_grasped: 'window=long'"),
    ],
)
def test_what_is_no_parameter_of_the_call_is_refused(setting, error, message):
    with pytest.raises(error, match=message):
        look(film(2))("obj_grasped", "mug", setting)
