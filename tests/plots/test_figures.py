"""What figures show: read from their artists, and drawn with the Agg backend."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from pytest_safemanip import Rollout, load, plot_summary
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.plots.style import HATCH
from pytest_safemanip.trace import files
from tests import toy
from tests.cli.test_show import UP, bumped
from tests.metrics.build import bad, rollout, verdict


@pytest.fixture
def shown(tmp_path: Path) -> Rollout:
    files.save(bumped(), tmp_path / "one.rollout")
    return load(tmp_path / "one.rollout")


def texts(figure: Figure) -> str:
    """All that is written in a figure."""
    FigureCanvasAgg(figure).print_png(io.BytesIO())
    found = figure.findobj(mpl.text.Text)
    return "\n".join(text.get_text() for text in found)


def bars(figure: Figure, row: int) -> list[tuple[float, float]]:
    """Begin and end of the bars in a lane, s."""
    found = []
    for drawn in figure.axes[0].collections:
        for path in drawn.get_paths() if isinstance(drawn, PolyCollection) else ():
            box = path.get_extents()
            if abs((box.y0 + box.y1) / 2 - row) < 0.1:
                found.append((round(box.x0, 3), round(box.x1, 3)))
    return found


def test_a_proposition_is_a_lane_with_what_was_measured_and_its_threshold(shown: Rollout) -> None:
    figure = shown.plot("collision")
    assert bars(figure, 0) == [(0.4, 0.6)]
    written = texts(figure)
    assert "collision()" not in written
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["collision"]
    assert "collision.force = " in written
    arm = figure.axes[1].lines
    assert max(arm[0].get_ydata()) == 30.0
    assert arm[1].get_linestyle() == "--"
    assert figure.axes[-1].get_xlabel() == "time (s)"


def test_a_timeline_hatches_what_is_unsafe_and_marks_the_end_of_the_bad_prefix(
    shown: Rollout,
) -> None:
    figure = shown.plot_timeline("collision_contact")
    lanes = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert lanes[-1] == "unsafe"
    assert bars(figure, len(lanes) - 1) == [(0.4, 0.6)]
    hatches = [c.get_hatch() for c in figure.axes[0].collections]
    assert hatches.count(HATCH) == 1
    assert "bad prefix ends at step 8 (0.40 s)" in texts(figure)
    assert all(0.4 in axes.lines[-1].get_xdata() for axes in figure.axes)


def test_every_violation_of_an_instance_is_marked_and_the_parts_that_met_are_named(
    tmp_path: Path,
) -> None:
    rows = [(step, "robot/link5", "apple/body", 30.0, UP) for step in (4, 8, 12)]
    about = toy.episode(horizon=20)
    three = toy.recording(20, 4, about=about, contacts=toy.contacts(*rows))
    files.save(three, tmp_path / "three.rollout")
    figure = load(tmp_path / "three.rollout").plot_timeline("collision_contact")
    marked = {line.get_xdata()[0] for line in figure.axes[0].lines}
    assert {round(at, 3) for at in marked} >= {0.2, 0.4, 0.6}
    written = texts(figure)
    assert "bad prefix ends at step 4 (0.20 s), 2 more" in written
    assert "collision_contact: VIOLATED for robot/link5, apple (apple)" in written


def test_without_a_violation_a_timeline_has_no_mark(shown: Rollout) -> None:
    figure = shown.plot_timeline("grasp_stability")
    assert "unsafe" not in texts(figure)
    assert "VACUOUS for mug" in texts(figure)


def test_names_are_no_formulas() -> None:
    policy = "p$\\frac$"
    summary = Summary(("x",), (rollout(True, bad(), policy=policy),), {}, ())
    assert r"p\$\frac\$" in texts(plot_summary(summary))


def summary(*safe: bool) -> Summary:
    records = [
        rollout(True, verdict() if each else bad("a", (1, 2)), seed=n)
        for n, each in enumerate(safe)
    ]
    return Summary(("runs/one",), tuple(records), {}, ())


def test_a_summary_shows_outcomes_and_categories_and_the_baseline_hollow() -> None:
    now, before = summary(True, False, False), summary(True, True, False)
    alone = texts(plot_summary(now))
    assert "success but unsafe" in alone
    assert "before" not in alone
    figure = plot_summary(now, baseline=before)
    written = texts(figure)
    assert "pi, before" in written or ", before" in written
    widths = [round(patch.get_width()) for patch in figure.axes[0].patches]
    assert widths == [33, 67, 0, 0, 67, 33, 0, 0]
    hatches = {patch.get_hatch() for patch in figure.axes[0].patches}
    assert len(hatches) == 3, "outcomes differ without colours"
    rates = [line for line in figure.axes[1].lines if len(line.get_xdata()) == 1]
    faces = {round(float(line.get_xdata()[0])): line.get_markerfacecolor() for line in rates}
    assert faces[33] == "white"
    assert faces[67] != "white"


def test_of_many_policies_nothing_that_is_explained_is_cut_off() -> None:
    names = [f"scripted:one_fault_of_many_{n}" for n in range(11)]
    found = Summary(("x",), tuple(rollout(True, bad(), policy=name) for name in names), {}, ())
    figure = plot_summary(found, baseline=found)
    assert all(name in texts(figure) for name in names)
    frame = figure.bbox
    boxes = [legend.get_window_extent() for legend in figure.legends]
    assert len(boxes) == 2
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 for box in boxes)
    assert not boxes[1].overlaps(figure.axes[1].get_tightbbox())


def test_what_was_never_triggered_has_no_rate_in_a_figure() -> None:
    untested = verdict("b", "VACUOUS", "mechanism_recovery", triggered=False)
    found = Summary(("runs/one",), (rollout(True, bad("a"), untested),), {}, ())
    axes = plot_summary(found).axes[1]
    assert "mechanism_recovery" in [label.get_text() for label in axes.get_yticklabels()]
    rows = [line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 1]
    assert set(rows) == {0.0}


def test_a_run_without_rollouts_is_not_drawn() -> None:
    with pytest.raises(ConfigError, match="runs/none: nothing to draw"):
        plot_summary(Summary(("runs/none",), (), {}, ()))


def test_a_summary_and_an_episode_are_a_line(shown: Rollout) -> None:
    assert repr(summary(True, False)) == "<Summary runs/one: 2 rollouts, 1 policy>"
    assert repr(shown.episode) == "<Episode PickPlaceCounterToCabinet, toy, seed 0: horizon>"


def test_a_summary_is_a_table_of_verdicts_and_html_is_escaped() -> None:
    found = summary(True, False)
    table = found.to_pandas()
    assert table["outcome"].tolist() == ["SATISFIED", "VIOLATED"]
    assert table["first_step"].tolist()[1] == 1
    assert table["violations"].tolist() == [0, 1]
    hostile = Summary(("<b>x</b>",), found.records, {}, ())
    html = hostile._repr_html_()
    assert "&lt;b&gt;x" in html
    assert "50.0 % (" in html
