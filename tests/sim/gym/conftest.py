"""FrankaKitchen, the example of the documentation."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tests.docs.blocks import parse

pytest.importorskip("gymnasium_robotics", reason="the example's simulator is not installed")
PAGE = Path(__file__).parents[3] / "docs" / "backends.md"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the page shows."""
    place = tmp_path_factory.mktemp("franka")
    for block in parse(PAGE.read_text()):
        if block.path:
            (place / block.path).parent.mkdir(exist_ok=True)
            (place / block.path).write_text(block.code)
    return place


@pytest.fixture(scope="session")
def franka(folder: Path) -> Iterator[ModuleType]:
    """The backend that the page shows."""
    spec = importlib.util.spec_from_file_location("franka_kitchen", folder / "franka_kitchen.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]
