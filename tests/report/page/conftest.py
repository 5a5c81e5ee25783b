"""The folder of a run of real rollouts, and its page in a browser."""

from __future__ import annotations

import json
import os
import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.metrics.gates import Gates, parse_gate
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.release_gate import ReleaseGate
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.report import document
from pytest_safemanip.report.page.writing import write_page
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Extensions, Plan, make_plan
from pytest_safemanip.run.results import Results, judged_data
from tests.conftest import Rollouts

TASK = "PickPlaceCounterToCabinet"
POLICIES = ("scripted", "scripted:half_inside", "scripted:drop_high")


class RunFolder:
    """A run's folder, as pytest leaves it.

    Attributes:
        path: of the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def summary(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads((self.path / "summary.json").read_text())
        return found

    def rollout(self, policy: str) -> dict[str, Any]:
        (found,) = [own for own in self.summary["rollouts"] if own["policy"] == policy]
        return dict(found)

    def copy(self, path: Path) -> RunFolder:
        """The same elsewhere, to be changed."""
        shutil.copytree(self.path, path, copy_function=os.link)
        (path / "summary.json").unlink()
        shutil.copy(self.path / "summary.json", path)
        return RunFolder(path)

    def change(self, summary: dict[str, Any]) -> None:
        (self.path / "summary.json").write_text(json.dumps(summary))

    def page(self) -> str:
        return write_page(self.path).read_text()


@pytest.fixture(scope="session")
def run_folder(
    rollouts: Rollouts, tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> RunFolder:
    """One seed of three policies, a gate, and a baseline of the same run with nothing violated."""
    folder = tmp_path_factory.mktemp("page") / "out"
    settings = replace(
        read_settings(pytestconfig), policies=POLICIES, tasks=(TASK,), seeds=(0,), out=folder
    )
    plan = make_plan(settings, Extensions({}, (), {}))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    rollouts.put_into(folder, *((TASK, policy) for policy in POLICIES))
    for case in plan.cases:
        rollout = rollouts.get(case.task, case.policy, case.seed)
        prop, path = plan.properties[case.property_id], folder / "recordings" / rollout.path.name
        found = rollout.verdict(case.property_id)
        results.add(judged_data(case, prop, found, rollout.recording, path))
    content = document.summary(plan, results, measure_each(results.records))
    content["release"] = _ruling(plan, results)
    invocation = Invocation(folder, ("--safemanip-params=settled.speed=0.02",), time.time() - 90.0)
    content["run"] = invocation.to_json()
    document.write(content, folder / "summary.json")
    return RunFolder(folder)


def _ruling(plan: Plan, results: Results) -> dict[str, Any]:
    """With a baseline in which the first policy's rollout stands for each."""
    run = document.as_summary(plan, results)
    safe = run.records[0]
    earlier = tuple(replace(safe, policy=policy) for policy in POLICIES)
    baseline = Summary(("runs/main",), earlier, run.decisive, run.origins)
    gates = Gates((parse_gate("violation_rate <= 30 % @0.95"),))
    return ReleaseGate(gates, baseline).rule(run).to_json()


@pytest.fixture
def copied(run_folder: RunFolder, tmp_path: Path) -> RunFolder:
    """A copy that a test may change."""
    return run_folder.copy(tmp_path / "out")


@pytest.fixture(scope="session")
def page_file(run_folder: RunFolder) -> Path:
    """The page of the run."""
    return write_page(run_folder.path)
