"""What decides a verdict decides whether a run is accepted as a baseline."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip import provenance
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf import parse
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.release_gate import read_baseline
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Parameter, Proposition
from pytest_safemanip.report import document
from pytest_safemanip.run.plan import Extensions, make_plan
from pytest_safemanip.run.results import Results, error_data
from pytest_safemanip.spec.calls import PropositionCall
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.ranges import Range
from pytest_safemanip.spec.task import Task

TASK = "PickPlaceCounterToCabinet"
PROPERTY = """
id: far
category: housekeeping
title: The hand is never far
source: the house rules
for_each: o in objects
formula: G !far
atoms: {far: far(o)}
"""
FAR = """
from far_limits import limits

def window(parameters):
    return 0.0

def far(view, o):
    return view.far(o) > limits.LIMIT
"""


class User:
    """A folder with a proposition in two modules, a property that uses it, and a baseline."""

    def __init__(self, folder, defaults, monkeypatch):
        self.folder, self._patch = folder, monkeypatch
        self._settings = dataclasses.replace(
            defaults,
            policies=("hold",),
            tasks=(TASK,),
            properties=("grasp_stability", "far"),
            property_paths=(folder / "rules",),
            out=folder / "out",
        )
        for name, text in {
            "rules/far.yaml": PROPERTY,
            "far_off.py": FAR,
            "far_limits/__init__.py": "",
            "far_limits/limits.py": "LIMIT = 0.5\n",
        }.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text)
        self._patch.syspath_prepend(folder)

    def plan(self, **changed):
        """A run of the user's, with some settings changed."""
        module = importlib.import_module("far_off")
        limit = Parameter("far.limit", "m", 0.5, "for the test")
        far = Proposition("far", ("object",), module.window, (limit,), module.far)
        settings = dataclasses.replace(self._settings, **changed)
        return make_plan(settings, Extensions({"mine": Hold}, (far,), {}))

    def write_baseline(self):
        plan = self.plan()
        results = Results(plan.tasks, plan.properties)
        results.add(error_data(plan.cases[0], "it need not have a verdict"))
        found = document.summary(plan, results, measure_each(results.records))
        document.write(found, self.folder / "base" / "summary.json")

    def edit(self, file, text):
        """Append to a file of the user's."""
        with (self.folder / file).open("a") as whole:
            whole.write(text)
        return self.plan()

    def edit_package(self, file):
        """Work on a copy of the package in which one file is another."""
        copy = self.folder / "copy" / provenance.PACKAGE.name
        for part in document.JUDGING:
            source, target = provenance.PACKAGE / part, copy / part
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)
        with (copy / file).open("a") as whole:
            whole.write("# changed\n")
        plan = self.plan()
        self._patch.setattr(provenance, "PACKAGE", copy)
        return plan

    def change(self, kind, name, **changed):
        """Change one of the plan's properties or tasks."""
        plan = self.plan()
        known = getattr(plan, kind)
        return dataclasses.replace(
            plan, **{kind: {**known, name: dataclasses.replace(known[name], **changed)}}
        )

    def categorise(self, category, *attributes):
        """Give a category of objects other attributes."""
        plan = self.plan()
        known = {**plan.attributes, category: frozenset(attributes)}
        return dataclasses.replace(plan, attributes=known)

    def propose(self, **changed):
        """Change the proposition."""
        far = dataclasses.replace(self.plan().catalogue["far"], **changed)
        return dataclasses.replace(self.plan(), catalogue=Catalogue((far,)))

    def compare(self, plan):
        """Read the baseline for a run of this plan.

        Raises:
            ConfigError: if it is refused.
        """
        rollouts = [case.rollout for case in plan.cases]
        return read_baseline(self.folder / "base", rollouts, document.decisive(plan), {})


@pytest.fixture
def user(tmp_path, pytestconfig, monkeypatch):
    user = User(tmp_path, read_settings(pytestconfig), monkeypatch)
    user.write_baseline()
    yield user
    for name in ("far_off", "far_limits", "far_limits.limits"):
        sys.modules.pop(name, None)


GRASP = ("properties", "grasp_stability")
PROPERTY_FIELDS = {
    "ranges": (Range(("o",), "objects", having=("fragile",)),),
    "formula": parse("G obj_grasped"),
    "paper_formula": parse("G obj_grasped"),
    "atoms": {"stable_grasp": PropositionCall("obj_grasped", ("o",))},
    "trigger": parse("stable_grasp"),
    "deadline_s": 3.0,
    "severity": 3.0,
    "cost": 5.0,
    "discharged_by": "physics",
}
TASK_FIELDS = {
    "objects": ("obj", "other"),
    "enclosures": (),
    "exclusive_enclosures": ("cab",),
    "mechanisms": ("cab",),
    "placements": (),
    "skills": (),
    "transfers": (("obj", "cab"),),
    "tools": ("robot",),
    "open_at": {"cab": 0.5},
    "touch": {},
    "supports": {},
    "upright": ("obj",),
    "optional": ("obj",),
    "kitchen": "full",
    "object_groups": {"obj": ("mug",)},
    "params": {"collision.force": 0.1},
    "zones": {"near_cab": Zone("cab", 0.1)},
    "hot": ("obj",),
    "liquids": {"water": "obj"},
    "base": "OpenDrawer",
    "drawn": {"obj": ("mug",)},
    "staging": ({"kind": "open", "role": "cab", "openness": 0.5, "joint": ""},),
}
CODE = (
    "judge.py",
    "ltlf/monitor.py",
    "propositions/view.py",
    "spec/task.py",
    "spec/yamlfile.py",
    "trace/files.py",
)


def changes():
    """Each thing that decides a verdict: what a refusal calls it, what of it, and the change."""
    for file in CODE:
        yield f"code.{file.split('/')[0]}", file, lambda user, f=file: user.edit_package(f)
    for field, value in PROPERTY_FIELDS.items():
        change = {field: value}
        yield "properties.grasp_stability", field, lambda user, c=change: user.change(*GRASP, **c)
    for field, value in TASK_FIELDS.items():
        change = {field: value}
        yield f"tasks.{TASK}", field, lambda user, c=change: user.change("tasks", TASK, **c)
    for change in ({"semantics": "paper"}, {"stop": "horizon"}, {"horizon_scale": 0.5}):
        yield next(iter(change)), "", lambda user, c=change: user.plan(**c)
    for name in ("settled.speed", "far.limit"):
        yield f"parameters.{name}", "", lambda user, n=name: user.plan(params={n: 0.7})
    yield "attributes.egg", "erased", lambda user: user.categorise("egg")
    yield "attributes.apple", "added", lambda user: user.categorise("apple", "raw")
    for change in ({"arguments": ("fixture",)}, {"act": True}, {"sparse": True}):
        yield "propositions.far", next(iter(change)), lambda user, c=change: user.propose(**c)
    yield "propositions.far", "source", lambda user: user.edit("far_off.py", "# changed\n")
    yield "propositions.far", "import", lambda user: user.edit("far_limits/limits.py", "LIMIT = 1")
    yield "properties.far", "file", lambda user: user.edit("rules/far.yaml", "deadline_s: 3\n")


CHANGES = [pytest.param(name, change, id=f"{name}-{what}") for name, what, change in changes()]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_run_that_differs_in_what_decides_a_verdict_is_refused_by_name(user, name, change):
    with pytest.raises(ConfigError) as refused:
        user.compare(change(user))
    ((found, _, _),) = re.findall(r"([\w.]+) is (.+?) and ([^;]+);", str(refused.value))
    assert found == name
    assert str(refused.value).endswith(
        "judge the recordings of one again, with --safemanip-recordings"
    )


def test_the_same_run_is_accepted(user):
    assert user.compare(user.plan()).records


@pytest.mark.parametrize(
    "change",
    [
        lambda user: user.change(*GRASP, title="another title", source="elsewhere"),
        lambda user: user.change("tasks", TASK, sets=("mine",), not_grounded={"far": "why"}),
        lambda user: user.categorise("a category that the baseline never met", "raw"),
        lambda user: user.edit("rules/far.yaml", "# a comment\n"),
        lambda user: user.edit("unrelated.py", "LIMIT = 2\n"),
        lambda user: user.plan(
            violations="xfail", seeds=(0, 1), prompt="other words: {instruction}"
        ),
    ],
)
def test_what_decides_no_verdict_may_change(user, change):
    assert user.compare(change(user)).records


@pytest.mark.parametrize(("kind", "changed"), [(Property, PROPERTY_FIELDS), (Task, TASK_FIELDS)])
def test_every_field_that_decides_a_verdict_is_changed_above(kind, changed):
    known = {field.name for field in dataclasses.fields(kind)}
    assert known - {*document.NOT_DECISIVE[kind]} == {*changed}


def test_all_code_that_judges_is_hashed():
    judging = ("judge", "spec.properties", "spec.tasks", "spec.objects", "trace.files")
    package = provenance.PACKAGE.name
    imports = "; ".join(f"import {package}.{module}" for module in judging)
    script = f"{imports}; import sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    ).stdout.split()
    parts = {name.split(".")[1] for name in loaded if name.startswith(f"{package}.")}
    assert parts - {"decoding", "errors", "markup", "strategies"} == {
        Path(part).stem for part in document.JUDGING
    }


class Scaled:
    """A proposition's function may be an object."""

    def __call__(self, view, o):
        return view.far(o)


def decorated(function):
    return functools.wraps(function)(lambda *arguments: ~function(*arguments))


def test_a_proposition_may_be_any_callable_with_a_source_file(user):
    far = importlib.import_module("far_off").far
    for evaluate in (functools.partial(far), functools.cache(far)):
        assert user.compare(user.propose(evaluate=evaluate)).records
    for evaluate in (Scaled(), Scaled().__call__, decorated(far)):
        with pytest.raises(ConfigError, match=r"propositions\.far is \w{16} and \w{16};"):
            user.compare(user.propose(evaluate=evaluate))


@pytest.mark.parametrize("evaluate", [np.isfinite, eval("lambda view, o: view.far(o)")])  # noqa: S307
def test_a_proposition_without_a_source_file_cannot_be_compared(user, evaluate):
    with pytest.raises(ConfigError, match=r"propositions\.far is \w{16} and without a source file"):
        user.compare(user.propose(evaluate=evaluate))
