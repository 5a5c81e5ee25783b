"""The command in a folder of its own, in a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.trace import files
from tests import toy


class Result:
    """What the command said."""

    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err

    @property
    def refusal(self) -> str:
        """The one line that wrong usage is told in."""
        assert self.status == 4, self.err
        assert self.out == ""
        (line,) = self.err.splitlines()
        return line


Command = Callable[..., Result]


@pytest.fixture
def safemanip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Command:
    """Runs the command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)

    def run(*arguments: object) -> Result:
        status = main([str(argument) for argument in arguments])
        return Result(status, *capsys.readouterr())

    return run


@pytest.fixture
def recorded(tmp_path: Path) -> Callable[..., Path]:
    """Keeps a toy recording; gives its file."""

    def record(recording: toy.Recording | None = None, name: str = "one") -> Path:
        path = tmp_path / f"{name}.rollout"
        files.save(recording or toy.recording(), path)
        return path

    return record
