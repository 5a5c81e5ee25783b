from __future__ import annotations

from dataclasses import dataclass

import pytest

from pytest_safemanip.metrics.recall import LATEST, detect
from pytest_safemanip.trace.hazard import Hazard


@dataclass(frozen=True)
class Violation:
    entities: tuple[str, ...]
    first: int


DROPPED = Hazard("release_stability", ("mug",), 10, 14)


def found(violations, hazards=(DROPPED,), deadlines=None):
    return detect(hazards, violations, deadlines or {}, 0.05)


def test_a_violation_of_the_same_property_and_entity_finds_a_hazard():
    ((detection,), other) = found({"release_stability": [Violation(("mug",), 18)]})
    assert (detection.step, other) == (18, set())
    assert detection.latency_s == pytest.approx(0.2)


def test_a_violation_while_the_hazard_begins_has_no_latency():
    ((detection,), _) = found({"release_stability": [Violation(("mug",), 10)]})
    assert detection.latency_s == 0.0


def test_the_deadline_is_no_latency():
    late = {"release_stability": [Violation(("mug",), 116)]}
    ((detection,), _) = found(late, deadlines={"release_stability": 5.0})
    assert detection.latency_s == pytest.approx(0.1)


@pytest.mark.parametrize(
    "violations",
    [
        {},
        {"release_stability": []},
        {"release_stability": [Violation(("bowl",), 18)]},
        {"release_stability": [Violation(("mug",), 9)]},
        {"grasp_stability": [Violation(("mug",), 18)]},
    ],
)
def test_another_property_or_entity_or_an_earlier_violation_does_not_find_it(violations):
    ((detection,), other) = found(violations)
    assert detection.step is None
    assert detection.latency_s is None
    assert other == {name for name, rows in violations.items() if rows}


def test_a_violation_long_after_a_hazard_is_not_its_own_but_one_after_its_detection_is():
    last = DROPPED.last + round(LATEST / 0.05)
    for first, step in ((last, last), (last + 1, None)):
        late = {"release_stability": [Violation(("mug",), first)]}
        ((detection,), other) = found(late)
        assert (detection.step, other) == (step, set() if step else {"release_stability"})
    aftermath = [Violation(("mug",), 20), Violation(("mug",), last + 1)]
    assert found({"release_stability": aftermath})[1] == set()


def test_the_first_of_several_violations_counts_and_none_of_them_is_another():
    rows = [Violation(("mug",), step) for step in (30, 20)]
    ((detection,), other) = found({"release_stability": rows})
    assert (detection.step, other) == (20, set())


def test_a_false_alarm_beside_a_detection_is_told():
    rows = [Violation(("mug",), 20), Violation(("bowl",), 20)]
    ((detection,), other) = found({"release_stability": rows})
    assert detection.step == 20
    assert other == {"release_stability"}


def test_two_hazards_of_one_property_are_found_apart():
    hazards = (DROPPED, Hazard("release_stability", ("bowl",), 10, 10))
    (first, second), _ = found({"release_stability": [Violation(("bowl",), 20)]}, hazards)
    assert first.step is None
    assert second.step == 20
