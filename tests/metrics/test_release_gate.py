from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.gates import Gates, parse_gate
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.metrics.release_gate import ReleaseGate, read_baseline
from pytest_safemanip.metrics.summaries import read
from pytest_safemanip.report.document import merged as merged_document
from tests.metrics.build import rollouts
from tests.metrics.test_summaries import DECISIVE, ORIGIN, document, summary, written

DECIDED = {**dict.fromkeys(("stop", "horizon_scale")), **DECISIVE}
OTHER = {**ORIGIN, "versions": {"mujoco": "3.3.1"}}
BOUND = parse_gate("violation_rate <= 0.5", "bound")


def test_a_run_without_a_rollout_passes_nothing():
    ruling = ReleaseGate(Gates((BOUND,))).rule_nothing()
    assert (ruling.failures(), ruling.refused) == (["bound-no policy"], "")
    compared = ReleaseGate(Gates(), summary(rollouts("."))).rule_nothing()
    assert compared.failures() == ["baseline"]
    assert compared.refused == "there is no rollout to compare"


def test_a_gate_is_decided_for_the_policies_that_it_is_about():
    own = parse_gate("violation_rate[policy=p*] <= 0.5")
    run = summary([*rollouts("x.", policy="q"), *rollouts("..", policy="pi0"), *rollouts("xx")])
    found = [(d.policy, d.verdict) for d in ReleaseGate(Gates((own,))).rule(run).decisions]
    assert found == [("pi0", "PASS"), ("p", "FAIL")]


def test_a_gate_may_be_decided_before_all_rollouts_were_run():
    run = summary(rollouts("." * 100 + "-" * 100))
    assert ReleaseGate(Gates((BOUND,))).rule(run).decisions[0].verdict == "INCOMPLETE"
    assert ReleaseGate(Gates((BOUND,)), early_stop=0.05).rule(run).decisions[0].verdict == "PASS"


@pytest.mark.parametrize("side", ["baseline", "run"])
def test_what_was_deselected_is_missing_in_a_comparison(side):
    whole, part = rollouts("...."), rollouts("....")
    for record in part:
        record.properties.clear()
        record.deselected["a"] = "c"
    before, now = (part, whole) if side == "baseline" else (whole, part)
    ruling = ReleaseGate(Gates(), summary(before)).rule(summary(now))
    assert {c.verdict for c in ruling.contrast.comparisons} == {"INCOMPLETE"}


@pytest.mark.parametrize("merged", [False, True])
def test_nothing_is_decided_on_a_summary_of_a_part_of_a_run(tmp_path, merged):
    found = document(rollouts("....", provenance=0))
    found["cases"]["partial"] = True
    run = read(written(tmp_path, found))
    if merged:  # and is read from what a merge has written
        both = merge([run, summary(rollouts(".", task="U"), **run.decisive)])
        run = read(written(tmp_path, merged_document(both, {}, tmp_path), "merged.json"))
    ruling = ReleaseGate(Gates((BOUND,)), summary(rollouts("...."))).rule(run)
    assert [d.verdict for d in ruling.decisions] == ["INCOMPLETE"]
    assert ruling.contrast is None
    assert (ruling.status(inconclusive=True, standins=False), ruling.failures()) == (
        1,
        ["bound-p", "baseline"],
    )
    assert "deselected" in ruling.decisions[0].why
    assert "deselected" in ruling.refused


def baseline(tmp_path, records, rollouts, origins=None, **decisive):
    """A baseline that is read for a run of some rollouts."""
    path = written(tmp_path, document(records))
    named = {**DECIDED, "stop": "success", "horizon_scale": 1.0, **decisive}
    return read_baseline(path, [RolloutKey(*r) for r in rollouts], named, origins or {})


def test_a_baseline_that_fits_is_read(tmp_path):
    records = [*rollouts("..", policy="p", provenance=0), *rollouts(".", policy="q")]
    run = [("p", "T", 0), ("q", "T", 0), ("q", "T", 7)]
    assert baseline(tmp_path, records, run, {"p": ORIGIN, "q": OTHER}).records == tuple(records)


@pytest.mark.parametrize(
    ("run", "origins", "message"),
    [
        ([("p", "T", 2)], {}, "has none of the tasks and seeds of this run"),
        ([("p", "U", 0)], {}, "has none of the tasks and seeds of this run"),
        ([("p", "T", 0), ("r", "T", 0)], {}, "has no rollout of policy 'r'; it has p"),
        ([("p", "T", 0)], {"p": OTHER}, "versions.mujoco is 3.9.0 and 3.3.1"),
        # Where each side has one policy they are compared, whatever their names.
        ([("new", "T", 0)], {"new": OTHER}, "versions.mujoco is 3.9.0 and 3.3.1"),
    ],
)
def test_a_baseline_that_does_not_fit_is_refused_before_anything_is_run(
    tmp_path, run, origins, message
):
    with pytest.raises(ConfigError) as caught:
        baseline(tmp_path, rollouts("..", provenance=0), run, origins)
    assert str(caught.value).startswith("--safemanip-baseline: ")
    assert message in str(caught.value)


def test_a_baseline_that_was_decided_in_another_way_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"and this run were not decided in the same way: sem"):
        baseline(tmp_path, rollouts("."), [("p", "T", 0)], semantics="paper")
