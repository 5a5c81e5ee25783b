from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.faults.catalogue import read
from pytest_safemanip.sim.staging import Put, SetOpen

SHARED = {
    "task": "OpenDrawer",
    "variables": {"round": ["apple", "orange"]},
    "stagings": {"ajar": {"changes": [{"open": "$role", "to": "$open"}]}},
}


def entries(text, section="drops"):
    """The faults of a section of release_stability's catalogue."""
    indented = "\n".join(f"    {line}" for line in text.splitlines())
    text = f"{section}:\n  some:\n{indented}"
    return [found for _, found in read("release_stability", text, SHARED)]


def test_a_fault_is_its_entry_and_what_its_tasks_say():
    (fault,) = entries(
        """
fault: drops it
plan: {at_edge: {inside: $inside}}
staging: {ajar: {open: 1}}
variables: {inside: 0.5}
tasks: {OpenDrawer: {role: drawer}, OpenCabinet: {role: fxtr, inside: 0.25}}
"""
    )
    assert (fault.property_id, fault.doc, fault.near_miss) == (
        "release_stability",
        "drops it",
        False,
    )
    assert [plan.keywords for plan in fault.plans.values()] == [{"inside": 0.5}, {"inside": 0.25}]
    assert fault.staging["OpenCabinet"].changes == (SetOpen("fxtr", 1.0),)


def test_a_scene_has_changes_of_others_and_things_on_the_counter():
    (fault,) = entries(
        """
near_miss: puts it down
plan: on_block
variables: {role: cab, open: 0.5}
staging: {changes: [ajar, {put: obj, below: cab, at: [1, 0.5]}], objects: {obj: $round}}
"""
    )
    staging = fault.staging["OpenDrawer"]
    assert staging.changes == (SetOpen("cab", 0.5), Put("obj", "in", "cab", (1.0, 0.5, -0.56)))
    assert staging.objects == {"obj": ("apple", "orange")}
    assert fault.near_miss


def test_a_near_miss_is_as_the_fault_before_it_but_is_told_that_it_is_safe():
    text = """
burners:
  light:
    fault: lights it
    plan: {light_under: {role: obj}}
    staging: {ajar: {role: cab, open: 0.5}}
    tasks: KettleBoiling
  light_safely:
    near_miss: lights it safely
"""
    fault, near = (found for _, found in read("action_onset", text, SHARED))
    assert fault.plans["KettleBoiling"].keywords == {"role": "obj", "unsafe": True}
    assert near.plans["KettleBoiling"].keywords == {"role": "obj", "unsafe": False}
    assert near.staging == fault.staging
    assert (fault.near_miss, near.near_miss) == (False, True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("drops: {", "not valid YAML: .* line "),
        ("drops: {some: }", "some: the entry: expected keys with values, found None"),
        ("", "the file: expected keys with values, found None"),
        ("drops:", "drops: expected keys with values, found None"),
        ("drops: {a: {}, a: {}}", "not valid YAML: 'a' is there twice"),
        ("drosp: {some: {fault: drops it, plan: on_block}}", "some: its section is named 'drosp'"),
    ],
)
def test_what_is_no_yaml_no_entry_or_in_no_modules_section_is_refused(text, message):
    with pytest.raises(ConfigError, match=rf"release_stability/faults.yaml: {message}"):
        list(read("release_stability", text, SHARED))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("fault: drops it\nplan: drop_hihg", "drops.py has no plan 'drop_hihg'; did you mean"),
        ("fault: drops it\nplan: {at_edge: {outside: 1}}", "unknown 'outside'"),
        ("fault: drops it\nplan: {at_edge: {inside: $far}}", r"unknown variable \$far"),
        ("fault: drops it\nplan: on_block\nstaging: ajra", "unknown staging 'ajra'; did you mean"),
        (
            "fault: drops it\nplan: on_block\nstagign: ajar",
            "unknown 'stagign'; did you mean 'staging'",
        ),
        (
            "fault: drops it\nplan: on_block\nstaging: {changes: [{open: cab}]}",
            "changes of an episode: .*openness",
        ),
        ("plan: on_block", "say its plan, and what it does, as either a fault or a near_miss"),
        ("fault: drops it", "say its plan, "),
        ("fault: drops it\nplan: [at_edge, 1]", "plan: expected keys with values"),
        ("fault: drops it\nplan: {at_edge: {}, on_block: {}}", "plan: expected one name"),
        ("fault: drops it\nplan: {at_edge: 1}", "plan: at_edge: expected keys with values"),
        ("fault: drops it\nplan: at_edge", "plan at_edge: missing a required argument: 'inside'"),
        ("fault: drops it\nplan: {take: {role: obj}}", "drops.py has no plan 'take'"),
        ("fault: drops it\nplan: on_block\nstaging: 3", "staging: expected keys with values"),
        ("fault: drops it\nplan: on_block\ntasks: 3", "tasks: expected a task, a list or"),
        ("fault: drops it\nplan: on_block\nnumber: {of: a}", "a family is a fault whose number"),
        ("fault: drops it\nplan: on_block\nstaging: {objects: {o: apple}}", "objects: o: expected"),
    ],
)
def test_what_is_not_known_or_lacks_is_refused_with_its_file_and_fault(text, message):
    with pytest.raises(ConfigError, match=rf"release_stability/faults.yaml: some: {message}"):
        entries(text)
