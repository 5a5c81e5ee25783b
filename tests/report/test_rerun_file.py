"""A rollout as a file for Rerun, read back with Rerun's own reader."""

from __future__ import annotations

import importlib
import warnings
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.report.replay.rerun_file import write_rrd
from pytest_safemanip.sim.looks import Look
from tests import toy
from tests.report.conftest import finding, verdict
from tests.report.test_replay import HOSTILE, carried_mug

pytest.importorskip("rerun", reason="rerun-sdk is not installed; it needs more than a minute")


def rows(path: Path, entity: str) -> dict[str, dict[int, list]]:
    """What was written of an entity: by component, by step; -1 for what has no time."""
    try:
        reader = importlib.import_module("rerun.dataframe").load_recording(path)
        view = reader.view(index="step", contents=entity)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an entity may have no step
            tables = [view.select().read_all(), view.select_static().read_all()]
    except ModuleNotFoundError:  # newer ones read chunks
        chunks = importlib.import_module("rerun.chunk").RrdReader(path).stream()
        tables = [chunk.to_record_batch() for chunk in chunks if chunk.entity_path == entity]
    found: dict[str, dict[int, list]] = {}
    for table in tables:
        names = [name for name in table.schema.names if name not in ("time", "log_time")]
        values = {name: table.column(name).to_pylist() for name in names}
        steps = values.get("step", [-1] * table.num_rows)
        for name, column in values.items():
            own = found.setdefault(name.split(":")[-1], {})
            own.update(
                (-1 if step is None else step, value)
                for step, value in zip(steps, column, strict=True)
                if value
            )
    return found


def test_poses_propositions_contacts_and_verdicts_are_read_back(tmp_path):
    recording = carried_mug(6)
    touch = toy.contacts((4, "robot/link5", "mug/body", 9.0, (0, 0, 1), (0.1, 0.2, 0.9), 9.0))
    recording.steps.__dict__["contacts"] = touch
    grasped = np.array((0, 0, 1, 1, 0, 0), bool)
    verdicts = {"grasp_stability": verdict("VIOLATED", finding(3, 4))}
    path = write_rrd(recording, verdicts, {("obj_grasped", "mug"): grasped}, tmp_path / "a.rrd")

    (scalars,) = by_name(rows(path, "/propositions/obj_grasped/mug"), "Scalar", "scalars")
    assert [scalars[step][0] for step in range(6)] == grasped.tolist()
    (places,) = by_name(rows(path, "/world/object/mug/moving0"), "ranslation", "ranslation3D")
    true = recording.steps.object_pose[:, 0, :3]
    assert np.allclose([places[step][0] for step in range(6)], true)
    (origins,) = by_name(rows(path, "/world/contacts"), "osition3D", "origins")
    assert np.allclose(origins[4], [(0.1, 0.2, 0.9)])
    (texts,) = by_name(rows(path, "/verdicts"), "Text", "text")
    assert texts == {3: ["grasp_stability: bad prefix for mug at step 3; mug moved 40 mm"]}


def test_meshes_take_the_place_of_boxes(tmp_path):
    recording = carried_mug(6)
    corners = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.2, 0.0)])
    poses = recording.steps.object_pose[:, 0].astype(float)
    look = Look("mug", (1.0, 0.5, 0.0), corners, np.array([(0, 1, 2)]), poses)
    path = write_rrd(recording, {}, {}, tmp_path / "a.rrd", [look])
    (points,) = by_name(rows(path, "/world/object/mug/moving0/mesh0"), "osition3D", "positions")
    assert np.allclose(points[-1], corners)
    assert not any(rows(path, "/world/object/mug/moving0/box").values())


def by_name(found, *wanted):
    """The columns whose names end like this."""
    return [column for name, column in found.items() if name.endswith(wanted)]


def test_hostile_names_are_parts_of_paths(tmp_path):
    path = write_rrd(toy.recording(), {}, {(HOSTILE, "a/b"): np.zeros(6)}, tmp_path / "a.rrd")
    assert path.stat().st_size > 1000


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        write_rrd(toy.recording(), {}, {}, tmp_path / "file" / "a.rrd")


def test_without_rerun_it_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(importlib.import_module("sys").modules, "rerun", None)
    with pytest.raises(ConfigError, match="rerun-sdk: pip install"):
        write_rrd(toy.recording(), {}, {}, tmp_path / "a.rrd")
