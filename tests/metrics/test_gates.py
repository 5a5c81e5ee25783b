from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.gates import (
    Gate,
    check_filters,
    check_must_pass,
    load_gates,
    parse_gate,
)
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.metrics.selection import FILTERS, Severe

KNOWN = {name: {f"{name}_one", f"{name}_two"} for name in FILTERS}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("violation_rate<=0.1", ("violation_rate", {}, "<=", 0.1, None, False)),
        ("success_rate >= 50%", ("success_rate", {}, ">=", 0.5, None, False)),
        (
            "violation_rate[category=release_stability] <= 10 % @0.95",
            ("violation_rate", {"category": "release_stability"}, "<=", 0.1, 0.95, False),
        ),
        (
            " exposure [ task = Pick* , policy=scripted:drop_high ] < 0.2 @ 90 % clustered ",
            ("exposure", {"task": "Pick*", "policy": "scripted:drop_high"}, "<", 0.2, 0.9, True),
        ),
        ("violations_per_rollout <= 2.5", ("violations_per_rollout", {}, "<=", 2.5, None, False)),
        ("triggered_rate > 0", ("triggered_rate", {}, ">", 0.0, None, False)),
        ("max_cost[task=T*] <= 25", ("max_cost", {"task": "T*"}, "<=", 25.0, None, False)),
        ("max_severity <= 3", ("max_severity", {}, "<=", 3.0, None, False)),
    ],
)
def test_a_gate_is_read(text, wanted):
    gate = parse_gate(text)
    assert (
        gate.metric,
        gate.where,
        gate.sign,
        gate.bound,
        gate.confidence,
        gate.clustered,
    ) == wanted
    assert gate.required
    assert gate.name == str(gate)
    assert parse_gate(str(gate)) == gate


@pytest.mark.parametrize(
    ("text", "where", "severe"),
    [
        ("violation_rate[severity >= 2] <= 5 %", {}, Severe(2.0)),
        ("exposure[severity>2.5] < 0.1", {}, Severe(2.5, above=True)),
        (
            "conditional_rate[ property=a , severity >= 3, task=T* ] <= 5 % @0.95 clustered",
            {"property": "a", "task": "T*"},
            Severe(3.0),
        ),
        ("violations_per_rollout[severity >= 1e1] <= 1", {}, Severe(10.0)),
        ("violation_rate <= 5 %", {}, None),
    ],
)
def test_a_gate_may_count_severe_violations_only(text, where, severe):
    gate = parse_gate(text)
    assert (gate.where, gate.severe) == (where, severe)
    assert parse_gate(str(gate)) == gate
    assert gate.needs == (("severity",) if severe else ())
    check_filters(gate, {name: {"a", "T"} for name in FILTERS})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("violation_rate[severity=2] <= 0.1", "expected severity >= NUMBER or severity > NUMBER"),
        ("violation_rate[severity <= 2] <= 0.1", "found 'severity <= 2'"),
        ("violation_rate[severity => 2] <= 0.1", "found 'severity => 2'"),
        ("violation_rate[severity 2] <= 0.1", "found 'severity 2'"),
        ("violation_rate[severity] <= 0.1", "found 'severity'"),
        ("violation_rate[severity >= much] <= 0.1", "expected a number"),
        ("violation_rate[severity >= ] <= 0.1", "expected a number"),
        ("violation_rate[severity >= 2 3] <= 0.1", "expected a number"),
        ("violation_rate[severity >= -1] <= 0.1", "a severity is from 0 up, found '-1'"),
        ("violation_rate[severity >= 2,severity > 1] <= 0.1", "'severity' is given twice"),
        ("violation_rate[severty >= 2] <= 0.1", "did you mean 'severity'?"),
        (
            "success_rate[severity >= 2] >= 0.5",
            "success_rate counts no violations: leave out 'severity >= 2'",
        ),
        ("triggered_rate[severity > 2] >= 0.5", "counts no violations: leave out 'severity > 2'"),
        ("", "expected METRIC"),
        ("violation_rate", "expected METRIC"),
        ("violation_rate == 0.1", "expected METRIC"),
        ("violation_rate <= 0.1 @0.95 everywhere", "expected METRIC"),
        ("violation_rat <= 0.1", "did you mean 'violation_rate'?"),
        ("rate <= 0.1", "nearest of 19: success_rate, "),
        ("violation_rate[suit=a] <= 0.1", "did you mean 'suite'?"),
        ("violation_rate[robot=a] <= 0.1", "known: category, horizon, pack, policy, property, "),
        ("violation_rate[suite] <= 0.1", "expected FILTER=VALUE"),
        ("violation_rate[suite=] <= 0.1", "expected FILTER=VALUE"),
        ("violation_rate[suite=a,suite=b] <= 0.1", "given twice"),
        ("violation_rate <= much", "expected a number"),
        (
            "violation_rate <= \u0665 %",
            "expected a number in 'violation_rate <= \u0665 %', as 0.05 or 5 %",
        ),
        ("violation_rate <= \uff15 %", "expected a number"),
        ("violation_rate <= 5_0 %", "found '5_0'"),
        ("violation_rate <= 1e-999", "found '1e-999'"),
        ("violation_rate[] <= 5 %", "the brackets of 'violation_rate[] <= 5 %' are empty"),
        ("violation_rate ≥ 5 %", "unknown character '≥' in 'violation_rate ≥ 5 %'; write '>='"),
        ("violation_rate >= \u22125 %", "unknown character '\u2212'"),
        ("violation_rate >= 0 %", "cannot fail: violation_rate is never below 0"),
        ("violation_rate < 0", "cannot pass: violation_rate is never so"),
        ("success_rate > 100 %", "cannot pass: success_rate is never so"),
        ("violation_rate <= nan", "expected a number"),
        ("violation_rate <= 10", "from 0 to 1 (or 0 % to 100 %), found '10'"),
        ("violation_rate <= -1%", "from 0 to 1"),
        ("violation_rate <= 0.1 @95", "a confidence from 0.5 to below 1"),
        ("violation_rate <= 0.1 @1", "a confidence from 0.5 to below 1"),
        ("violations_per_rollout <= 2 @0.95", "has no interval"),
        (
            "mean_cost <= 5 @0.95",
            "mean_cost is no share of rollouts and has no interval: leave out '@0.95' in 'mean_",
        ),
        ("mean_cost <= -1", "mean_cost is from 0 up, found '-1' in 'mean_cost <= -1'"),
        ("max_severity >= -0.5", "max_severity is from 0 up, found '-0.5'"),
        (
            "max_cost[property=a] <= 5 %",
            "max_cost is no share and not in per cent: leave out '%' after '5' in 'max_cost[prop",
        ),
        ("violations_per_rollout <= 10%", "leave out '%' after '10'"),
    ],
)
def test_what_is_no_gate_is_refused_with_what_exists(text, message):
    with pytest.raises(ConfigError) as caught:
        parse_gate(text)
    assert message in str(caught.value)


@given(st.text(max_size=60))
def test_any_text_is_a_gate_or_is_refused(text):
    try:
        gate = parse_gate(text)
    except ConfigError:
        return
    assert gate.metric in {**SHARES, **FIGURES}


def test_a_bound_is_kept_on_its_side():
    for sign, low, equal, high in (
        ("<=", True, True, False),
        ("<", True, False, False),
        (">=", False, True, True),
        (">", False, False, True),
    ):
        gate = Gate("g", "violation_rate", {}, sign, 0.3)
        assert [gate.keeps(value) for value in (0.2, 3 / 10, 0.4)] == [low, equal, high]


def test_a_filter_selects_something_that_exists():
    check_filters(parse_gate("exposure[policy=policy_o*,task=task_two] < 1"), KNOWN)
    with pytest.raises(ConfigError, match="no suite 'suite_on' in this run; did you mean 'suite_"):
        check_filters(parse_gate("exposure[suite=suite_on] < 1"), KNOWN)


def write(tmp_path, text):
    path = tmp_path / "gates.yaml"
    path.write_text(text)
    return path


def test_a_file_names_gates_and_what_has_to_pass(tmp_path):
    path = write(
        tmp_path,
        """\
# what a checkpoint has to reach
gates:
  releases: violation_rate[category=release_stability] <= 10 % @0.95
  success: success_rate >= 0.5   # for information
must_pass: [releases, grasp_stability]
margin: 0.05
""",
    )
    found = load_gates(path)
    assert [(gate.name, gate.required) for gate in found.gates] == [
        ("releases", True),
        ("success", False),
    ]
    assert found.must_pass == ("grasp_stability",)
    assert found.margin == 0.05
    check_must_pass(found, {"grasp_stability"})
    with pytest.raises(ConfigError) as caught:
        check_must_pass(found, {"release_stability"})
    assert str(caught.value).startswith(f"{path}:5: no gate, property or category 'grasp_sta")


def test_without_a_list_or_with_one_of_properties_all_gates_are_required(tmp_path):
    for last in ("", "must_pass: [grasp_stability]\n"):
        text = f"gates:\n  one: success_rate >= 0.5\n  two: exposure <= 0.5\n{last}"
        found = load_gates(write(tmp_path, text))
        assert [gate.required for gate in found.gates] == [True, True]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gates:\n  a: success_rat >= 0.5\n", "yaml:2: key 'gates.a': unknown metric"),
        ("gates:\n  a b: success_rate >= 0.5\n", "yaml:2: key 'gates.a b': expected a name"),
        ("gates:\n  a: mean_cost <= 5 %\n", "yaml:2: key 'gates.a': mean_cost is no share"),
        ("gates:\n  a: max_cost <= -5\n", "yaml:2: key 'gates.a': max_cost is from 0 up"),
        ("gates:\n  a: 3\n", "yaml:2: key 'gates.a': expected text"),
        ("gate:\n  a: success_rate >= 0.5\n", "yaml:1: unknown key 'gate'; did you mean 'gates'?"),
        ("margin: 0\n", "yaml:1: key 'margin': expected a positive number"),
        ("gates: [a]\n", "yaml:1: key 'gates': expected a mapping"),
    ],
)
def test_a_broken_file_is_refused_with_its_place(tmp_path, text, message):
    with pytest.raises(ConfigError) as caught:
        load_gates(write(tmp_path, text))
    assert message in str(caught.value)


def test_a_gate_fails_the_run_unless_it_says_otherwise():
    assert parse_gate("violation_rate <= 0.3").required
    assert Gate("name", "violation_rate", {}, "<=", 0.3).required
