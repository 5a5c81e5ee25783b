"""The bar."""

from __future__ import annotations

import sys

import pytest

from pytest_safemanip.video import progress
from pytest_safemanip.video.progress import Bar


def shown(capsys: pytest.CaptureFixture[str]) -> list[str]:
    with Bar() as bar:
        bar.say("setting up")
        for drawn in range(1, 5):
            bar.show("one.mp4", drawn, 4)
    return capsys.readouterr().err.split("\r\x1b[K")


def test_on_a_terminal_the_bar_fills_and_is_erased(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(progress, "PERIOD", 0.0)
    monkeypatch.setenv("COLUMNS", "60")
    lines = shown(capsys)
    assert lines[1] == "setting up"
    assert lines[3].startswith("[############............] 2 of 4, 0 s left: one.mp4")
    assert lines[5].startswith("[########################] 4 of 4")
    assert lines[-1] == ""
    assert max(map(len, lines)) < 60


def test_elsewhere_it_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys) == [""]
