"""What notebooks use."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pytest_safemanip
from pytest_safemanip import load, plot_timeline
from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.trace import files
from tests import toy
from tests.cli.test_show import bumped


@pytest.fixture
def path(tmp_path: Path) -> Path:
    files.save(bumped(), tmp_path / "one.rollout")
    return tmp_path / "one.rollout"


def test_five_lines_give_verdicts_signals_violations_and_a_table(path: Path) -> None:
    rollout = load(path)
    assert rollout.judge("collision_contact").outcome.label == "VIOLATED"
    assert rollout.signal("collision").nonzero()[0].tolist() == [8, 9, 10, 11]
    margin = rollout.margin("collision")
    assert (margin > 0).nonzero()[0].tolist() == [8, 9, 10, 11]
    assert rollout.robustness("collision_contact") == -margin.max()
    (violation,) = rollout.violations
    assert str(violation) == "collision_contact: bad prefix at step 8"
    table = rollout.to_pandas()
    assert len(table) == len(rollout.steps) == 20
    assert table["collision"].to_numpy().nonzero()[0].tolist() == [8, 9, 10, 11]
    assert table["unsafe: collision_contact"].sum() == 4
    assert (~table["acting"]).sum() == 4
    assert table["time_s"].iloc[-1] == pytest.approx(0.95)


def test_what_a_proposition_is_about_may_be_named_by_its_role(path: Path) -> None:
    rollout = load(str(path))
    np.testing.assert_array_equal(
        rollout.signal("settled", "obj"), rollout.signal("settled", "mug")
    )


def test_parameters_and_semantics_decide(path: Path) -> None:
    assert load(path, params={"collision.force": 50.0}).violations == ()
    assert load(path, semantics="paper").judge("collision_contact").findings


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda r: r.judge("colision_contact"), "did you mean 'collision_contact'"),
        (lambda r: r.signal("settle", "obj"), "unknown proposition 'settle'; did you mean"),
        (lambda r: r.signal("settled"), "settled: 0 arguments, expected object"),
        (lambda r: r.signal("settled", "mugg"), "no entity 'mugg'; did you mean 'mug'"),
        (lambda r: r.plot("settled", "nobody"), "no entity 'nobody'"),
    ],
)
def test_what_there_is_not_is_named(ask, message: str, path: Path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ConfigError, match=message):
        ask(load(path))


def test_what_cannot_be_loaded_is_named_with_its_place(tmp_path: Path, path: Path) -> None:
    with pytest.raises(TraceError, match=r"name one of the \.rollout files"):
        load(tmp_path)
    with pytest.raises(TraceError, match=r"none\.rollout"):
        load(tmp_path / "none.rollout")
    files.save(toy.recording(about=toy.episode(task="OwnTask")), path)
    with pytest.raises(ConfigError, match=r"one\.rollout: unknown task 'OwnTask'.*tasks="):
        load(path)
    files.save(bumped(), path)
    with pytest.raises(ConfigError, match="unknown proposition parameter"):
        load(path, params={"settled.sped": 1.0})


def test_a_notebook_shows_verdicts_and_nothing_in_them_is_markup(tmp_path: Path) -> None:
    hostile = "put <script>alert(1)</script> & 'quotes'\x1b[31m"
    about = toy.episode(instruction=hostile, horizon=20)
    recording = bumped()
    object.__setattr__(recording, "episode", about)
    files.save(recording, tmp_path / "one.rollout")
    rollout = load(tmp_path / "one.rollout")
    html = rollout._repr_html_()
    assert "<script" not in html
    assert "\x1b" not in html
    assert "&lt;script&gt;" in html
    assert "VIOLATED" in html
    found = rollout.judge("collision_contact")._repr_html_()
    assert "<td>8</td><td>11</td>" in found
    assert "G !(collision" in found
    assert "<th>for</th>" not in found  # of nobody in particular


def test_a_verdict_is_drawn_with_its_rollout(path: Path) -> None:
    rollout = load(path)
    figure = plot_timeline(rollout.judge("collision_contact"), rollout)
    assert figure._repr_png_()[:4] == b"\x89PNG"


def test_importing_the_package_loads_nothing(path: Path) -> None:
    code = (
        "import sys, pytest_safemanip; print('numpy' in sys.modules); "
        "pytest_safemanip.load; print('numpy' in sys.modules, 'matplotlib' in sys.modules, "
        "'pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True", "False", "False"]
    with pytest.raises(AttributeError, match="no attribute 'lode'"):
        pytest_safemanip.lode  # noqa: B018


def test_without_matplotlib_or_pandas_the_extra_is_named(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    monkeypatch.setitem(sys.modules, "pandas", None)
    rollout = load(path)
    with pytest.raises(ConfigError, match=r"matplotlib: pip install .*\[plots\]"):
        rollout.plot("settled", "obj")
    with pytest.raises(ConfigError, match=r"pandas: pip install .*\[plots\]"):
        rollout.to_pandas()
