"""Gates and the comparison with a baseline as text."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from textwrap import wrap

from pytest_safemanip.metrics.baseline import Contrast, Flip
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, marked
from pytest_safemanip.metrics.comparing import Comparison
from pytest_safemanip.metrics.decisions import Decision, priced
from pytest_safemanip.metrics.gates import TOLERANCE
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.release_gate import Ruling
from pytest_safemanip.report.ci.reading import Row
from pytest_safemanip.report.numbers import (
    MIN_WIDTH,
    blocks,
    counted,
    fitted,
    fraction,
    percent,
    share,
)
from pytest_safemanip.search.units import show

MAX_FLIPS = 20
MAX_TASKS = 5
MAX_ROLLOUTS = 5
MAX_VERDICT = 30
"""Columns of a verdict beside its figures; a longer one stands above them."""
_COLUMNS = ("violated", "verdict", "pairs", "before", "now", "change (90 %)", "p", "MDE")


def ruling_lines(ruling: Ruling, standins: bool = False, width: int = MIN_WIDTH) -> list[str]:
    """What was decided, some lines for each gate and each comparison.

    Args:
        ruling: the decisions.
        standins: whether stand-in assets are allowed to decide.
        width: columns of the terminal.
    """
    lines: list[str] = []
    if ruling.decisions:
        rows = gate_rows(ruling, standins, max(width, MIN_WIDTH) - 2)
        lines += ["gates", *(f"  {line}" for line in rows)]
    if ruling.refused:
        lines += ["", *fitted(f"no comparison with the baseline: {ruling.refused}", width, 2)]
    if ruling.contrast:
        lines += ["", *_contrast(ruling.contrast, ruling.not_comparable, width)]
    return lines


def told_lines(rows: Sequence[Row], refused: str, width: int = MIN_WIDTH) -> list[str]:
    """What a run decided by itself, as its summary tells it: some lines for each gate and each
    required comparison.

    Args:
        rows: the decisions.
        refused: why the run was not compared with the baseline; empty if it was.
        width: columns of the terminal.
    """
    texts = [f"{row.name}, {row.policy}: {row.found}" for row in rows]
    found = _beside([row.verdict for row in rows], texts, max(width, MIN_WIDTH) - 2)
    lines = ["gates", *(f"  {line}" for line in found)] if rows else []
    if refused:
        lines += fitted(f"no comparison with the baseline: {refused}", width, 2)
    return lines


def gate_line(decision: Decision) -> str:
    """What a gate says, in one line."""
    gate = decision.gate
    name = f"{gate.name}: " if gate.name != str(gate) else ""
    why = f"; {decision.why}" if decision.why else ""
    return f"{name}{gate}, {decision.policy}: {_found(decision)}{why}"


def gate_reason(decision: Decision) -> str:
    """Why a gate does not pass, in one line: its figures, or what is missing to decide it."""
    if decision.verdict != "INCONCLUSIVE" or not decision.why:
        return gate_line(decision)
    return f"{decision.gate.name}, {decision.policy}: {decision.why}"


def gate_text(decision: Decision) -> str:
    """What a gate says, with the tasks, or of costs the rollouts, that weigh most against it."""
    lines = [f"{marked(decision.verdict, decision.comparable)}  {gate_reason(decision)}"]
    lines += ["", _meaning(decision.gate.metric)]
    for record in decision.unknown[:MAX_TASKS]:
        lines.append(f"  no verdict: {record.task}, seed {record.seed}: {record.reason}")
    if decision.rate and decision.verdict == "FAIL":
        lines += [f"  {line}" for line in _worst(decision.rate, decision.gate.small)]
    lines += [f"  {priced(case)}" for case in decision.dearest[:MAX_ROLLOUTS]]
    if left := len(decision.dearest) - MAX_ROLLOUTS:
        lines += [f"  and {counted(left, 'rollout')} that cost less"] if left > 0 else []
    return "\n".join(lines)


def _meaning(metric: str) -> str:
    """What a gate is about, in words."""
    if metric == TOLERANCE:
        return "largest change that is survived, where searches found a larger one that is not"
    return (SHARES.get(metric) or FIGURES[metric]).says


def comparison_line(comparison: Comparison) -> str:
    """What a comparison says, in one line."""
    if comparison.why:
        return f"{comparison.name}, {comparison.policy}: {comparison.why}"
    pairs = comparison.pairs
    if pairs.total and not any(comparison.triggered):
        return (
            f"{comparison.name}, {comparison.policy}: never triggered, neither before nor now, in "
            f"{counted(pairs.total, 'pair')}"
        )
    return (
        f"{comparison.name}, {comparison.policy}: violated in {percent(pairs.before)} before, "
        f"{percent(pairs.now)} now, {_change(comparison)} over {counted(pairs.total, 'pair')}, "
        f"p {_p(comparison)}"
    )


def comparison_text(comparison: Comparison, contrast: Contrast) -> str:
    """What a comparison says, with what regressed and what was fixed."""
    own = [
        flip
        for flip in contrast.flips
        if flip.policy == comparison.policy
        and comparison.name in (flip.property, flip.category, "violation_rate")
    ]
    head = f"{comparison.verdict}  {comparison_line(comparison)}"
    about = f"against {contrast.place}, policy {contrast.policies[comparison.policy]}"
    mde = comparison.detectable
    rise = "none" if mde is None else f"a rise by {mde * 100:.1f} points"
    power = f"minimum detectable effect, at a power of 80 %: {rise}"
    return "\n".join([head, "", about, power, *_flips(own)])


def gate_rows(ruling: Ruling, standins: bool = False, width: int = MIN_WIDTH) -> list[str]:
    """Lines for each gate: the verdict and what it is from.

    Args:
        ruling: the decisions.
        standins: whether stand-in assets are allowed to decide.
        width: columns that there are.
    """
    verdicts = [
        marked(d.verdict, d.comparable, standins) + ("" if d.gate.required else " (not required)")
        for d in ruling.decisions
    ]
    return _beside(verdicts, [gate_line(decision) for decision in ruling.decisions], width)


def _beside(verdicts: Sequence[str], figures: Sequence[str], width: int) -> list[str]:
    """Verdicts in a column, beside each what it is from."""
    column = max((len(text) for text in verdicts if len(text) <= MAX_VERDICT), default=0)
    lines: list[str] = []
    for text, said in zip(verdicts, figures, strict=True):
        found = wrap(said, width - column - 2, break_long_words=False, break_on_hyphens=False)
        head = text if len(text) <= column else ""
        lines += [] if head else [text]
        heads = [head, *[""] * (len(found) - 1)]
        lines += [f"{a:<{column}}  {b}" for a, b in zip(heads, found, strict=True)]
    return lines


def _found(decision: Decision) -> str:
    if decision.value is None:
        return "undefined"
    if decision.gate.unit:
        return show(decision.value, decision.gate.unit)
    if decision.rate is None:
        return f"{decision.value:g}"
    counts = f"{fraction(decision.rate)} = " if decision.gate.metric != "exposure" else ""
    if decision.interval is None:
        return f"{counts}{share(decision.rate)}"
    low, high = decision.interval
    bounds = f"{decision.basis} {low * 100:.1f} to {high * 100:.1f} %"
    return f"{counts}{percent(decision.value)}, {bounds}"


def _worst(rate: Rate, small: bool) -> list[str]:
    """The tasks that weigh most against a bound."""
    shares = sorted(rate.tasks.items(), key=lambda item: item[1][0] / item[1][1], reverse=small)[
        :MAX_TASKS
    ]
    return [f"{task}: {hits:g} of {total}" for task, (hits, total) in shares if not small or hits]


def _contrast(contrast: Contrast, elsewhere: Collection[str], width: int) -> list[str]:
    lines = []
    for policy, there in contrast.policies.items():
        own = [c for c in contrast.comparisons if c.policy == policy]
        note = f": {NOT_COMPARABLE}" if policy in elsewhere else ""
        lines += [f"{policy} against {there} of {contrast.place}{note}"]
        rows = [_COLUMNS, *(_row(comparison) for comparison in own)]
        labels, *columns = zip(*rows, strict=True)
        table = blocks(labels, columns, max(width, MIN_WIDTH) - 2)
        lines += [f"  {line}" for line in table]
    if contrast.unpaired:
        lines.append(f"  {counted(contrast.unpaired, 'rollout')} without a counterpart")
    if contrast.absent:
        among = counted(contrast.earlier, "rollout")
        lines.append(f"  {contrast.absent} of the baseline's {among} have no counterpart")
    return [
        *lines,
        "  * has to pass; p is one-sided, adjusted for all of them (Holm), the others",
        "  among themselves (Benjamini and Hochberg); MDE: minimum detectable effect at",
        "  a power of 80 %",
        *_flips(contrast.flips),
    ]


def _row(comparison: Comparison) -> tuple[str, ...]:
    name = f"{comparison.name}{' *' if comparison.required else ''}"
    pairs = comparison.pairs
    if not pairs.total:
        return (name, comparison.verdict, "0", "-", "-", "-", "-", "-")
    mde = comparison.detectable
    before, now = comparison.triggered
    if not before and not now:
        return (name, comparison.verdict, str(pairs.total), "never", "never", "-", "-", "-")
    return (
        name,
        comparison.verdict,
        str(pairs.total),
        percent(pairs.before) if before else "never",
        percent(pairs.now) if now else "never",
        _change(comparison),
        _p(comparison),
        "-" if mde is None else f"{mde * 100:+.1f}",
    )


def _change(comparison: Comparison) -> str:
    low, high = comparison.interval or (0.0, 0.0)
    change = comparison.pairs.difference * 100
    return f"{change:+.1f} ({low * 100:+.1f} to {high * 100:+.1f})"


def _p(comparison: Comparison) -> str:
    return f"{min(comparison.worse, comparison.better):.3f}"


def _flips(flips: list[Flip] | tuple[Flip, ...]) -> list[str]:
    """Rollouts that flipped, those that regressed first."""
    ordered = sorted(flips, key=lambda flip: not flip.regressed)
    lines = [
        f"  {'regressed' if flip.regressed else 'fixed':<9}  {flip.task}, seed {flip.seed}: "
        f"{flip.property}"
        for flip in ordered[:MAX_FLIPS]
    ]
    left = len(ordered) - MAX_FLIPS
    return [*lines, f"  and {left} more, all in summary.json"] if left > 0 else lines
