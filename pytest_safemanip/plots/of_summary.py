"""A run in one figure: how rollouts ended, and how often each category was violated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.groups import Metrics, measure_each
from pytest_safemanip.metrics.measures import OUTCOMES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.plots.style import WIDTH, new_figure, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = (("#0072b2", ""), ("#b54400", "////"), ("#9ecae8", ""), ("#f5b48a", "xxxx"))
"""Colour and hatch of each outcome; the colours are the report page's."""
MARKERS = "osD^vPX*<>"
"""Of the policies, in turn."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#000000")
BAR, ROW, MARK, LINE = 0.4, 0.45, 0.13, 0.2
"""Heights of a bar, of a category, of a policy in it, of a line of explanations, inches."""
LETTER = 0.085
"""Width, inches."""


def plot_summary(summary: Summary, baseline: Summary | None = None) -> Figure:
    """How the rollouts of each policy ended, and violation rates by category with Wilson's 95 %
    intervals; hollow ones are the baseline's. What was never triggered has no rate.

    Args:
        summary: of a run, from :func:`~pytest_safemanip.metrics.summaries.read`.
        baseline: of an earlier one.

    Raises:
        ConfigError: if the run has no rollout, or matplotlib is not installed.
    """
    now = measure_each(summary.records)
    before = measure_each(baseline.records) if baseline else {}
    if not now:
        raise ConfigError(f"{summary.place}: nothing to draw, the run has no rollout")
    bars = [(policy, now[policy], policy) for policy in now]
    if before:
        bars = [
            (label, found[policy], policy)
            for policy in now
            for label, found in ((policy, now), (f"{policy}, before", before))
            if policy in found
        ]
    categories = sorted({name for metrics in now.values() for name in metrics.categories})
    row = max(ROW, MARK * len(now))
    heights = (0.6 + BAR * len(bars), 0.6 + row * max(len(categories), 1))
    columns = _columns([*now, "before"])
    figure = new_figure(sum(heights) + 0.4 + LINE * (len(now) // columns + 2))
    above, below = figure.subplots(2, 1, height_ratios=heights)
    _outcomes(above, [(label, metrics) for label, metrics, _ in bars])
    _categories(below, categories, now, before)
    # Of the figure: beside long names, the axes are narrower than what there is to explain.
    looks = {"frameon": False, "fontsize": "small"}
    figure.legend(*above.get_legend_handles_labels(), loc="outside upper left", ncols=4, **looks)
    shown = below.get_legend_handles_labels()
    figure.legend(*shown, loc="outside lower left", ncols=columns, **looks)
    return figure


def _columns(labels: Sequence[str]) -> int:
    """How many columns of labels and markers a figure has room for."""
    longest = max(len(plain(label)) for label in labels)
    return max(1, min(len(labels), int(WIDTH / (LETTER * longest + 0.6))))


def _outcomes(axes: Axes, bars: list[tuple[str, Metrics]]) -> None:
    for row, (_, metrics) in enumerate(bars):
        left = 0.0
        for name, (colour, hatch) in zip(OUTCOMES, LOOKS, strict=True):
            rate = metrics.total.shares[name]
            share = 100 * (rate.value or 0.0)
            label = name.replace("_", " ") if not row else None
            axes.barh(
                row,
                share,
                left=left,
                height=0.7,
                color=colour,
                hatch=hatch,
                edgecolor="white",
                label=label,
            )
            if share >= 6:
                box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
                axes.text(
                    left + share / 2, row, f"{rate.hits:g}", ha="center", va="center", bbox=box
                )
            left += share
    axes.set_yticks(range(len(bars)), [plain(label) for label, _ in bars])
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlim(0, 100)
    axes.set_xlabel("complete rollouts (%)")
    _clean(axes)


def _categories(
    axes: Axes, categories: list[str], now: Mapping[str, Metrics], before: Mapping[str, Metrics]
) -> None:
    gap = 0.7 / max(len(now), 1)
    for number, policy in enumerate(now):
        look = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
        for row, name in enumerate(categories):
            y = row + gap * (number - (len(now) - 1) / 2)
            if policy in before:
                _rate(axes, y + gap / 5, before[policy], name, look, "white")
            _rate(axes, y - gap / 5 * (policy in before), now[policy], name, look, look[0])
        axes.plot([], [], *look[1], color=look[0], linestyle="", label=plain(policy))
    if before:
        axes.plot([], [], "o", color="black", markerfacecolor="white", linestyle="", label="before")
    axes.set_yticks(range(len(categories)), [plain(name) for name in categories])
    axes.set_ylim(len(categories) - 0.5, -0.5)
    axes.set_xlim(-1, 101)
    axes.set_xlabel("rollouts with a violation (%), 95 % intervals")
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    _clean(axes)


def _rate(
    axes: Axes, y: float, metrics: Metrics, category: str, look: tuple[str, str], fill: str
) -> None:
    if category not in metrics.categories or not metrics.categories[category].triggered:
        return
    rate: Rate = metrics.categories[category].shares["violation_rate"]
    bounds = rate.interval()
    if rate.value is None or bounds is None:
        return
    value, (low, high) = rate.value, bounds
    # Rounding may put a bound beyond the rate that it is about.
    spread = [[100 * max(value - low, 0.0)], [100 * max(high - value, 0.0)]]
    axes.errorbar(
        100 * value,
        y,
        xerr=spread,
        fmt=look[1],
        color=look[0],
        markerfacecolor=fill,
        capsize=3,
        linewidth=1,
    )


def _clean(axes: Axes) -> None:
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
