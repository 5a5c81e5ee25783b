"""Datasets that anybody may have written: what is corrupt or hostile is refused by name."""

from __future__ import annotations

import gzip
import io
import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.errors import SafemanipError, TraceError
from pytest_safemanip.importers.lerobot import table as tables
from pytest_safemanip.importers.lerobot.table import Table
from pytest_safemanip.lerobot import extras, layout
from pytest_safemanip.lerobot.conventions import (
    ACTION,
    STATE,
    action_order,
    modality,
    to_dataset,
    to_environment,
)
from pytest_safemanip.lerobot.extras import Extras
from pytest_safemanip.lerobot.parquet import write_columns, write_table
from pytest_safemanip.lerobot.writing import DatasetWriter, Rows
from pytest_safemanip.sim.mujoco import strangers
from pytest_safemanip.sim.robocasa.playback import episode_meta, model_xml
from pytest_safemanip.trace import files
from tests import toy

EPISODE = "extras/episode_000000"
TABLE = "data/chunk-000/episode_000000.parquet"
LENGTH = 3


def states(name: str = "states", **arrays: Any) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        np.savez_compressed(folder / EPISODE / "states.npz", **arrays)

    return write


def text(name: str, content: str | bytes) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        data = content.encode() if isinstance(content, str) else content
        (folder / name).write_bytes(data)

    return write


def changed(name: str, **values: Any) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        path = folder / name
        path.write_text(json.dumps({**json.loads(path.read_text()), **values}))

    return write


def bomb(folder: Path) -> None:
    """A gigabyte of zeros."""
    with zipfile.ZipFile(folder / EPISODE / "states.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(
            header, {"descr": "<f8", "fortran_order": False, "shape": (1 << 17, 1 << 10)}
        )
        with archive.open("states.npy", "w", force_zip64=True) as member:
            member.write(header.getvalue())
            for _ in range(64):
                member.write(bytes(1 << 23))


def column(name: str, values: Any) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        known = {
            "episode_index": np.zeros(LENGTH, np.int64),
            ACTION: np.zeros((LENGTH, 12)),
            STATE: np.tile(np.eye(16)[6] + np.eye(16)[13], (LENGTH, 1)),
        }
        write_columns(folder / TABLE, {**known, name: values})

    return write


def twice(folder: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    write_table(folder / TABLE, arrow.table([[0] * LENGTH] * 2, names=["episode_index"] * 2))


def cut_off(name: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (folder / name).write_bytes((folder / name).read_bytes()[:-100])

    return write


def linked(folder: Path) -> None:
    outside = folder.parent / "outside.npz"
    np.savez(outside, states=np.zeros((LENGTH, 5)))
    (folder / EPISODE / "states.npz").unlink()
    (folder / EPISODE / "states.npz").symlink_to(outside)


def linked_folder(folder: Path) -> None:
    (folder / "data").rename(folder.parent / "outside")
    (folder / "data").symlink_to(folder.parent / "outside")


def line(**values: Any) -> Callable[[Path], None]:
    entry = {"episode_index": 0, "tasks": ["do"], "length": LENGTH, **values}
    return text("meta/episodes.jsonl", json.dumps(entry))


ROTATED = np.zeros((LENGTH, 16))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A dataset of three steps, as such; nothing can be simulated of it."""
    extra = Extras(np.zeros((LENGTH, 5)), np.zeros((0, 5)), "<mujoco/>", {"lang": "do"}, {})
    upright = np.tile(np.eye(16)[6] + np.eye(16)[13], (LENGTH, 1))
    rows = Rows("do", upright, np.zeros((LENGTH, 12)), np.zeros(LENGTH, bool), (), extra)
    with DatasetWriter(tmp_path / "data", "v2.1", "OpenDrawer", 20) as writer:
        writer.add(rows)
        writer.close({"env_name": "OpenDrawer", "env_kwargs": {}})
    changed(f"{EPISODE}/ep_meta.json", safemanip=None)(tmp_path / "data")
    return tmp_path / "data"


WRONG: dict[str, tuple[Callable[[Path], None], str]] = {
    "pickle": (states(states=np.array([{"a": 1}], object)), "states.npy: not a readable array"),
    "no states": (states(other=np.zeros(3)), "states.npy is missing"),
    "integers": (states(states=np.zeros((3, 5), int)), "states.npy: int64, expected float64"),
    "flat": (states(states=np.zeros(3)), "states: shape (3,), expected (N, S)"),
    "bomb": (bomb, "more than the limit of"),
    "no archive": (text(f"{EPISODE}/states.npz", "hello"), "not an archive of arrays"),
    "link": (linked, "leads out of"),
    "linked folder": (linked_folder, "episode_000000.parquet: leads out of"),
    "too few": (states(states=np.zeros((2, 5))), "2 states and 3 actions"),
    "no gzip": (text(f"{EPISODE}/model.xml.gz", "<mujoco/>"), "model.xml.gz: not a packed text"),
    "xml bomb": (
        text(f"{EPISODE}/model.xml.gz", gzip.compress(b" " * (strangers.MOST_XML + 1))),
        "when unpacked",
    ),
    "entities": (
        text(
            f"{EPISODE}/model.xml.gz",
            gzip.compress(b'<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco/>'),
        ),
        "document type",
    ),
    "include": (
        text(
            f"{EPISODE}/model.xml.gz",
            gzip.compress(b'<mujoco><include file="/etc/passwd"/></mujoco>'),
        ),
        "element <include>",
    ),
    "meta": (text(f"{EPISODE}/ep_meta.json", "[1"), "ep_meta.json: not JSON"),
    "meta list": (text(f"{EPISODE}/ep_meta.json", "[]"), "ep_meta: must be a mapping"),
    "about": (changed(f"{EPISODE}/ep_meta.json", safemanip={"task": 1}), "malformed description"),
    "absolute actions": (
        changed(
            "extras/dataset_meta.json",
            env_args={
                "env_name": "OpenDrawer",
                "env_kwargs": {"controller_configs": {"control_delta": False}},
            },
        ),
        "its actions are absolute (control_delta: False)",
    ),
    "task": (
        changed("extras/dataset_meta.json", env_args={"env_name": "../x"}),
        "env_name must be the name of a task",
    ),
    "version": (changed(layout.INFO, codebase_version="v9"), "known are v2.0, v2.1, v3.0"),
    "fps": (changed(layout.INFO, fps=0), "fps must be a number above 0"),
    "fps true": (changed(layout.INFO, fps=True), "fps must be a number above 0, found True"),
    "pattern": (changed(layout.INFO, data_path=3), "data_path must be a text"),
    "path": (changed(layout.INFO, data_path="../../{episode_index}.parquet"), "leads out of"),
    "format": (
        changed(layout.INFO, data_path="{episode_index.__class__}{x}"),
        "a path names 'x', which is not known",
    ),
    "negative": (line(episode_index=-1), "an episode has an impossible number: -1"),
    "huge": (line(length=10**12), "an episode has an impossible number: 1000000000000"),
    "texts": (line(tasks=[1]), "tasks must be texts, found [1]"),
    "rows": (line(length=7), "3 rows of episode 0, the dataset says 7"),
    "no parquet": (text(TABLE, "hello"), "not a parquet file"),
    "words": (column(ACTION, ["a", "b", "c"]), "action must be numbers, found string"),
    "nulls": (column(ACTION, [[1.0], None, [1.0]]), "action must be lists of the same length"),
    "no value": (column("episode_index", [0, None, 0]), "episode_index lacks values in some rows"),
    "nested": (column(ACTION, [[[1.0]]] * 3), "action must be numbers, found list<"),
    "twice": (twice, "more than one column episode_index"),
    "cut off": (cut_off(TABLE), "not a parquet file, or a damaged one"),
    "no rows": (line(length=0), "3 rows of episode 0, the dataset says 0"),
    "ragged": (column(ACTION, [[1.0], [1.0, 2.0], []]), "action must be lists of the same length"),
    "empty": (column(ACTION, [[], [], []]), "action must be lists of the same length"),
    "robot": (column(ACTION, np.zeros((LENGTH, 7))), "action has shape (3, 7), RoboCasa's"),
    "infinite": (column(ACTION, np.full((LENGTH, 12), np.nan)), "action is not finite"),
    "modality": (changed(layout.MODALITY, action={}), "the parts are not those of the action"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_dataset_is_said_in_a_line_and_nothing_is_kept(
    name: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil, message = WRONG[name]
    spoil(folder)
    status = main(["import", str(folder), "-o", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert status in (1, 4), said
    assert message in said.out + said.err
    assert "Traceback" not in said.err
    assert not list(tmp_path.rglob(f"*{files.SUFFIX}"))


def test_a_table_is_unpacked_no_farther_than_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    arrow, stream = pytest.importorskip("pyarrow"), io.BytesIO()
    rows = 5000
    places = arrow.array(np.zeros(rows, np.int32))
    text = arrow.DictionaryArray.from_arrays(places, ["x" * 1000])  # once in the file
    columns = {"text": text, "episode_index": np.arange(rows), "zeros": np.zeros(rows)}
    plain = arrow.table(columns).cast(
        arrow.schema({"text": "string", "episode_index": "int64", "zeros": "double"})
    )
    pytest.importorskip("pyarrow.parquet").write_table(plain, stream, row_group_size=1000)
    table = Table(stream.getvalue(), "t.parquet")
    assert len(stream.getvalue()) < 100_000
    monkeypatch.setattr(tables, "MOST_UNPACKED", 1_000_000)
    with pytest.raises(TraceError, match=r"t.parquet: more than 1000000 bytes when unpacked"):
        table.read(["text"])
    found, first = table.read(["episode_index"], 2500, 2501)  # its own row group
    assert (first, found.num_rows) == (2000, 1000)
    monkeypatch.setattr(tables, "MOST_UNPACKED", 20_000)
    with pytest.raises(TraceError, match=r"t.parquet: 5000 values, more than 2500"):
        table.read(["zeros"])


def test_half_a_dataset_is_not_taken_for_one(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder.rename(tmp_path / ".data.1234")  # as an export is called that is not ready
    assert main(["import", str(tmp_path), "-o", str(tmp_path / "out")]) == 4
    assert "nothing to import" in capsys.readouterr().err


def test_a_dataset_that_cannot_be_read_keeps_no_other_from_being_imported(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(folder, tmp_path / "data" / "again")
    text("again/meta/info.json", "{")(folder)
    options = ["--format=lerobot", "--task=OpenDrawer", "-o", str(tmp_path / "out")]
    assert main(["import", str(folder), *options]) == 1
    said = capsys.readouterr().out
    assert "1 of 2 episodes imported" in said
    assert "refused  again: meta/info.json: not JSON" in said


def test_a_rotation_of_a_log_that_is_none_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    column(STATE, ROTATED)(folder)
    options = ["--format=lerobot", "--task=OpenDrawer", "-o", str(tmp_path / "out")]
    assert main(["import", str(folder), *options]) == 1
    assert "a rotation is no unit quaternion" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("/etc/passwd", "of no known package"),
        ("../../secret.obj", "of no known package"),
        ("/x/robosuite/models/assets/../../../secret.obj", "names a file outside of robosuite"),
        ("/x/robocasa/models/assets//etc/passwd", "names a file outside of robocasa"),
        ("/x/robosuite/models/assets/none.stl", "is not among the assets of this machine"),
    ],
)
def test_a_model_names_files_of_the_two_packages_only(
    path: str, message: str, tmp_path: Path
) -> None:
    roots = {"robosuite": tmp_path / "rs", "robocasa": tmp_path / "rc"}
    root = strangers.parse(f'<mujoco><asset><mesh file="{path}"/></asset></mujoco>')
    with pytest.raises(TraceError, match=message):
        model_xml.rerooted(root, roots)


def test_a_path_of_another_machine_is_found_on_this_one(tmp_path: Path) -> None:
    roots = {"robosuite": tmp_path / "rs", "robocasa": tmp_path / "rc"}
    for root in roots.values():
        root.mkdir()
        (root / "a.obj").write_text("")
    xml = f'<mujoco><asset><mesh file="{roots["robocasa"]}/a.obj"/></asset></mujoco>'
    told = model_xml.published(xml, roots)
    assert 'file="/robocasa/models/assets/a.obj"' in told
    elsewhere = told.replace("/robocasa/", "C:/labs/robosuite/robocasa/")
    found = model_xml.rerooted(strangers.parse(elsewhere), roots)
    assert f'file="{roots["robocasa"]}/a.obj"' in found


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"layout_id": {"room": {"walls": []}}}, "is none of RoboCasa's numbers"),
        ({"layout_id": "../../x.yaml"}, "is none of RoboCasa's numbers"),
        ({"object_cfgs": [{"info": {"mjcf_path": "/etc/passwd"}}]}, "is no model of an object"),
        ({"object_cfgs": [{"info": {"mjcf_path": "/objects/../../x"}}]}, "leads out of the assets"),
        ({"object_cfgs": [{"name": "obj"}]}, "does not say which model the object has"),
        ({"object_cfgs": [{}] * 2000}, "a list of at most 1000"),
        ({"init_robot_base_pos": [1, 2]}, "init_robot_base_pos must be three numbers"),
        ({"fixture_refs": {"cab": 3}}, "fixture_refs must be names"),
        ({"lang": 3}, "lang must be a text"),
    ],
)
def test_robocasa_is_told_of_no_file_but_assets(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    meta = {
        "layout_id": 1,
        "style_id": 2,
        "object_cfgs": [],
        "init_robot_base_pos": [0.0, 0.0, 0.0],
        "init_robot_base_ori": [0.0, 0.0, 0.0],
        "fixture_refs": {},
        "lang": "do",
    }
    episode_meta.checked(meta, tmp_path)
    with pytest.raises(TraceError, match=message):
        episode_meta.checked({**meta, **change}, tmp_path)


def test_what_cannot_be_exported_is_named_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow")
    files.save(toy.recording(), tmp_path / "a.rollout")
    (tmp_path / "b.rollout").write_text("PK")
    assert main(["export", str(tmp_path), "--lerobot", "-o", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().out.splitlines() == [
        f"refused  {tmp_path}/a.rollout: recorded with the backend 'toy'; only robocasa's can be "
        "exported: datasets have its robot's state and its models",
        f"refused  {tmp_path}/b.rollout: not a recording, or a truncated one (File is not a zip "
        "file); restore the file, or record the rollout again",
    ]
    assert not (tmp_path / "out").exists()


def test_actions_go_to_the_datasets_order_and_back() -> None:
    actions = np.random.default_rng(0).uniform(-1, 1, (5, 12))
    stored = to_dataset(actions)
    assert (stored[:, 5:8] == actions[:, :3]).all()  # base first, hand last
    assert (to_environment(stored, action_order(modality())) == actions).all()
    assert (np.abs(to_environment(3 * stored, action_order(modality()))) <= 1.0).all()


def test_an_episodes_extras_are_in_robocasas_places(folder: Path) -> None:
    assert {path.name for path in (folder / EPISODE).iterdir()} == {
        extras.STATES,
        extras.MODEL,
        extras.META,
    }
    with pytest.raises(SafemanipError, match="is there already; remove it"):
        DatasetWriter(folder, "v2.1", "OpenDrawer", 20)
