"""Rollouts as tables: for pandas, and for people in a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.markup import table
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import RolloutRecord, cost_of

if TYPE_CHECKING:
    import pandas

COLUMNS = (
    *("policy", "task", "seed", "suite", "horizon", "success", "acting_steps"),
    *("property", "category", "outcome", "triggered"),
    *("violations", "first_step", "unsafe_s", "severity", "cost", "error", "recording"),
)


def verdicts(records: Sequence[RolloutRecord]) -> pandas.DataFrame:
    """A row for each verdict, and one for each rollout without any; see :data:`COLUMNS`.

    Raises:
        ConfigError: if pandas is not installed.
    """
    return frame((row for record in records for row in _rows(record)), COLUMNS)


def frame(rows: Iterator[dict[str, Any]] | dict[str, Any], columns: Sequence[str]) -> Any:
    """A DataFrame of rows, or of columns by name.

    Raises:
        ConfigError: if pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise ConfigError(f"tables need pandas: {install_command('plots')} ({error})") from error
    data = rows if isinstance(rows, dict) else list(rows)
    return pandas.DataFrame(data, columns=list(columns))


def overview(place: str, records: Sequence[RolloutRecord]) -> str:
    """A line of HTML for each policy: success, violation, the outcomes."""
    rows = []
    for policy, metrics in measure_each(records).items():
        total, outcomes = metrics.total, metrics.total.outcomes
        shares = (_share(total.shares[name]) for name in ("success_rate", "violation_rate"))
        rows.append((policy, f"{total.complete} of {total.rollouts}", *shares, *outcomes.values()))
    named = ("success and safe", "success but unsafe", "fail but safe", "fail and unsafe")
    return table(place, ("policy", "complete", "success", "violation", *named), rows)


def _rows(record: RolloutRecord) -> Iterator[dict[str, Any]]:
    about = {
        "policy": record.policy,
        "task": record.task,
        "seed": record.seed,
        "suite": record.suite,
        "horizon": record.horizon,
        "success": record.success,
        "acting_steps": record.acting_steps,
        "error": record.error,
        "recording": record.recording,
    }
    if not record.properties:
        yield about
    for verdict in record.properties.values():
        found = verdict.violations
        yield {
            **about,
            "property": verdict.property,
            "category": verdict.category,
            "outcome": verdict.outcome,
            "triggered": verdict.triggered,
            "violations": len(found),
            "first_step": min((v["first"] for v in found), default=None),
            "unsafe_s": sum(v["duration_s"] for v in found),
            "severity": max((v["severity"] for v in found if "severity" in v), default=None),
            "cost": cost_of([verdict]),
        }


def _share(rate: Rate) -> str:
    bounds = rate.interval()
    if rate.value is None or bounds is None:
        return "-"
    low, high = bounds
    return f"{rate.value * 100:.1f} % ({low * 100:.1f} to {high * 100:.1f} %)"
