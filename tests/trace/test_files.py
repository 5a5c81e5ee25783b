from __future__ import annotations

import copy
import dataclasses
import errno
import io
import json
import os
import pickle
import re
import struct
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace import files
from pytest_safemanip.trace import members as members_of
from pytest_safemanip.trace.elements import Camera, Entity, Liquid
from pytest_safemanip.trace.members import Members
from tests import toy

RECORDING = toy.recording(
    length=4,
    tail=1,
    contacts=toy.contacts((1, "counter/body", "mug/body", 2.5, (0, 0, 1))),
)
DATA = files.to_bytes(RECORDING)


def members(data=DATA):
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(content, method=zipfile.ZIP_DEFLATED):
    """A recording's file whose digest fits its content: made by somebody who knows how."""
    content = {name: raw for name, raw in content.items() if name != "digest"}
    digest = Members(zipped(content, method)).digest(but="digest")
    return zipped({**content, "digest": digest.encode()}, method)


def zipped(content, method=zipfile.ZIP_DEFLATED):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, raw in content.items():
            archive.writestr(name, raw)
    return stream.getvalue()


def npy(array, **options):
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def lying_npy(shape):
    """An array whose header promises more than there is."""
    text = repr({"descr": "<f4", "fortran_order": False, "shape": shape}).encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def refusal(data):
    with pytest.raises(TraceError) as caught:
        files._arrays(files.from_bytes(data))
    return str(caught.value)


def same(one, other):
    for name, array in files._arrays(one).items():
        read = files._arrays(other)[name]
        assert array.dtype == read.dtype, name
        assert array.tobytes() == read.tobytes(), name
        assert array.shape == read.shape, name
    assert (one.episode, one.scene) == (other.episode, other.scene)


def test_what_is_saved_is_read_again_bit_for_bit(tmp_path):
    path = tmp_path / "deep" / "one.rollout"
    files.save(RECORDING, path)
    same(RECORDING, files.load(path))
    assert files.load_episode(path) == RECORDING.episode
    assert [p.name for p in path.parent.iterdir()] == ["one.rollout"]


WATCHED = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("water", "liquid", "water")),
    cameras=(Camera("front", 0.8, 1.5), Camera("wrist", 1.2, 1.0)),
    liquids=(Liquid("water", 3, 0.01),),
)


def test_cameras_and_liquids_survive_with_what_they_do():
    drops = np.arange(2 * 3 * 3, dtype=np.float32).reshape(2, 3, 3)
    poses = np.tile(np.float32((0.0, 0.0, 2.0, *toy.UPRIGHT)), (2, 2, 1))
    one = toy.recording(2, scene=WATCHED, camera_pose=poses, particles=drops)
    read = files.from_bytes(files.to_bytes(one))
    same(one, read)
    assert read.scene.particles == {"water": slice(0, 3)}


def earlier(scene):
    """The recording as the schema before would have it, with another scene."""
    header = json.loads(members()["header.json"])
    header |= {"schema": 6, "scene": scene(header["scene"])}
    content = {**members(), "header.json": json.dumps(header).encode()}
    return packed({k: v for k, v in content.items() if k[:-4] not in ("camera_pose", "particles")})


def test_a_file_of_the_schema_before_has_no_cameras_and_no_liquids():
    later = ("cameras", "liquids")
    data = earlier(lambda scene: {k: v for k, v in scene.items() if k not in later})
    same(files.from_bytes(data), RECORDING)
    named = [{"name": "front", "fov": 0.8, "aspect": 1.5}]
    assert files.from_bytes(earlier(lambda scene: {**scene, "cameras": named})).scene.cameras == ()


def test_extreme_floats_survive():
    arrays = RECORDING.steps.qpos.copy()
    arrays[0] = (-0.0, np.finfo(np.float32).tiny / 2, np.finfo(np.float32).max)
    extreme = dataclasses.replace(RECORDING.steps, qpos=arrays)
    one = dataclasses.replace(RECORDING, steps=extreme)
    same(one, files.from_bytes(files.to_bytes(one)))


def test_a_rollout_of_the_simulator_survives(rollouts):
    judged = rollouts.get("TurnOnSinkFaucet")
    data = judged.path.read_bytes()
    assert files.to_bytes(files.from_bytes(data)) == data


def test_the_same_content_gives_the_same_bytes():
    again = files.from_bytes(DATA)
    turned = dict(reversed(list(again.episode.hashes.items())))
    again = dataclasses.replace(again, episode=dataclasses.replace(again.episode, hashes=turned))
    assert files.to_bytes(again) == DATA


def test_only_the_header_is_read_for_the_episode(tmp_path):
    content = dict.fromkeys(members(), b"rubbish")
    content["header.json"] = members()["header.json"]
    path = tmp_path / "one.rollout"
    path.write_bytes(zipped(content))
    assert files.load_episode(path) == RECORDING.episode
    with pytest.raises(TraceError, match="digest"):
        files.load(path)


@pytest.mark.parametrize("schema", [5, 8, "6", None, [7]])
def test_a_file_of_another_schema_is_refused_and_says_to_run_again(schema):
    header = json.loads(members()["header.json"])
    header["schema"] = schema
    content = {**members(), "header.json": json.dumps(header).encode()}
    assert f"schema {schema!r}, this version reads 7: run the rollout again" in refusal(
        packed(content)
    )


def test_what_no_verdict_depends_on_is_checked_when_it_is_asked_for():
    content = members()
    content["qvel.npy"] = npy(RECORDING.steps.qvel * np.float32(np.nan))
    read = files.from_bytes(packed(content))
    assert read.success == RECORDING.success
    for _ in range(2):
        with pytest.raises(TraceError, match="qvel: not finite at step 0"):
            _ = read.steps.qvel


def test_steps_of_a_file_can_be_copied_whole():
    read = copy.deepcopy(files.from_bytes(DATA))
    same(read, RECORDING)


@pytest.mark.parametrize(
    "numbers", [np.zeros((2, 10)), np.zeros((1, 9)), np.zeros(10)], ids=lambda n: str(n.shape)
)
def test_surfaces_without_their_numbers_are_refused(numbers):
    content = members()
    content["scene.surfaces.npy"] = npy(numbers)
    assert "scene.surfaces.npy: shape" in refusal(packed(content))


@pytest.mark.parametrize("read", [files.load, files.load_episode])
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (None, "cannot be read"),
        (b"", "not a recording"),
        (b"PK no zip at all", "not a recording"),
        (DATA[: len(DATA) // 2], "truncated"),
        (zipped({"other": b""}), "header.json is missing"),
        (zipped({"header.json": b"[1"}), "header.json: not JSON"),
        (zipped({"header.json": b"[" * 200_000}), "header.json: not JSON"),
        (zipped({"header.json": b"[]"}), "header.json: not a mapping"),
        (zipped({"header.json": b"{}"}), "schema None"),
        (zipped({"header.json": b'{"schema": 7}'}), " is missing"),
        (zipped({"header.json": b'{"schema": 6}'}), " is missing"),
        (zipped({"header.json": b" " * (files.MAX_HEADER + 1)}), "header.json: 4194305 bytes"),
        (zipped({"header.json": b"{}"}, zipfile.ZIP_LZMA), "header.json: compressed in another"),
    ],
)
def test_a_file_that_is_no_recording_is_refused_by_name(tmp_path, read, data, message):
    path = tmp_path / "one.rollout"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(TraceError) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


QPOS = RECORDING.steps.qpos


@pytest.mark.parametrize(
    ("name", "raw", "message"),
    [
        ("qpos", None, "qpos.npy is missing"),
        ("qpos", b"", "qpos.npy: not a readable array"),
        ("qpos", b"rubbish", "qpos.npy: not a readable array"),
        ("qpos", npy(QPOS)[:-1], "qpos.npy: not a readable array"),
        ("qpos", npy(np.array([{}, 1], object), allow_pickle=True), "qpos.npy: not a readable"),
        ("qpos", pickle.dumps(QPOS), "qpos.npy: not a readable array"),
        ("qpos", lying_npy((2**70,)), "qpos.npy: not a readable array"),
        ("qpos", lying_npy((10**15,)), "qpos.npy: not a readable array"),
        ("qpos", lying_npy((-1,)), "qpos.npy: not a readable array"),
        ("qpos", zipped({"a.npy": npy(QPOS)}), "qpos.npy: not an array"),
        ("qpos", npy(QPOS.astype(float)), "qpos.npy: float64, expected float32"),
        ("qpos", npy(QPOS.astype(">f4")), "qpos.npy: >f4, expected float32"),
        ("success", npy(np.zeros(4, np.int8)), "success.npy: int8, expected bool"),
        ("contacts.a", npy(np.zeros(1, np.int64)), "contacts.a.npy: int64, expected int32"),
        (
            "eef_poses",
            npy(np.zeros((4, 1, 6), np.float32)),
            "eef_poses: shape (4, 1, 6), expected (4, 1, 7)",
        ),
        ("success", npy(np.zeros((), bool)), "success: a single number, expected an array"),
        (
            "contacts.a",
            npy(np.zeros((), np.int32)),
            "contacts.a: a single number, expected an array",
        ),
        (
            "contacts.step",
            npy(np.zeros((), np.int32)),
            "contacts.step: a single number, expected an array",
        ),
        ("tail", npy(np.zeros(0, bool)), "tail: shape (0,), expected (4,)"),
        ("joint", npy(np.full((4, 1, 2), np.nan, np.float32)), "joint: not finite at step 0 of"),
    ],
)
def test_a_bad_array_is_refused_by_name(name, raw, message):
    content = members()
    if raw is None:
        del content[f"{name}.npy"]
    else:
        content[f"{name}.npy"] = raw
    assert message in refusal(packed(content))


def test_nothing_in_a_file_is_executed(tmp_path):
    class Trap:
        def __reduce__(self):
            return (open, (str(tmp_path / "trapped"), "w"))

    content = members()
    content["qpos.npy"] = npy(np.array([Trap()], object), allow_pickle=True)
    assert "qpos.npy" in refusal(packed(content))
    assert not (tmp_path / "trapped").exists()


@pytest.mark.parametrize("name", ["qpos.npy", "header.json"])
def test_a_changed_file_is_refused(name):
    content = members()
    if name == "header.json":
        content[name] = content[name].replace(b"put the mug", b"put the cup")
    else:
        content[name] = npy(QPOS + 1)
    assert refusal(zipped(content)) == (
        "the content does not match its digest: the file was changed"
    )


def test_a_small_file_that_unpacks_to_a_huge_array_is_refused(monkeypatch):
    monkeypatch.setattr(members_of, "MAX_ARRAY", 10_000)
    bomb = packed({**members(), "qpos.npy": npy(np.zeros(3_000_000, np.float32))})
    assert len(bomb) < 50_000
    assert refusal(bomb) == "qpos.npy: 12000128 bytes, more than the limit of 10000"


def unusual(data, comment=b"", extra=b"", prefix=b""):
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(stream, "w") as other:
        other.comment = comment
        for info in archive.infolist():
            one = zipfile.ZipInfo(info.filename)
            one.extra = extra
            other.writestr(one, archive.read(info), info.compress_type, 6)
    return prefix + stream.getvalue()


@pytest.mark.parametrize(
    "how",
    [
        {"comment": b"somebody's"},
        {"extra": b"\xff\xff\x02\x00ab"},
        {"prefix": b"something before it"},
        {"prefix": b"before", "comment": b"after"},
    ],
)
def test_an_archive_that_another_program_wrote_is_read_too(how):
    same(files.from_bytes(unusual(DATA, **how)), RECORDING)


@pytest.mark.parametrize("place", [12, 16], ids=["size", "beginning"])
def test_a_directory_that_is_not_where_the_archive_says_is_refused(place):
    data = bytearray(DATA)
    struct.pack_into("<L", data, len(data) - 22 + place, 2**31)
    assert "not a recording" in refusal(bytes(data))


def test_an_archive_that_is_wrong_about_how_many_members_it_has_is_read_all_the_same():
    data = bytearray(DATA)
    struct.pack_into("<HH", data, len(data) - 14, 3, 3)
    same(files.from_bytes(bytes(data)), RECORDING)


def test_an_archive_that_understates_a_size_is_refused():
    data = packed(members())
    size = len(members()["qpos.npy"])
    content = data.replace(struct.pack("<I", size), struct.pack("<I", size - 4))
    assert "does not match its digest" in refusal(content)
    whole = Members(data).packed("qpos.npy")
    with pytest.raises(
        TraceError, match=f"qpos.npy: {size - 3} bytes, the archive says {size - 4}"
    ):
        dataclasses.replace(whole, size=size - 4).unpacked(size)


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, len(DATA) - 1), st.integers(0, 255)), min_size=1, max_size=3),
    st.sampled_from([0, len(DATA) - 1200]),
)
def test_damage_anywhere_is_noticed_or_harmless(changes, start):
    data = bytearray(DATA)
    for place, byte in changes:
        data[start + place % (len(DATA) - start)] = byte
    try:
        read = files.from_bytes(bytes(data))
    except TraceError:
        return
    same(read, RECORDING)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "one.rollout"
    files.save(RECORDING, path)

    def full(*_):
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(files.os, "replace", full)
    with pytest.raises(OSError, match=r"no space left: '.*/one.rollout'"):
        files.save(toy.recording(length=2), path)
    assert path.read_bytes() == DATA
    assert list(tmp_path.iterdir()) == [path]


WRONG = (None, True, -1, 1.5, 10**400, float("nan"), "x", [], [None], [[1]], {}, {"x": 1}, [{}])


def places(node, way=()):
    """The ways to everything in a header; of a list, its first element stands for all."""
    yield way
    inside = node.items() if isinstance(node, dict) else enumerate(node[:1])
    for key, value in inside:
        yield (*way, key)
        if isinstance(value, dict | list):
            yield from places(value, (*way, key))


def replaced(node, way, value):
    if not way:
        return value
    changed = copy.copy(node)
    changed[way[0]] = replaced(node[way[0]], way[1:], value)
    return changed


HEADER = json.loads(members()["header.json"])


@pytest.mark.parametrize("way", sorted(set(places(HEADER)), key=str), ids=str)
def test_a_header_with_a_fitting_digest_is_read_or_refused_by_name_whatever_is_in_it(way):
    refusals = []
    for value in WRONG:
        header = json.dumps(replaced(HEADER, way, value)).encode()
        try:
            files.from_bytes(packed({**members(), "header.json": header}, zipfile.ZIP_STORED))
        except TraceError as error:
            refusals.append(str(error))
    assert len(refusals) > 1
    assert all(re.match(r"[a-z_.]+: .|schema", text) for text in refusals), refusals


@pytest.mark.parametrize(
    ("way", "value", "message"),
    [
        (("entities",), {}, "scene: entities must be a list, found {}"),
        (("entities", 1), [], "scene: entities[1] must be a mapping, found []"),
        (("parts", 2), {"x": 1}, "scene: parts[2]: malformed description"),
        (("parts", 0, "name"), 3, "scene: parts[0]: name must be a printable text, found 3"),
        (("boxes", 0, "kind"), "x", "scene: boxes[0]: kind must be one of interior, handle,"),
        (("joints", 0, "gives_access"), 1, "scene: joints[0]: gives_access must be true or false"),
        (("grippers", 0, "fingers"), ["x"], "scene: grippers[0]: fingers must be a list, each of"),
        (("actions", 0, "low"), "0", "scene: actions[0]: low must be a number, found '0'"),
        (("roles", "obj"), [], "scene: roles must be a mapping to texts"),
        (("control_period",), "1", "scene: control_period must be a number, found '1'"),
        (("surfaces", "joint"), 5, "scene: surfaces: entity and joint must be lists of texts"),
        (("surfaces", "entity", 0), 5, "scene: surfaces: entity and joint must be lists of texts"),
    ],
)
def test_a_field_of_another_type_is_refused_by_name(way, value, message):
    header = json.dumps(replaced(HEADER, ("scene", *way), value)).encode()
    assert message in refusal(packed({**members(), "header.json": header}))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"horizon": 1}, "episode: the horizon is 1, and the last step that acts is 2"),
        ({"ended": "success"}, "episode: it ended with success, and step 2 has none"),
    ],
)
def test_a_description_that_contradicts_the_steps_is_refused(changed, message):
    forged = dataclasses.replace(
        RECORDING, episode=dataclasses.replace(RECORDING.episode, **changed)
    )
    assert refusal(files.to_bytes(forged)) == message


@pytest.mark.parametrize("kind", ["pipe", "folder", "device", "endless"])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path, kind):
    path = tmp_path / "a.rollout"
    if kind == "pipe":
        os.mkfifo(path)  # read, it waits for somebody who writes
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as stream:
            stream.truncate(files.MAX_FILE + 1)
    for read in (files.load, files.load_episode):
        with pytest.raises(
            TraceError, match=r"a\.rollout: (cannot be read: (not a|Is a dir)|larger than \d+ b)"
        ):
            read(path)


def test_damage_says_what_to_do_and_brings_no_traceback_along(tmp_path):
    path = tmp_path / "cut.rollout"
    path.write_bytes(DATA[: len(DATA) // 2])
    with pytest.raises(TraceError) as caught:
        files.load(path)
    assert str(caught.value).startswith(f"{path}: not a recording, or a truncated one (")
    assert str(caught.value).endswith("; restore the file, or record the rollout again")
    assert caught.value.__cause__ is None
