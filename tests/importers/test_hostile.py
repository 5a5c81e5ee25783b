"""Files that are corrupt, foreign or hostile are refused by name, and lead nowhere else."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.importers.base import ImportOptions
from pytest_safemanip.importers.registry import find_importer
from pytest_safemanip.importers.robosuite.importer import RobosuiteImporter
from pytest_safemanip.importers.source import Source
from tests.importers import world
from tests.importers.conftest import import_one

Damage = Callable[[h5py.Group, Path], None]
HEAD = '<mujoco model="base">'


def _other_file(folder: Path) -> Path:
    path = folder.parent / "elsewhere.hdf5"
    with h5py.File(path, "w") as file:
        file["states"] = np.zeros((2, 22))
    return path


def _external_link(demo: h5py.Group, folder: Path) -> None:
    del demo["states"]
    demo["states"] = h5py.ExternalLink(str(_other_file(folder)), "/states")


def _soft_link(demo: h5py.Group, folder: Path) -> None:
    demo.file["kept"] = demo["states"][()]
    del demo["states"]
    demo["states"] = h5py.SoftLink("/kept")


def _external_storage(demo: h5py.Group, folder: Path) -> None:
    raw = folder.parent / "raw.bin"
    raw.write_bytes(bytes(22 * 8 * 2))
    del demo["states"]
    demo.create_dataset("states", (2, 22), "f8", external=[(str(raw), 0, 22 * 8 * 2)])


def _virtual(demo: h5py.Group, folder: Path) -> None:
    layout = h5py.VirtualLayout((2, 22), "f8")
    layout[:] = h5py.VirtualSource(str(_other_file(folder)), "states", (2, 22))
    del demo["states"]
    demo.create_virtual_dataset("states", layout)


def _objects(demo: h5py.Group, folder: Path) -> None:
    del demo["states"]
    demo.create_dataset("states", (2,), h5py.string_dtype())


def _huge(demo: h5py.Group, folder: Path) -> None:
    del demo["states"]
    demo.create_dataset("states", (2**31, 22), "f8", chunks=(1, 22))


def _not_finite(demo: h5py.Group, folder: Path) -> None:
    demo["states"][7, 3] = np.nan


def _backwards(demo: h5py.Group, folder: Path) -> None:
    demo["states"][7, 0] = 0.1


def _other_model(demo: h5py.Group, folder: Path) -> None:
    kept = demo["states"][:, :20]
    del demo["states"]
    demo["states"] = kept


def _shorter_actions(demo: h5py.Group, folder: Path) -> None:
    kept = demo["actions"][:-3]
    del demo["actions"]
    demo["actions"] = kept


def _no_model(demo: h5py.Group, folder: Path) -> None:
    del demo.attrs["model_file"]


def _model_elsewhere(demo: h5py.Group, folder: Path) -> None:
    (folder.parent / "model.xml").write_text(world.MODEL)
    demo.attrs["model_file"] = "../../model.xml"


def _xml(old: str, new: str) -> Damage:
    def damage(demo: h5py.Group, folder: Path) -> None:
        assert old in world.MODEL
        demo.attrs["model_file"] = world.MODEL.replace(old, new)

    return damage


def _no_motors(demo: h5py.Group, folder: Path) -> None:
    before, rest = world.MODEL.split("<actuator>")
    demo.attrs["model_file"] = before + rest.partition("</actuator>")[2]


ENTITY = '<!DOCTYPE mujoco [<!ENTITY e SYSTEM "file:///etc/passwd">]>'
MESH = '<asset><mesh name="m" file="{}"/></asset><worldbody><geom type="mesh" mesh="m"/>'


def _chunk(demo: h5py.Group, folder: Path) -> None:
    del demo["states"]
    demo.create_dataset("states", (9, 22), "f8", maxshape=(None, 22), chunks=(2**24, 22))


def _empty(demo: h5py.Group, folder: Path) -> None:
    del demo["states"]
    demo["states"] = h5py.Empty("f8")


def _not_utf8(demo: h5py.Group, folder: Path) -> None:
    del demo.attrs["model_file"]
    demo.attrs["model_file"] = np.bytes_(b"<mujoco>\xff")


def _many_texts(demo: h5py.Group, folder: Path) -> None:
    del demo.attrs["model_file"]
    demo.attrs["model_file"] = ["<mujoco/>"] * 3


def _no_time(demo: h5py.Group, folder: Path) -> None:
    demo["states"][:, 0] = 0.0


DAMAGES: dict[str, tuple[Damage, str]] = {
    "external link": (_external_link, "/data/demo_1/states is a link to elsewhere"),
    "soft link": (_soft_link, "/data/demo_1/states is a link to elsewhere"),
    "external storage": (_external_storage, "states is kept in another file"),
    "virtual": (_virtual, "states is kept in another file"),
    "object dtype": (_objects, "/data/demo_1/states has the type object, not numbers"),
    "huge": (_huge, "numbers, more than the limit"),
    "chunk": (_chunk, "369098752 numbers, more than the limit"),
    "empty": (_empty, "/data/demo_1/states is no array"),
    "no time": (_no_time, "states: all 104 have the same time"),
    "not finite": (_not_finite, "qpos: not finite at state 7"),
    "time goes back": (_backwards, "times: not increasing at state 7"),
    "other model": (_other_model, r"states: shape \(104, 20\), expected \(2 or more, 22\)"),
    "shorter actions": (_shorter_actions, "actions: 101, and 104 states"),
    "no model": (_no_model, "has no model_file"),
    "model elsewhere": (_model_elsewhere, "model.xml: leads out of"),
    "entities": (_xml(HEAD, ENTITY + HEAD), "the model has a document type"),
    "no XML": (_xml("</worldbody>", ""), "the model is no XML"),
    "include": (_xml("<worldbody>", '<include file="x.xml"/><worldbody>'), "<include>"),
    "plugin": (
        _xml("<worldbody>", '<extension><plugin plugin="x"/></extension><worldbody>'),
        "<extension>",
    ),
    "replicate": (
        _xml("</worldbody>", '<replicate count="9"><geom size="1"/></replicate></worldbody>'),
        "<replicate>",
    ),
    "absolute mesh": (
        _xml("<worldbody>", MESH.format("/etc/passwd")),
        "names a file that is of no known package: /etc/passwd",
    ),
    "mesh out of a package": (
        _xml("<worldbody>", MESH.format("/x/robosuite/models/assets/../../../secret.stl")),
        "names a file outside of robosuite",
    ),
    "mesh out of the source": (
        _xml("<worldbody>", MESH.format("../../secret.stl")),
        "secret.stl: leads out of",
    ),
    "missing mesh": (
        _xml("<worldbody>", MESH.format("/x/robosuite/models/assets/robots/none.stl")),
        "the model needs robosuite/models/assets/robots/none.stl.*--assets",
    ),
    "height field": (
        _xml("<worldbody>", '<asset><hfield name="h" file="/etc/passwd"/></asset><worldbody>'),
        "of no known package: /etc/passwd",
    ),
    "key frames": (_xml('nconmax="5000"', 'nkey="50000000"'), "<size> with nkey='50000000': too"),
    "user data": (_xml('nconmax="5000"', 'nuser_geom="2e8"'), "<size> with nuser_geom='2e8': too"),
    "wide field": (
        _xml("<worldbody>", '<asset><hfield name="h" nrow="9999" ncol="9999"/></asset><worldbody>'),
        "<hfield> with nrow='9999': too large",
    ),
    "user sensor": (
        _xml("</worldbody>", '</worldbody><sensor><user dim="2e8"/></sensor>'),
        "<user> with dim='2e8': too large",
    ),
    "wide camera": (
        _xml("</worldbody>", '<camera resolution="9999 9999"/></worldbody>'),
        "<camera> with resolution='9999 9999': too large",
    ),
    "iterations": (
        _xml("<option ", '<option noslip_iterations="2000000000" '),
        "<option> with noslip_iterations='2000000000': too large",
    ),
    "bodies": (
        _xml("</worldbody>", "<body/>" * 5001 + "</worldbody>"),
        "than 5000 elements <body>",
    ),
    "attributes": (
        _xml("<asset>", "<asset " + " ".join(f'a{n}=""' for n in range(101)) + ">"),
        "the model has a <asset> with 101 attributes",
    ),
    "no gravity": (_xml("<option ", '<option gravity="nan nan nan" '), "physics .* is unstable"),
    "nameless": (
        _xml("</worldbody>", '<body><freejoint/><geom size=".1"/></body></worldbody>'),
        "states: shape",
    ),
    "not UTF-8": (_not_utf8, "attribute model_file of /data/demo_1: not HDF5, or a damaged one"),
    "many texts": (_many_texts, "attribute model_file of /data/demo_1 is no text"),
    "short steps": (_xml('timestep="0.002"', 'timestep="1e-9"'), "physics step is 1e-09 s"),
    "what does not compile": (_xml('size=".4 .4 .4"', 'size="a"'), "the model does not compile"),
    "no robot": (_xml('robot0_joint1" name', 'nothing" name'), "does not compile"),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_what_is_wrong_with_a_file_is_refused_by_name(
    case: str, played: world.Played, tmp_path: Path
) -> None:
    damage, message = DAMAGES[case]
    folder = tmp_path / "source"
    folder.mkdir()
    short = world.Played(played.states[:104], played.actions[:104])
    path = world.write(folder / "demo.hdf5", short)
    with h5py.File(path, "a") as file:
        damage(file["data/demo_1"], folder)
    with pytest.raises(TraceError, match=message):
        import_one(path)


def test_a_link_of_the_file_system_leads_nowhere(played: world.Played, tmp_path: Path) -> None:
    folder = tmp_path / "source"
    folder.mkdir()
    world.write(tmp_path / "demo.hdf5", played)
    (folder / "demo.hdf5").symlink_to(tmp_path / "demo.hdf5")
    with pytest.raises(TraceError, match=r"demo.hdf5: leads out of .*, by a link; .* \(cp -rL\)$"):
        import_one(folder)
    # Who names it means what it leads to.
    assert len(import_one(folder / "demo.hdf5", tail=False).steps) == 104


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not HDF5"),
        (b"\x89HDF\r\n\x1a\n" + bytes(200), "not HDF5"),
        (b"PK\x03\x04", "not HDF5"),
    ],
)
def test_a_file_that_is_no_hdf5_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "demo.hdf5"
    path.write_bytes(content)
    with pytest.raises(TraceError, match="not HDF5"):
        import_one(path)


def test_hdf5_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "demo.hdf5"
    with h5py.File(path, "w") as file:
        file["weights"] = np.zeros(3)
    with pytest.raises(TraceError, match="/data is missing"):
        import_one(path)


def test_a_truncated_file_is_refused(played: world.Played, tmp_path: Path) -> None:
    path = world.write(tmp_path / "demo.hdf5", played)
    path.write_bytes(path.read_bytes()[:-5000])
    with pytest.raises(TraceError, match="damaged"):
        import_one(path)


def test_a_wheel_that_unpacks_to_much_more_than_it_is_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("demo.hdf5", bytes(4 * 2**20))
    with pytest.raises(TraceError, match=r"demo.hdf5: it unpacks to 4194304 bytes, more than 100"):
        import_one(path)


def test_an_archive_that_is_packed_as_no_wheel_is_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("demo.hdf5", b"0123456789" * 9)
    with pytest.raises(TraceError, match=r"demo.hdf5: packed in another way than deflated"):
        import_one(path)


def test_a_pipe_is_no_source_and_does_not_stand_for_its_folder(
    played: world.Played, tmp_path: Path
) -> None:
    world.write(tmp_path / "demo.hdf5", played)
    os.mkfifo(tmp_path / "pipe.hdf5")
    with pytest.raises(ConfigError, match=r"pipe.hdf5: neither a file nor a folder"):
        Source(tmp_path / "pipe.hdf5")


def test_whatever_byte_is_damaged_nothing_but_a_refusal_comes_of_it(
    played: world.Played, tmp_path: Path
) -> None:
    short = world.Played(played.states[:4], played.actions[:4])
    content = world.write(tmp_path / "demo.hdf5", short).read_bytes()
    random = np.random.default_rng(0)
    for _ in range(60):
        damaged = bytearray(content)
        for place in random.integers(len(content), size=8):
            damaged[place] = random.integers(256)
        (tmp_path / "demo.hdf5").write_bytes(damaged)
        source = Source(tmp_path / "demo.hdf5")
        for episode in RobosuiteImporter().episodes(source, ImportOptions(tail=False)):
            with contextlib.suppress(TraceError, ConfigError):
                episode.record(lambda done, total: None)


def test_states_of_another_physics_are_refused(played: world.Played, tmp_path: Path) -> None:
    jumps = played.states.copy()
    jumps[50:, 5] += 0.3
    path = world.write(tmp_path / "demo.hdf5", dataclasses.replace(played, states=jumps))
    with pytest.raises(TraceError, match=r"physics has taken cube 300 mm .* more than the limit"):
        import_one(path)
    assert import_one(path, drift_limit=0.5).episode.origin["drift"].startswith("300")


def test_a_source_that_nobody_knows_is_named(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(ConfigError) as refused:
        find_importer(Source(tmp_path))
    assert str(refused.value) == (
        f"{tmp_path}: nothing to import; importers: robocasa (LeRobot datasets of RoboCasa's, with "
        "extras/); lerobot (other LeRobot datasets, by meta/info.json); robosuite (robosuite's and "
        "robomimic's .hdf5 and .h5)"
    )
    with pytest.raises(ConfigError, match=r"importers: lerobot \(other [^;]*\)$"):
        find_importer(Source(tmp_path), "lerobot")
    with pytest.raises(ConfigError, match="no such file or directory"):
        Source(tmp_path / "nosuch")
    (tmp_path / "a.whl").write_text("")
    with pytest.raises(ConfigError, match="not a zip archive"):
        Source(tmp_path / "a.whl")
