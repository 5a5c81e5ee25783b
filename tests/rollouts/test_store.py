from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import signal
import stat

import pytest

from pytest_safemanip.errors import ConfigError, RolloutError, SimulatorFailed
from pytest_safemanip.rollouts.store import Store, key_of, prepare_output
from pytest_safemanip.trace import files
from tests import toy


def made(key="k", length=3):
    return toy.recording(length, about=toy.episode(hashes={"start": "0", "key": key}))


class Runs:
    """Makes recordings and counts them."""

    def __init__(self, *outcomes):
        self.outcomes, self.count = outcomes, 0

    def __call__(self):
        self.count += 1
        outcome = self.outcomes[self.count - 1] if self.outcomes else made()
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "recordings", "this run")


@pytest.fixture
def path(store):
    return store.path("scripted", "OpenDrawer", 3)


PARTS = {"task": "T", "seed": 1, "versions": {"mujoco": "3", "numpy": "2"}, "groups": ["a", "b"]}


@pytest.mark.parametrize(
    "changed",
    [
        {"task": "U"},
        {"seed": 2},
        {"seed": "1"},
        {"versions": {"mujoco": "3", "numpy": "2.1"}},
        {"versions": {"mujoco": "3"}},
        {"groups": ["b", "a"]},
        {"more": None},
    ],
)
def test_a_key_changes_with_everything_that_decides(changed):
    assert key_of({**PARTS, **changed}) != key_of(PARTS)


def test_a_key_does_not_change_with_the_order_in_which_things_are_told():
    turned = {**PARTS, "versions": {"numpy": "2", "mujoco": "3"}}
    assert key_of(dict(reversed(turned.items()))) == key_of(PARTS)


def test_a_rollout_is_run_once_and_then_read(store, path):
    runs = Runs()
    (first, _), (second, _) = store.get(path, "k", runs), store.get(path, "k", runs)
    assert runs.count == 1
    assert files.to_bytes(first) == files.to_bytes(second) == path.read_bytes()
    assert Store(store.folder, "another run").get(path, "k", runs) is not None
    assert runs.count == 1


def test_what_was_decided_otherwise_is_run_again_and_replaced(store, path):
    store.get(path, "k", Runs())
    new = Runs(made("other", 5))
    recording, _ = store.get(path, "other", new)
    assert len(recording.steps) == 5
    assert files.load_episode(path).hashes["key"] == "other"


@pytest.mark.parametrize("kept", [0, 10, -20, None])
def test_a_damaged_recording_is_run_again(store, path, kept):
    store.get(path, "k", Runs())
    whole = path.read_bytes()
    path.write_bytes(b"rubbish" if kept is None else whole[:kept])
    runs = Runs()
    store.get(path, "k", runs)
    assert runs.count == 1
    assert path.read_bytes() == whole


def test_a_recording_whose_arrays_are_damaged_is_run_again_though_its_key_fits(store, path):
    store.get(path, "k", Runs())
    whole = path.read_bytes()
    place = whole.index(b"eef_poses.npy") + len("eef_poses.npy") + 5
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 255]) + whole[place + 1 :])
    runs = Runs()
    store.get(path, "k", runs)
    assert runs.count == 1
    assert path.read_bytes() == whole


def test_a_rollout_that_failed_is_not_tried_again_in_the_same_run(store, path):
    runs = Runs(RolloutError("the server is gone"), made())
    for _ in range(2):
        with pytest.raises(RolloutError, match="the server is gone"):
            store.get(path, "k", runs)
    with pytest.raises(RolloutError, match="the server is gone"):
        Store(store.folder, "this run").get(path, "k", runs)
    assert runs.count == 1
    assert not path.exists()
    # With another key, or in another run, it is.
    store.get(path, "other", Runs(made("other")))
    Store(store.folder, "another run").get(path, "k", runs)
    assert runs.count == 2


def test_a_rollout_that_was_interrupted_is_tried_again(store, path):
    runs = Runs(KeyboardInterrupt(), made())
    with pytest.raises(KeyboardInterrupt):
        store.get(path, "k", runs)
    store.get(path, "k", runs)
    assert runs.count == 2


def test_what_an_earlier_run_recorded_is_reused_and_what_this_one_did_is_not(store, path):
    """Whichever process of this run it was."""
    assert not store.has(path, "k")
    assert [store.get(path, "k", Runs())[1] for _ in range(2)] == [False, False]
    assert not Store(store.folder, "this run").get(path, "k", Runs())[1]
    later = Store(store.folder, "another run")
    assert (later.has(path, "k"), later.has(path, "other")) == (True, False)
    assert [later.get(path, "k", Runs())[1] for _ in range(2)] == [True, True]


def test_afresh_a_rollout_is_run_again_but_once_in_a_run(store, path):
    store.get(path, "k", Runs())
    runs = Runs()
    assert not Store(store.folder, "another run", fresh=True).has(path, "k")
    for _ in range(2):  # two processes
        _, reused = Store(store.folder, "another run", fresh=True).get(path, "k", runs)
        assert not reused
    assert runs.count == 1


def test_afresh_a_rollout_that_failed_is_an_error_though_an_earlier_run_recorded_it(store, path):
    store.get(path, "k", Runs())
    for _ in range(2):
        with pytest.raises(RolloutError, match="the server is gone"):
            Store(store.folder, "another run", fresh=True).get(
                path, "k", Runs(RolloutError("the server is gone"))
            )


def test_each_rollout_has_a_file_of_its_own_inside_the_folder(store):
    named = [
        (policy, task, seed)
        for policy in (
            "scripted",
            "scripted:drop",
            "a/b:c",
            "a:b:c",
            "a_b_c",
            "../../a",
            "a",
            "a-seed1",
        )
        for task in ("OpenDrawer", "OpenCabinet")
        for seed in (0, 1, 10)
    ]
    paths = [store.path(*one) for one in named]
    assert len(set(paths)) == len(paths)
    assert {path.parent for path in paths} == {store.folder}
    assert {path.suffix for path in paths} == {files.SUFFIX}


def test_a_recording_can_be_read_by_everybody(store, path):
    store.get(path, "k", Runs())
    assert stat.S_IMODE(path.stat().st_mode) == 0o644


def worker(folder, log, start, death):
    """What each process does: ask for the same rollouts."""
    store = Store(folder, "one run")
    start.wait()
    for seed in range(3):
        path = store.path("scripted", "OpenDrawer", seed)

        def run(seed=seed):
            with log.open("a") as stream:
                stream.write(f"{seed}\n")
            if death:
                os._exit(1)
            return made(str(seed))

        with contextlib.suppress(RolloutError):
            store.get(path, str(seed), run)


def in_processes(number, folder, log, death=False):
    context = multiprocessing.get_context("spawn")
    start = context.Barrier(number)
    arguments = (folder, log, start, death)
    processes = [context.Process(target=worker, args=arguments) for _ in range(number)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    return [process.exitcode for process in processes]


def test_four_processes_that_ask_at_once_run_each_rollout_once(tmp_path):
    folder, log = tmp_path / "recordings", tmp_path / "log"
    assert in_processes(4, folder, log) == [0, 0, 0, 0]
    assert sorted(log.read_text().split()) == ["0", "1", "2"]
    for path in sorted(folder.glob(f"*{files.SUFFIX}")):
        assert files.load(path).episode.hashes["key"] in "012"
    assert len(list(folder.glob("*"))) == 4  # three recordings and the folder of locks


def test_a_rollout_that_killed_its_process_kills_no_other(tmp_path):
    folder, log = tmp_path / "recordings", tmp_path / "log"
    assert sorted(in_processes(4, folder, log, death=True)) == [0, 1, 1, 1]
    assert sorted(log.read_text().split()) == ["0", "1", "2"]
    store = Store(folder, "one run")
    with pytest.raises(RolloutError, match="the process that ran this rollout died") as caught:
        store.get(store.path("scripted", "OpenDrawer", 0), "0", Runs())
    assert caught.value.infrastructure


def test_the_output_folder_is_made_and_hidden_from_version_control(tmp_path):
    for _ in range(2):
        prepare_output(tmp_path / "deep" / "out")
    assert (tmp_path / "deep" / "out" / ".gitignore").read_text() == "*\n"


def test_an_output_folder_that_cannot_be_written_is_named_with_the_option(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "out"):
        with pytest.raises(ConfigError) as caught:
            prepare_output(place)
        assert str(caught.value).startswith(f"--safemanip-out: cannot write to {place} (")
        assert str(caught.value).endswith("name another folder")


def test_a_recording_that_cannot_be_kept_is_an_error_that_says_so_each_time(store, path):
    path.mkdir()  # nothing can be put where it is, as on a full disk
    runs = Runs()
    for _ in range(2):
        with pytest.raises(RolloutError, match=r"cannot be kept \(Is a directory\); make room, or"):
            store.get(path, "k", runs)
    assert runs.count == 2
    assert [found.name for found in store.folder.iterdir()] == [".locks", path.name]


def killed_at_work(folder, running):
    store = Store(folder, "a run that was killed")
    path = store.path("scripted", "OpenDrawer", 0)

    def run():
        (folder / f".{path.name}.half").write_bytes(files.to_bytes(made())[:100])
        running.set()
        signal.pause()

    store.get(path, "k", run)


def test_what_a_killed_process_left_is_in_nobodys_way(tmp_path):
    """A locked lock, a note that the rollout was begun, and half a recording."""
    folder, context = tmp_path / "recordings", multiprocessing.get_context("spawn")
    running = context.Event()
    process = context.Process(target=killed_at_work, args=(folder, running))
    process.start()
    assert running.wait(60)
    process.kill()
    process.join(60)
    store = Store(folder, "the next run")
    path = store.path("scripted", "OpenDrawer", 0)
    other = folder / f".{store.path('scripted', 'OpenDrawer', 10).name}.half"
    other.write_bytes(b"somebody is at it")
    assert (folder / ".locks" / f"{path.name}.lock").exists()
    assert not store.has(path, "k")
    runs = Runs()
    assert not store.get(path, "k", runs)[1]
    assert runs.count == 1
    assert {found.name for found in folder.iterdir()} == {".locks", path.name, other.name}


def test_a_lock_file_of_a_process_that_is_no_more_locks_nothing(store, path):
    lock = store.folder / ".locks" / f"{path.name}.lock"
    lock.write_text("4194304\nelsewhere\n")
    runs = Runs()
    store.get(path, "k", runs)
    assert runs.count == 1


@contextlib.contextmanager
def disk_of(size):
    """Files end at a size, as on a disk that is full there; signal and limit are put back."""
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)


@pytest.mark.parametrize("size", [0, 10, 2000])
def test_on_a_full_disk_what_was_recorded_before_is_kept_and_nothing_half(store, path, size):
    """Full at the note that it was begun, within it, or within the recording."""
    store.get(path, "k", Runs())
    whole = path.read_bytes()
    assert len(whole) > 2000
    other = store.path("scripted", "OpenDrawer", 4)
    runs = Runs()
    with (
        disk_of(size),
        pytest.raises(RolloutError, match=r"cannot be kept \(File too large\); make"),
    ):
        store.get(other, "k", runs)
    assert {found.name for found in store.folder.iterdir()} == {".locks", path.name}
    assert path.read_bytes() == whole
    store.get(other, "k", runs)  # there is room again
    assert other.read_bytes() == whole


def test_a_folder_of_recordings_that_cannot_be_written_is_named_with_the_option(tmp_path):
    (tmp_path / "recordings").write_text("")
    with pytest.raises(ConfigError, match=r"--safemanip-out: cannot write to .*recordings \("):
        Store(tmp_path / "recordings", "run")


def test_whose_fault_a_failure_was_is_known_to_the_other_processes(tmp_path):
    def fail():
        error = SimulatorFailed("the simulator process died")
        error.restarts = 2
        raise error

    with pytest.raises(SimulatorFailed):
        Store(tmp_path, "run").get(tmp_path / "a.rollout", "key", fail)
    with pytest.raises(RolloutError, match="the simulator process died") as again:
        Store(tmp_path, "run").get(tmp_path / "a.rollout", "key", fail)
    assert again.value.infrastructure
    assert again.value.restarts == 2


def test_a_folder_that_was_there_keeps_its_own_gitignore(tmp_path):
    (tmp_path / ".gitignore").write_text("mine\n")
    prepare_output(tmp_path)
    assert (tmp_path / ".gitignore").read_text() == "mine\n"
    prepare_output(tmp_path / "new")
    assert (tmp_path / "new" / ".gitignore").read_text() == "*\n"
