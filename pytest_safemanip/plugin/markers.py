"""Markers and labels of cases, for ``-m`` and for Allure."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import pytest

from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan


class CaseMarkers:
    """The markers of cases: ``safemanip``, the property's category, the task's suite.

    Names that are no identifiers are left out, and those of markers that take arguments: pytest's
    own, or another plugin's, as ``timeout``. They do something.

    Args:
        config: pytest's; the markers are registered in it.
        plan: what is run.
    """

    def __init__(self, config: pytest.Config, plan: Plan) -> None:
        self._plan = plan
        cases = plan.cases
        categories = {plan.properties[case.property_id].category for case in cases}
        suites = {plan.tasks[case.task].suite for case in cases}
        categories, suites = _markable(categories), _markable(suites)
        for name in sorted(categories):
            config.addinivalue_line("markers", f"{name}: safety cases of this category")
        for name in sorted(suites - categories):
            config.addinivalue_line("markers", f"{name}: safety cases on tasks of this suite")
        self._config, self._known = config, {"safemanip", *categories, *suites}
        self._markers: dict[str, pytest.MarkDecorator] = {}

    @cached_property
    def _names(self) -> set[str]:
        """What cases are marked with: looked up when all plugins have registered theirs."""
        registered = (line.partition(":")[0] for line in self._config.getini("markers"))
        return self._known - {name.partition("(")[0] for name in registered if "(" in name}

    def of(self, case: Case) -> list[pytest.MarkDecorator]:
        """The markers of a case."""
        category = self._plan.properties[case.property_id].category
        names = dict.fromkeys(("safemanip", category, self._plan.tasks[case.task].suite))
        return [self._shared(name) for name in names if name in self._names]

    def _shared(self, name: str) -> pytest.MarkDecorator:
        """The same marker for all cases: one for each would be a third of what a case takes."""
        if name not in self._markers:
            self._markers[name] = getattr(pytest.mark, name)
        return self._markers[name]


def _markable(names: Iterable[str]) -> set[str]:
    return {n for n in names if n.isidentifier() and not n.startswith("_")}


def label_for_allure(item: pytest.Item, case: Case, category: str) -> None:
    """Give an item what allure-pytest reads: labels, and parameters that tell cases apart.

    The marker is registered by allure-pytest: only where it writes a report, and only after
    collection, when pytest has no more use for ``callspec``.
    """
    labels = {
        "parentSuite": "safemanip",
        "suite": case.policy,
        "subSuite": case.task,
        "feature": category,
        "story": case.property_id,
        "task": case.task,
        "policy": case.policy,
        "category": category,
    }
    for label_type, value in labels.items():
        item.add_marker(pytest.mark.allure_label(value, label_type=label_type))
    parameters: dict[str, Any] = {
        "task": case.task,
        "policy": case.policy,
        "property": case.property_id,
        "seed": case.seed,
    }
    vars(item)["callspec"] = SimpleNamespace(params=parameters, id=case.name)
