from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.faults.fault import Family
from pytest_safemanip.faults.library import FAMILIES, FAULTS, find
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.resources import folder
from pytest_safemanip.sim.staging import SetOpen
from pytest_safemanip.spec.tasks import load_tasks


@pytest.mark.parametrize("family", FAMILIES.values(), ids=list(FAMILIES))
@pytest.mark.parametrize("end", ["low", "high"])
def test_both_ends_of_a_family_are_events_of_a_task_that_has_its_property(family: Family, end: str):
    name = f"{family.name}@{getattr(family, end):g}"
    (task,) = Scripted(name).tasks
    assert find(name).property_id in load_tasks([folder("tasks")])[task].properties


def test_the_number_is_what_is_done():
    (staging,) = find("ajar@0.7").staging.values()
    assert staging.changes == (SetOpen("cab", 0.7),)


def test_only_what_is_done_in_its_module_counts_for_its_recordings():
    near, far = Scripted("drop@0.01"), Scripted("low_drop")
    (task,) = near.tasks
    assert near.fingerprint_in(task) != far.fingerprint_in(task)
    assert near.fingerprint_in(task) == Scripted("drop@0.02").fingerprint_in(task)


@pytest.mark.parametrize("number", ["9", "-1", "nan", "much"])
def test_a_number_outside_the_family_is_refused_with_its_range(number: str):
    with pytest.raises(ConfigError, match=r"drop@.*expected a number from 0.003 to 0.12 m"):
        Scripted(f"drop@{number}")


def test_a_family_without_a_number_is_no_fault():
    assert not FAMILIES.keys() & FAULTS.keys()
    says = r"scripted:drop: expected a number from 0.003 to 0.12 m, as in drop@0.12"
    for name in ("drop", "drop@"):
        with pytest.raises(ConfigError, match=says):
            Scripted(name)
