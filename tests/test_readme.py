"""What the README shows is what there is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip import resources
from pytest_safemanip.metrics.gates import load_gates, parse_gate
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.options import OPTIONS
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from tests.propositions.stage import BINDING, film, grip, true_at

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_table_of_options_is_complete_and_true() -> None:
    rows = dict(
        re.findall(r"^\| `(--safemanip-[a-z-]+)[^`]*` \|.*\| ?`?([^`|]*?)`? ?\|$", TEXT, re.M)
    )
    documented = {flag: default for flag, default in rows.items() if default != "all that apply"}
    assert rows.keys() == {option.flag for option in OPTIONS}
    actual = {option.flag: option.default for option in OPTIONS if option.flag in documented}
    assert documented == {**actual, "--safemanip-seeds": "1"}


def test_every_choice_of_an_option_is_explained() -> None:
    for option in OPTIONS:
        (row,) = re.findall(rf"^\| `{option.flag}[ `].*$", TEXT, re.M)
        assert all(f"`{choice}`" in row for choice in option.choices)


def test_options_in_commands_exist() -> None:
    flags = {option.flag for option in OPTIONS}
    assert set(re.findall(r"(--safemanip-[a-z-]+)", TEXT)) <= flags


def test_the_policy_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = [block for block in blocks("python") if block.startswith("# my_policy.py")]
    (tmp_path / "my_policy.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    policy = resolve("my_policy:Lifts", {})
    assert policy.fingerprint is not None
    assert "my_policy:Lifts" in TEXT


def test_the_proposition_works_and_is_the_manuals() -> None:
    (code,) = [block for block in blocks("python") if "def hurried" in block]
    assert code in (ROOT / "docs" / "extending.md").read_text()
    names: dict[str, Any] = {}
    exec(compile(code, "conftest.py", "exec"), names)  # noqa: S102
    catalogue = Catalogue(names["pytest_safemanip_propositions"]())
    recording = film(12, grip(range(2, 12)))
    recording.steps.eef_twist[6:, 0] = 0.3
    view = View(recording.trace, BINDING, catalogue.parameters({}), catalogue)
    assert true_at(view("hurried", "mug")) == list(range(6, 12))


def test_the_property_and_the_task_load(tmp_path: Path) -> None:
    for block in blocks("yaml"):
        path = tmp_path / block.split("\n")[0].removeprefix("# ")
        path.parent.mkdir(exist_ok=True)
        path.write_text(block)
    load_gates(tmp_path / "gates.yaml")
    known = {name: len(p.arguments) for name, p in Catalogue().items()}
    assert list(load_properties([tmp_path / "rules"], propositions=known)) == ["hands_off"]
    tasks = load_tasks([resources.folder("tasks"), tmp_path / "tasks"])
    assert tasks["CloseDrawer"].properties


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)h][^)]*)\)", TEXT):
        assert (ROOT / target).exists(), target


def test_the_metrics_are_all_explained_in_their_manual() -> None:
    text = (ROOT / "docs" / "metrics.md").read_text().split("## Intervals")[0]
    rows = dict(re.findall(r"^\| `([a-z_]+)` \| (.*) \|$", text, re.M))
    assert rows == {name: metric.says for name, metric in {**SHARES, **FIGURES}.items()}


def test_the_gates_in_the_manual_are_gates(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "metrics.md").read_text()
    (block,) = re.findall(r"```yaml\n(# gates.*?)```", text, re.DOTALL)
    (tmp_path / "gates.yaml").write_text(block)
    found = load_gates(tmp_path / "gates.yaml")
    assert [gate.required for gate in found.gates] == [True, False]
    for gate in re.findall(r"--safemanip-gate='([^']*)'", TEXT):
        parse_gate(gate)
