"""Recordings written for viewers in 3D."""

from __future__ import annotations

import sys

import pytest

from tests.cli.test_show import bumped


def test_the_page_is_written_where_it_is_asked_for(safemanip, recorded, tmp_path):
    path = recorded(bumped())
    found = safemanip("replay", path)
    assert (found.status, found.out) == (0, "one.html\n")
    text = (tmp_path / "one.html").read_text()
    assert '"property":"collision_contact"' in text
    assert safemanip("replay", path, "-o", "deep/er/x.html").out == "deep/er/x.html\n"
    assert (tmp_path / "deep" / "er" / "x.html").read_text() == text


def test_a_recording_is_not_replaced_by_its_replay(safemanip, recorded):
    path = recorded(bumped())
    before = path.read_bytes()
    line = safemanip("replay", path, "-o", path).refusal
    assert line.endswith("is the name of a recording; name a .html file")
    assert path.read_bytes() == before


def test_parameters_decide_what_is_marked(safemanip, recorded, tmp_path):
    safemanip("replay", recorded(bumped()), "--params", "collision.force=50")
    assert '"findings":[]' in (tmp_path / "one.html").read_text()


def test_a_property_without_a_verdict_is_told(safemanip, recorded, monkeypatch):
    def fail(self, prop):
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr("pytest_safemanip.judge.Judge.judge", fail)
    found = safemanip("replay", recorded(), "--property", "collision_contact")
    assert found.status == 0
    assert "collision_contact is not shown, it has no verdict: ZeroDivisionError" in found.err


def test_where_nothing_can_be_written_it_is_one_line(safemanip, recorded, tmp_path):
    (tmp_path / "file").write_text("")
    line = safemanip("replay", recorded(), "-o", "file/x.html").refusal
    assert line.startswith("safemanip replay: error: file")


def test_without_rerun_the_remedy_is_told_before_anything_is_judged(safemanip, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    line = safemanip("rrd", "none.rollout").refusal
    assert "rerun-sdk: pip install '.[rerun]'" in line


def test_a_file_for_rerun_is_written(safemanip, recorded, tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    found = safemanip("rrd", recorded())
    assert (found.status, found.out, found.err) == (0, "one.rrd\n", "")
    assert (tmp_path / "one.rrd").read_bytes()[:4] in (b"RRF2", b"RRIO")
