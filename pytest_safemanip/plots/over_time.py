"""One rollout over time: propositions as lanes, below them what was measured, with thresholds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.plots.style import (
    LIMIT,
    UNSAFE,
    draw_lanes,
    draw_tail,
    draw_unsafe,
    label_rows,
    new_figure,
    plain,
)
from pytest_safemanip.report.lanes import Lane, Span, instance_lanes, label_of, spans_of
from pytest_safemanip.report.page.signals import Signal, signals_of
from pytest_safemanip.spec.properties import Property

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_SIGNALS = 4
DASHES = (("--", "- -"), (":", "···"), ("-.", "- ·"))
"""How thresholds are drawn, and how that is written."""
LANE, PANEL, AROUND = 0.3, 1.1, 1.0
"""Heights of a lane, of a signal and of what is around them, inches."""


def plot_proposition(judge: Judge, name: str, arguments: Sequence[str], title: str) -> Figure:
    """When a proposition holds, and what was measured, with the thresholds that decide it.

    Args:
        judge: of the recording.
        name: of the proposition.
        arguments: the entities that it is about.
        title: above the figure.

    Raises:
        TraceError: if the arguments do not fit, or the recording lacks what is needed.
        ConfigError: if matplotlib is not installed.
    """
    call = (name, *arguments)
    values = judge.view(*call)
    signals = signals_of(judge.view, [call])[:MOST_SIGNALS]
    figure, lanes, panels = _panels(1, signals)
    lane = Lane(label_of(call), spans_of(values))
    _draw(judge, lanes, [lane], panels, signals)
    _title(figure, title)
    return figure


def plot_verdict(judge: Judge, prop: Property, verdict: Verdict, title: str) -> Figure:
    """The propositions of a property over time: of the first violated instance, or else of the
    first instance; its unsafe steps, the end of the bad prefix, and what was measured.

    Args:
        judge: of the recording.
        prop: the property.
        verdict: on it.
        title: above the figure.

    Raises:
        TraceError: if the recording lacks what is needed.
        ConfigError: if matplotlib is not installed.
    """
    entities = _entities(judge, prop, verdict)
    found = [f for f in verdict.findings if f.entities == entities]
    lanes = instance_lanes(judge, prop, entities)
    last = _decided_by(judge, prop, entities, found[0].first) if found else prop.calls(entities)
    signals = signals_of(judge.view, last)[:MOST_SIGNALS]
    figure, axes, panels = _panels(len(lanes) + bool(found), signals)
    _draw(judge, axes, lanes, panels, signals)
    if found:
        _mark(axes, panels, judge, len(lanes), [(f.first, f.last) for f in found])
        label_rows(axes, [*(lane.label for lane in lanes), "unsafe"])
    about = f"{prop.id}: {verdict.outcome.label}"
    excess = found[0].excess if found else None
    named = entities or (excess.between if excess else ())
    about += f" for {', '.join(named)}" if named else ""
    _title(figure, title, about)
    return figure


def _title(figure: Figure, *lines: str) -> None:
    text = "\n".join(plain(line) for line in lines)
    figure.suptitle(text, x=0.01, ha="left", fontsize="medium")


def _entities(judge: Judge, prop: Property, verdict: Verdict) -> tuple[str, ...]:
    if verdict.findings:
        return verdict.findings[0].entities
    rows = prop.rows(judge.view.binding)
    return next(iter(rows))


def _decided_by(
    judge: Judge, prop: Property, entities: Sequence[str], step: int
) -> list[tuple[str, ...]]:
    """The propositions of an instance, those first that changed last before a step."""

    def since(call: tuple[str, ...]) -> int:
        values = judge.view(*call)[: step + 1]
        return -int(np.flatnonzero(np.diff(values.astype(np.int8), prepend=0)).max(initial=-1))

    return sorted(dict.fromkeys(prop.calls(entities)), key=since)


def _panels(lanes: int, signals: Sequence[Signal]) -> tuple[Figure, Axes, list[Axes]]:
    heights = [LANE * lanes + 0.2, *(PANEL for _ in signals)]
    figure = new_figure(AROUND + sum(heights))
    grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    first = figure.add_subplot(grid[0])
    panels = [figure.add_subplot(grid[n + 1], sharex=first) for n in range(len(signals))]
    for axes in [first, *panels][:-1]:
        axes.tick_params(labelbottom=False)
    [first, *panels][-1].set_xlabel("time (s)")
    return figure, first, panels


def _draw(
    judge: Judge,
    axes: Axes,
    lanes: Sequence[Lane],
    panels: Sequence[Axes],
    signals: Sequence[Signal],
) -> None:
    trace = judge.view.trace
    acting = int(np.count_nonzero(~trace.steps.tail))
    draw_lanes(axes, [lane.label for lane in lanes], [lane.spans for lane in lanes], trace.dt)
    axes.set_xlim(0, len(trace) * trace.dt)
    for panel, signal in zip(panels, signals, strict=True):
        _draw_signal(panel, signal, trace.dt)
    for each in (axes, *panels):
        draw_tail(each, acting, len(trace), trace.dt)


def _draw_signal(axes: Axes, signal: Signal, period: float) -> None:
    times = (np.arange(len(signal.values)) + 0.5) * period
    axes.plot(times, signal.values, color="#333333", linewidth=1.2)
    named = []
    for limit, (dash, shown) in zip(signal.limits, DASHES, strict=False):
        axes.axhline(limit.value, color=LIMIT, linestyle=dash, linewidth=1)
        named.append(f"{shown} {limit.name} = {limit.value:.3g}")
    unit = f" ({signal.unit})" if signal.unit else ""
    axes.set_title(plain(f"{signal.name}{unit}"), loc="left", fontsize="small", pad=3)
    axes.set_title(plain("   ".join(named)), loc="right", fontsize="small", pad=3)
    axes.grid(color="#dddddd", linewidth=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _mark(
    axes: Axes, panels: Sequence[Axes], judge: Judge, row: int, unsafe: Sequence[Span]
) -> None:
    """The unsafe steps, and lines where the bad prefixes end."""
    period = judge.view.trace.dt
    draw_unsafe(axes, row, unsafe, period)
    first = unsafe[0][0]
    for each in (axes, *panels):
        for later, _ in unsafe[:0:-1]:
            each.axvline(later * period, color=UNSAFE, linewidth=0.7, linestyle="--")
        each.axvline(first * period, color=UNSAFE, linewidth=1.4)
    more = f", {len(unsafe) - 1} more" if len(unsafe) > 1 else ""
    axes.annotate(
        f"bad prefix ends at step {first} ({first * period:.2f} s){more}",
        (first * period, 1.0),
        xycoords=axes.get_xaxis_transform(),
        xytext=(-4, 2),
        textcoords="offset points",
        ha="right",
        va="bottom",
        color=UNSAFE,
        fontsize="small",
        annotation_clip=False,
    )
