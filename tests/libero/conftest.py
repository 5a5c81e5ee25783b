"""LIBERO's own files, and its simulator where somebody has it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from filelock import FileLock

from pytest_safemanip.sim.backend import Options
from pytest_safemanip.sim.libero.suites import TaskFiles, find_tasks
from tests.libero.wheel import unpacked

PYTHON, ASSETS = "SAFEMANIP_LIBERO_PYTHON", "SAFEMANIP_LIBERO_ASSETS"


@pytest.fixture(scope="session")
def libero_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of hf-libero's files; one download for all processes of a test run."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = shared / "hf-libero"
    folder.mkdir(exist_ok=True)
    with FileLock(folder / "lock"):
        return unpacked(folder)


@pytest.fixture(scope="session")
def shipped(libero_files: Path) -> dict[str, TaskFiles]:
    """All of LIBERO's tasks."""
    return find_tasks(libero_files)


@pytest.fixture(scope="session")
def simulator_options(tmp_path_factory: pytest.TempPathFactory) -> Options:
    """What LIBERO's simulator is made with, where this machine has it and its assets."""
    if PYTHON not in os.environ or ASSETS not in os.environ:
        pytest.skip(f"needs {PYTHON}, an interpreter with LIBERO, and {ASSETS}, its assets")
    logs = tmp_path_factory.mktemp("logs")
    return Options("official", logs, os.environ[PYTHON], {"assets": Path(os.environ[ASSETS])})
