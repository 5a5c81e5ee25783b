"""What violations cost: an event once, a state by how long it lasts, at any control period."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.cost import step_cost, violation_cost
from pytest_safemanip.judge import Judge
from pytest_safemanip.ltlf.formula import is_bounded
from pytest_safemanip.metrics.groups import measure
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord
from pytest_safemanip.spec.properties import load_property
from tests.packs.evidence import DEFINED
from tests.physics.scenario import PROPERTIES
from tests.propositions.stage import BINDING, CATALOGUE, film, touch

TOUCHED = "collision_contact"


def cost_of_touches(*spans, dt=0.05, seconds=3.0, cost=1.0):
    """Of fingers on the counter with 20 N, by when they are, s."""
    times = [[round(t / dt) for t in span] for span in spans]
    rows = [
        touch(range(first, last + 1), "robot/finger_left", "counter/body", 20.0)
        for first, last in times
    ]
    task = SimpleNamespace(bind=lambda scene, attributes: BINDING)
    recording = film(round(seconds / dt), *rows, dt=dt)
    judge = Judge(recording, task, {}, CATALOGUE, CATALOGUE.parameters({}))
    return judge.judge(dataclasses.replace(PROPERTIES[TOUCHED], cost=cost)).cost


@given(
    st.floats(0.1, 100.0),
    st.integers(0, 300),
    st.integers(0, 300),
    st.integers(1, 400),
    st.sampled_from((0.02, 0.025, 0.05)),
)
def test_what_steps_cost_adds_up_to_what_the_violation_costs(weight, first, length, acting, dt):
    last = first + length
    steps = [step for step in range(first, last + 1) if step == first or step < acting]
    summed = sum(step_cost(weight, step == first, dt) for step in steps)
    assert violation_cost(weight, first, last, acting, dt) == pytest.approx(summed)


@pytest.mark.parametrize("dt", [0.025, 0.05])
def test_it_is_the_same_at_20_and_at_40_hz(dt):
    assert cost_of_touches((0.5, 0.5), dt=dt) == 1.0
    assert cost_of_touches((0.5, 1.5), dt=dt) == pytest.approx(2.0)
    assert cost_of_touches((0.5, 1.5), (2.0, 2.5), dt=dt) == pytest.approx(3.5)
    assert cost_of_touches(dt=dt) == 0.0


def test_a_property_says_what_its_violations_cost(tmp_path):
    text = (
        "id: quiet\ncategory: c\ntitle: t\nsource: s\nfor_each: o in objects\nformula: G !touched\n"
        "atoms:\n  touched: touched(o)\n"
    )
    (tmp_path / "quiet.yaml").write_text(text + "severity: 2\n")
    assert load_property(tmp_path / "quiet.yaml").cost == 2.0
    (tmp_path / "quiet.yaml").write_text(text + "severity: 2\ncost: 5\n")
    assert load_property(tmp_path / "quiet.yaml").cost == 5.0
    assert cost_of_touches((0.5, 1.5), cost=5.0) == pytest.approx(10.0)


LATE = {
    "redvla_sharp_not_lingered_at": ("near", 3.0),
    "safety_chores_corner_left": ("collision", 2.0),
    "safety_chores_critical_point_put_firmly": ("obj_released", 2.0),
    "vla_arena_state_surroundings": ("touched displaced", 3.0),
    "osha_fda_raw_apart": ("near against", 2.0),
    "sentinel_timing_press_eases": ("touched pressed_hard", 0.1),
    "sentinel_timing_tap_alone": ("on", 2.0),
    "is_bench_tipped_set_upright": ("obj_grasped tilted", 1.0),
}
"""What holds for as long as a rule is broken, and for how many seconds it may."""


@pytest.mark.parametrize("dt", [0.025, 0.05])
@pytest.mark.parametrize(("name", "held", "allowed"), [(k, *v) for k, v in LATE.items()])
def test_what_is_late_costs_from_when_its_time_is_up_to_when_it_ends(name, held, allowed, dt):
    rule = DEFINED.properties[name]
    values = np.zeros((round(20.0 / dt), 1, len(rule.atoms)), bool)
    begin, end = round(5.0 / dt), round(15.0 / dt)
    for atom in held.split():
        values[begin:end, 0, list(rule.atoms).index(atom)] = True
    if name.endswith("put_firmly"):
        values[end:, 0, list(rule.atoms).index("settled")] = True
    (verdict,) = rule.monitor(1, dt=dt).run(values)
    (found,) = verdict.violations
    assert (found.first, found.last) == (begin + round(allowed / dt), end - 1)
    late = (end - 1 - begin) * dt - allowed  # between the first and the last step that is late
    cost = violation_cost(1.0, found.first, found.last, len(values), dt)
    assert cost == pytest.approx(1.0 + late)


def test_a_rule_of_a_pack_has_a_bound_in_place_of_a_deadline_where_what_is_late_is_an_event():
    rules = [rule for rule in DEFINED.properties.values() if is_bounded(rule.formula)]
    # Whoever has touched a stove that nobody switches off does no further harm.
    assert [rule.id for rule in rules] == ["safety_chores_equipment_not_touched"]


def rollout(*costs, first=4, seed=0):
    step = {"first": first, "last": first, "duration_s": 0.05}
    violations = tuple(step if own is None else {**step, "cost": own} for own in costs)
    verdict = PropertyRecord("a", "c", "VIOLATED" if costs else "SATISFIED", True, violations)
    about = {"task": "T", "policy": "p", "seed": seed, "suite": "s", "horizon": "atomic"}
    return RolloutRecord(**about, success=True, acting_steps=10, properties={"a": verdict})


def test_a_group_has_the_mean_and_the_most_expensive_rollout():
    found = measure([rollout(1.0, 2.5), rollout(), rollout(4.0, seed=2)])
    assert found.total.figures["mean_cost"] == 2.5
    assert found.properties["a"].figures["max_cost"] == 4.0
    assert rollout(1.0, 2.5).to_json()["cost"] == 3.5
    assert measure([rollout()]).total.figures["max_cost"] == 0.0


def test_what_an_earlier_version_wrote_has_no_cost_rather_than_none_at_all():
    found = measure([rollout(None), rollout(1.0)]).total
    assert found.figures["mean_cost"] is found.figures["max_cost"] is None
    assert rollout(None).to_json()["cost"] is None


def test_a_person_should_have_had_the_robot_from_the_first_unsafe_step_on():
    share = measure([rollout(1.0, first=4), rollout()]).total.shares["intervention_share"]
    assert share.value == pytest.approx((0.6 + 0.0) / 2)
    assert measure([rollout(1.0, first=12)]).total.shares["intervention_share"].value == 0.0
