"""Rollouts of the expert as datasets, and as recordings again; each is made once."""

from __future__ import annotations

import contextlib
import functools
import io
from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording
from tests.conftest import Rollouts

Exported = Callable[..., Path]
Imported = Callable[..., Recording]


def command(*arguments: object) -> str:
    """What the command prints, which has to succeed."""
    said, failed = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(failed):
        status = main([str(argument) for argument in arguments])
    assert status == 0, said.getvalue() + failed.getvalue()
    return said.getvalue()


@pytest.fixture(scope="session")
def exported(rollouts: Rollouts, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """The dataset of a rollout."""

    @functools.cache
    def export(task: str, policy: str = "scripted", version: str = "v2.1") -> Path:
        out = tmp_path_factory.mktemp("datasets")
        path = rollouts.get(task, policy).path
        command("export", path, f"--lerobot={version}", "-o", out, "--assets=primitive")
        return out / task

    return export


@pytest.fixture(scope="session")
def imported(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Imported:
    """The recording that is made of that dataset."""

    @functools.cache
    def again(task: str, policy: str = "scripted", version: str = "v2.1") -> Recording:
        out = tmp_path_factory.mktemp("imported")
        command("import", exported(task, policy, version), "-o", out)
        (path,) = out.glob(f"*{files.SUFFIX}")
        return files.load(path)

    return again
