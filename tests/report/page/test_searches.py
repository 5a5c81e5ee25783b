"""Searches on the page: what is told of them, and what is refused."""

from __future__ import annotations

import copy

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.report.page.searches import searches

FOUND = {
    "task": "Reach",
    "policy": "weak",
    "property": "stays_near",
    "over": True,
    "seeds": 5,
    "violated_plain": 2,
    "rollouts": 24,
    "shrinking": 9,
    "trials": 33,
    "refused": 1,
    "failure": {
        "sentence": "fails stays_near when \x1b[31m the mug stands 4 cm nearer",
        "found_at": 24,
        "first_changes": 5,
        "changes": [{"move": "obj"}],
        "margin": -12.0,
        "severity": 2.5,
        "kept": "regressions/a.yaml",
    },
    "margins": [0.5, None, 1000.0, -12.0],
    "tolerances": [{"dimension": "left", "unit": "cm", "survived": 3.5, "failed": 4.0}],
    "looked_at": [{"dimension": "left", "unit": "cm", "regions": {"-10 to 0": 3, "0 to 10": 4}}],
}


def told(*found):
    return searches(Fields("summary.json", {"searches": list(found)}))


def test_failures_come_first_and_margins_fit_into_a_bar():
    survived = {**FOUND, "property": "grasp_stability", "failure": None}
    first, second = told(survived, FOUND)
    assert (first["property"], second["failure"]) == ("stays_near", None)
    assert first["margins"] == [0.5, None, 1.0, -1.0]
    assert first["tolerances"] == [{"dimension": "left", "survived": "3.5 cm", "failed": "4 cm"}]
    assert first["looked_at"][0]["regions"] == [["-10 to 0", 3], ["0 to 10", 4]]
    assert "\x1b" not in first["failure"]["sentence"]


def test_without_searches_there_is_nothing():
    assert searches(Fields("summary.json", {})) == []


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("margins",), ["1"]),
        (("margins",), [True]),
        (("rollouts",), -1),
        (("over",), "yes"),
        (("tolerances", 0, "unit"), "ells"),
        (("tolerances", 0, "survived"), None),
        (("looked_at", 0, "regions"), {"a": 1.5}),
        (("failure", "margin"), "low"),
        (("failure", "found_at"), 0.5),
    ],
)
def test_what_a_stranger_wrote_is_refused_with_its_place(path, value):
    document = copy.deepcopy(FOUND)
    inner = document
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    with pytest.raises(ConfigError, match=r"summary.json: searches\[0\].*" + str(path[-1])):
        told(document)
