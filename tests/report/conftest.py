"""A run on toy data, as reports see it; and a browser that shows them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from pytest_safemanip.judge import Finding, Verdict
from pytest_safemanip.ltlf import Outcome
from pytest_safemanip.ltlf.verdicts import PropertyOutcome
from pytest_safemanip.severity import Severity

OUTCOMES = {
    "VIOLATED": PropertyOutcome(Outcome.VIOLATED, False),
    "UNRESOLVED": PropertyOutcome(Outcome.UNRESOLVED, False),
    "SATISFIED": PropertyOutcome(Outcome.SATISFIED, False),
    "VACUOUS": PropertyOutcome(Outcome.SATISFIED, True),
}


def severity(margin: float | None = 1.0, fall: float = 0.0) -> Severity:
    return Severity(1.0, margin, 0.0, 80.0, 0.0, fall, 0.0)


def finding(first: int = 3, last: int = 4, **changed: Any) -> Finding:
    fields = {
        "entities": ("mug",),
        "first": first,
        "last": last,
        "duration_s": 0.05 * (last - first + 1),
        "reason": "bad prefix",
        "proof": "step 3 breaks it",
        "evidence": ("mug moved 40 mm",),
        "severity": severity(),
        "cost": 1.0 + 0.05 * (last - first),
    }
    return Finding(**{**fields, **changed})


def verdict(outcome: str = "SATISFIED", *findings: Finding, **changed: Any) -> Verdict:
    steps = {step for f in findings for step in range(f.first, f.last + 1)}
    fields = {
        "property_id": "grasp_stability",
        "outcome": OUTCOMES[outcome],
        "triggered": int(outcome != "VACUOUS"),
        "instances": 1,
        "findings": findings,
        "unsafe_steps": len(steps),
        "acting_steps": 6,
        "open": (),
        "formula": "G a",
    }
    return Verdict(**{**fields, **changed})


@pytest.fixture(scope="module")  # while it runs, no other test can have an event loop
def browser() -> Iterator[Any]:
    """Headless Chromium, which draws 3D without a GPU."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("needs a browser: apt-get install chromium")
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with api.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox", *software])
        yield found
        found.close()
