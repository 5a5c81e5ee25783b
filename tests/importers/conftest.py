"""An episode that was really simulated, as a file of robosuite's and as a recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_safemanip.importers.base import ImportOptions
from pytest_safemanip.importers.robosuite.importer import RobosuiteImporter
from pytest_safemanip.importers.source import Source
from pytest_safemanip.trace.recording import Recording
from tests.importers import world

Import = Callable[..., Recording]


@pytest.fixture(scope="session")
def played() -> world.Played:
    return world.play()


def import_one(path: Path, **options: object) -> Recording:
    """The recording of the only episode of a source."""
    chosen = ImportOptions(**options)  # type: ignore[arg-type]
    (episode,) = RobosuiteImporter().episodes(Source(path), chosen)
    return episode.record(lambda done, total: None)


@pytest.fixture(scope="session")
def lifted(played: world.Played, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The episode, imported."""
    return import_one(world.write(tmp_path_factory.mktemp("lift") / "demo.hdf5", played))
