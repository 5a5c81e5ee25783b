"""A run whose names are hostile, on disk."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.report.ci.reading import Run, read_run
from tests.metrics.build import rollout, verdict
from tests.metrics.test_summaries import document

HOSTILE = (
    "<script>alert('x')</script> \"q\" | `c` ``` [a](https://e.x) ![i](x) {0} ]]> %0A:: , @me "
    "\x1b[31mred\x1b[0m \u202eleft\nnew::error::line"
)
RULE = {
    "category": "c",
    "title": "Nothing is dropped",
    "source": "the house rules",
    "formula": "G !a",
    "file": "",
}


def found(**changed: Any) -> dict[str, Any]:
    """A violation as a summary has it."""
    return {
        "entities": ["mug"],
        "first": 12,
        "last": 13,
        "duration_s": 0.1,
        "reason": "bad prefix",
        "evidence": ["the mug fell 40 mm"],
        "severity": 1.5,
        "measured": {"margin": 1.0, "force": 0.0, "fall": 0.0, "speed": 0.0},
        "timeline": {"start": 6, "stride": 1, "lanes": {"a": "......##", "b": "#......."}},
        **changed,
    }


def violated(name: str = "a", *violations: dict[str, Any], seed: int = 0, **changed: Any) -> Any:
    """A rollout with one violated property."""
    own = verdict(name, "VIOLATED", "c", True, violations or [found()])
    return rollout(True, own, seed=seed, recording=f"recordings/T-p-seed{seed}.rollout", **changed)


def gate(**changed: Any) -> dict[str, Any]:
    """A decision as a summary has it."""
    return {
        "name": "violation_rate <= 0.1",
        "policy": "p",
        "gate": "violation_rate <= 0.1",
        "required": True,
        "verdict": "FAIL",
        "comparable": True,
        "value": 0.5,
        "hits": 1,
        "total": 2,
        "interval": None,
        "basis": "",
        "why": "",
        **changed,
    }


def written(folder: Path, records: list[Any], gates: list[Any] | None = None, **rules: Any) -> Run:
    """The run, read from the folder."""
    whole = document(records)
    names = sorted({name for record in records for name in record.properties})
    whole["properties"] = {name: {**RULE, **rules.get(name, {})} for name in names}
    if gates is not None:
        whole["release"] = {"gates": gates, "baseline": None, "refused": "", "not_comparable": {}}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "summary.json").write_text(json.dumps(whole))
    return read_run(folder)


@pytest.fixture
def make_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Run]:
    monkeypatch.chdir(tmp_path)
    return lambda *arguments, **rules: written(tmp_path / "out", *arguments, **rules)


@pytest.fixture
def hostile(make_run: Callable[..., Run]) -> Run:
    """Whatever a name may be in a summary that anybody wrote."""
    clean = HOSTILE.replace("\n", " ").replace("\x1b", "").replace("\u202e", "")
    strange = found(
        entities=[HOSTILE],
        reason=HOSTILE,
        evidence=[HOSTILE, "```"],
        timeline={"start": 0, "stride": 1, "lanes": {HOSTILE: "#."}},
    )
    return make_run(
        [violated(clean, strange, task=clean)],
        [gate(name=HOSTILE, gate=HOSTILE, policy=HOSTILE, why=HOSTILE)],
        **{clean: {"title": HOSTILE, "source": HOSTILE, "formula": HOSTILE, "file": f"../{clean}"}},
    )
