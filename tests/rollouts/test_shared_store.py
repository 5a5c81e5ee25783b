"""Recordings that machines share, in a folder and in a store that speaks S3's protocol."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.rollouts.shared_store import NotShared, SharedStore
from pytest_safemanip.rollouts.store import Store
from pytest_safemanip.trace import files
from tests import toy

KEY = "k" * 64


def made(key=KEY, length=3):
    return toy.recording(length, about=toy.episode(hashes={"start": "0", "key": key}))


def never():
    raise AssertionError("run again, though it is in the store")


@pytest.fixture(scope="module")
def s3():
    """The URL of a bucket on this machine."""
    pytest.importorskip("s3fs")
    moto = pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    changed = {
        "AWS_ACCESS_KEY_ID": "a",
        "AWS_SECRET_ACCESS_KEY": "b",
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    before = {name: os.environ.get(name) for name in changed}
    os.environ |= changed
    import s3fs

    s3fs.S3FileSystem().mkdir("rollouts")
    yield "s3://rollouts/runs"
    server.stop()
    for name, value in before.items():
        os.environ.pop(name) if value is None else os.environ.update({name: value})


@pytest.fixture(params=["folder", "s3"])
def url(request, tmp_path):
    if request.param == "s3":
        return f"{request.getfixturevalue('s3')}/{request.node.name.partition('[')[0]}"
    return f"file://{tmp_path / 'all'}"


def machine(tmp_path, name, url, run="run", fresh=False):
    return Store(tmp_path / name, run, fresh, SharedStore(url))


def test_another_machine_does_not_run_it_again(tmp_path, url):
    one, other = machine(tmp_path, "one", url), machine(tmp_path, "other", url, "later")
    path = one.path("pi05", "OpenDrawer", 3)
    assert not one.knows(path)
    assert not one.has(path, KEY)
    one.get(path, KEY, made)
    later = machine(tmp_path, "other", url, "later")
    there = later.path("pi05", "OpenDrawer", 3)
    assert later.knows(there)
    assert later.has(there, KEY)
    recording, reused = later.get(there, KEY, never)
    assert reused
    assert there.read_bytes() == path.read_bytes()
    assert files.to_bytes(recording) == path.read_bytes()
    assert not other.has(other.path("pi05", "OpenDrawer", 3), "x" * 64)


def test_recordings_of_several_keys_stay(tmp_path, url):
    """Two checkpoints, or two versions, share a store without replacing each other's."""
    for number in range(3):
        store = machine(tmp_path, f"m{number}", url)
        store.get(store.path("p", "T", 0), str(number) * 64, lambda n=number: made(str(n) * 64))
    for number in range(3):
        store = machine(tmp_path, "reader", url, f"later {number}")
        assert store.get(store.path("p", "T", 0), str(number) * 64, never)[1]


def test_fresh_runs_it_again(tmp_path, url):
    store = machine(tmp_path, "one", url)
    store.get(store.path("p", "T", 0), KEY, made)
    again = machine(tmp_path, "two", url, "later", fresh=True)
    assert not again.has(again.path("p", "T", 0), KEY)
    assert not again.get(again.path("p", "T", 0), KEY, made)[1]


def test_what_was_not_shared_is_shared_by_the_next_run(tmp_path, url):
    alone = Store(tmp_path / "one", "run")
    path = alone.path("p", "T", 0)
    alone.get(path, KEY, made)
    machine(tmp_path, "one", url, "later").get(path, KEY, never)
    assert SharedStore(url).has(path.name, KEY)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 cut off"])
def test_a_damaged_file_is_recorded_again(tmp_path, url, damage):
    store = machine(tmp_path, "one", url)
    path = store.path("p", "T", 0)
    store.get(path, KEY, made)
    shared = SharedStore(url)
    shared._files.pipe_file(shared._place(path.name, KEY), damage)
    other = machine(tmp_path, "other", url, "later")
    recording, reused = other.get(other.path("p", "T", 0), KEY, made)
    assert not reused
    assert len(recording.steps) == 3
    third = machine(tmp_path, "third", url, "later")
    assert third.get(third.path("p", "T", 0), KEY, never)[1]  # it has been replaced


def test_a_copy_that_breaks_off_is_in_no_folder(tmp_path, monkeypatch):
    from fsspec.implementations.local import LocalFileSystem

    def full(self, here, there, **options):
        Path(there).write_bytes(Path(here).read_bytes()[:100])
        raise OSError(28, "No space left on device")

    url = f"file://{tmp_path}/all"
    (tmp_path / "all").mkdir()
    store = machine(tmp_path, "one", url)
    with monkeypatch.context() as patched:
        patched.setattr(LocalFileSystem, "put_file", full)
        with pytest.warns(NotShared, match="No space left on device"):
            store.get(store.path("p", "T", 0), KEY, made)
    assert not [found for found in (tmp_path / "all").rglob("*") if found.is_file()]
    machine(tmp_path, "one", url, "later").get(store.path("p", "T", 0), KEY, never)
    other = machine(tmp_path, "other", url, "later")
    assert other.get(other.path("p", "T", 0), KEY, never)[1]


def test_a_store_that_cannot_be_written_is_read_and_what_is_missing_is_kept_here(tmp_path):
    url = f"file://{tmp_path}/all"
    (tmp_path / "all").mkdir()
    one = machine(tmp_path, "one", url)
    one.get(one.path("p", "T", 0), KEY, made)
    (tmp_path / "all" / "T-p-seed1").write_text("no folder can be made here")
    other = machine(tmp_path, "other", url, "later")
    assert other.get(other.path("p", "T", 0), KEY, never)[1]
    with pytest.warns(NotShared, match=r"T-p-seed1\.rollout is not in file:"):
        other.get(other.path("p", "T", 1), KEY, made)
    assert files.load(other.path("p", "T", 1)).episode.hashes["key"] == KEY


def test_what_cannot_be_put_there_is_kept_here(tmp_path):
    (tmp_path / "file").write_text("no folder")
    store = Store(tmp_path / "one", "run", False, SharedStore(f"file://{tmp_path}/file"))
    path = store.path("p", "T", 0)
    with pytest.warns(NotShared, match=r"T-p-seed0\.rollout is not in file:"):
        store.get(path, KEY, made)
    assert files.load(path).episode.hashes["key"] == KEY


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("nothing://bucket/x", "--safemanip-store: nothing://bucket/x: .*not known"),
        ("s3://", "expected a bucket or folder, as in s3://bucket/folder"),
        ("s3://a/../b", "expected a bucket or folder"),
        ("abfs://bucket/x", "--safemanip-store: abfs://bucket/x: .*[Ii]nstall adlfs"),
    ],
)
def test_an_unknown_protocol_is_refused(url, message):
    with pytest.raises(ConfigError, match=message):
        SharedStore(url)


def test_a_bucket_that_is_not_there_is_refused_before_anything_is_run(s3):
    with pytest.raises(ConfigError, match="there is no bucket or folder 'no-such-bucket'"):
        SharedStore("s3://no-such-bucket/x").has("a", KEY)


def test_nothing_else_is_written(tmp_path, url):
    store = machine(tmp_path, "one", url)
    store.get(store.path("p", "T", 0), KEY, made)
    assert sorted(p.name for p in Path(tmp_path, "one").glob("*.rollout")) == ["T-p-seed0.rollout"]
