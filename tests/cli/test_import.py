"""``safemanip import``: what it writes, says and keeps."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest

from pytest_safemanip.importers import builder
from pytest_safemanip.trace import files
from tests.cli.conftest import Command
from tests.importers import world


@pytest.fixture(scope="module")
def played() -> world.Played:
    return world.play()


def test_episodes_become_recordings_that_are_judged(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played, env="LiftMine")
    world.write(source, played, env="LiftMine", name="demo_2")
    found = safemanip("import", source, "-o", "out")
    assert found.status == 0, found.err
    first, second, total, drafted, *_, then = found.out.splitlines()
    assert first.startswith("LiftMine-human-seed1.rollout  104 steps, drift ")
    assert first.endswith("  demo.hdf5:demo_1")
    assert second.startswith("LiftMine-human-seed2.rollout")
    assert total == "2 of 2 episodes imported"
    assert drafted == "drafted  out/tasks/LiftMine.yaml: look through it before you trust a verdict"
    assert then == (
        "judge them  pytest --safemanip-recordings=out -o safemanip_task_paths=out/tasks"
    )
    assert "objects: [cube]" in Path("out/tasks/LiftMine.yaml").read_text()
    Path("pytest.ini").write_text("[pytest]\nsafemanip_task_paths = out/tasks\n")
    shown = safemanip("show", "out/LiftMine-human-seed1.rollout")
    assert shown.status == 0, shown.out + shown.err
    assert [line.split()[:4] for line in shown.out.splitlines() if "SATISFIED" in line] == [
        ["collision_contact", "SATISFIED", "1", "of"],
        ["grasp_stability", "SATISFIED", "1", "of"],
        ["release_stability", "SATISFIED", "1", "of"],
    ]


def test_what_was_imported_before_is_kept(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    assert safemanip("import", source, "-o", "out").status == 0
    (path,) = Path("out").glob("*.rollout")
    before = path.stat().st_mtime_ns
    again = safemanip("import", source, "-o", "out")
    assert (again.status, path.stat().st_mtime_ns) == (0, before)
    assert "0 of 1 episode imported, 1 imported before" in again.out
    other = world.write(tmp_path / "other.hdf5", played)
    refused = safemanip("import", other, "-o", "out")
    assert refused.status == 1
    assert "is another rollout; name who acted with --policy" in refused.out
    assert safemanip("import", other, "-o", "out", "--policy=alice").status == 0


def test_an_import_that_was_killed_drafts_its_tasks_when_it_is_run_again(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played, env="LiftMine")
    assert safemanip("import", source, "-o", "out").status == 0
    draft = Path("out/tasks/LiftMine.yaml")
    text = draft.read_text()
    draft.unlink()
    draft.parent.rmdir()
    assert f"drafted  {draft}" in safemanip("import", source, "-o", "out").out
    assert draft.read_text() == text


def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_simulated(
    played: world.Played, safemanip: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    _raising(monkeypatch, 1, AssertionError("it is simulated"))
    for command in (("import", source), ("export", source, "--lerobot")):
        taken = safemanip(*command, "-o", source / "out").refusal
        assert taken.endswith(f"{source / 'out'} cannot be made: {source} is not a folder")
        # As a variable of a script that is not set.
        assert "expected a path, found an empty text" in safemanip(*command, "-o", "").refusal
    assert "expected a path" in safemanip("import", "", "-o", "out").refusal
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert "out cannot be written: " in safemanip("import", source, "-o", "out").refusal


def test_what_is_refused_is_said_and_the_rest_imported(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    world.write(source, played, name="demo_2", model="<mujoco/>")
    found = safemanip("import", source, "-o", "out")
    assert found.status == 1
    assert "1 of 2 episodes imported" in found.out
    assert (
        "refused  demo.hdf5:demo_2: states: shape (104, 22), expected (2 or more, 1)" in found.out
    )
    assert files.load(Path("out/Lift-human-seed1.rollout")).success


def _raising(monkeypatch: pytest.MonkeyPatch, seed: int, error: BaseException) -> None:
    """An episode fails while it is built."""
    build = builder.RecordingBuilder.build

    def built(self: Any, states: Any, about: builder.About, progress: Any) -> Any:
        if about.seed == seed:
            raise error
        return build(self, states, about, progress)

    monkeypatch.setattr(builder.RecordingBuilder, "build", built)


def test_an_interrupt_keeps_what_there_is(
    played: world.Played, safemanip: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    world.write(source, played, name="demo_2")
    _raising(monkeypatch, 2, KeyboardInterrupt())
    found = safemanip("import", source, "-o", "out")
    assert found.status == 2
    assert "1 of 2 episodes imported, 1 not reached" in found.out
    assert [path.name for path in Path("out").glob("*.rollout")] == ["Lift-human-seed1.rollout"]


def test_a_graphics_library_that_is_not_there_is_not_needed(
    played: world.Played, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    command = [sys.executable, "-m", "pytest_safemanip", "import", source, "-o", "out", "--no-tail"]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env={**os.environ, "MUJOCO_GL": "not there"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "1 of 1 episode imported" in done.stdout, done.stdout + done.stderr


def test_a_source_that_nobody_knows_is_refused_in_one_line(
    safemanip: Command, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("")
    assert "notes.txt: nothing to import; " in safemanip("import", "notes.txt", "-o", "out").refusal
    assert "no such file" in safemanip("import", "nosuch", "-o", "out").refusal


def test_a_file_is_named_once_in_what_is_wrong_with_it_and_nothing_in_it_is_no_success(
    safemanip: Command, tmp_path: Path
) -> None:
    (tmp_path / "demo.hdf5").write_bytes(b"PK")
    found = safemanip("import", "demo.hdf5", "-o", "out")
    assert found.status == 1
    assert "refused  demo.hdf5: not HDF5, or a damaged one" in found.out
    with h5py.File("demo.hdf5", "w") as file:
        file.create_group("data").attrs["env"] = "Lift"
    assert safemanip("import", "demo.hdf5", "-o", "out").refusal.endswith("it has no episode")


def test_names_in_a_strangers_file_do_not_move_the_cursor(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    short = world.Played(played.states[:5], played.actions[:5])
    source = world.write(tmp_path / "demo.hdf5", short, name="demo_\x1b[2J1")
    found = safemanip("import", source, "-o", "out", "--no-tail")
    assert found.status == 0
    assert found.out.splitlines()[0].endswith(r"  demo.hdf5:demo_\x1b[2J1")


def test_names_that_lead_elsewhere_and_limits_that_are_none_are_refused(
    played: world.Played, safemanip: Command, tmp_path: Path
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    found = safemanip("import", source, "-o", "out", "--task=../../evil")
    assert found.status == 1
    assert "'../../evil' is no name of a task" in found.out
    assert not list(tmp_path.parent.glob("evil*"))
    for limit in ("nan", "-1", "inf"):
        refused = safemanip("import", source, "-o", "out", f"--drift-limit={limit}")
        assert refused.status == 4
        assert "--drift-limit: expected metres from 0 up" in refused.err
    assert not list(tmp_path.rglob("*.rollout"))


def test_whatever_a_strangers_model_raises_refuses_its_episode_only(
    played: world.Played, safemanip: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = world.write(tmp_path / "demo.hdf5", played)
    world.write(source, played, name="demo_2")
    _raising(monkeypatch, 1, RecursionError("maximum recursion depth exceeded"))
    found = safemanip("import", source, "-o", "out")
    assert found.status == 1
    assert "cannot be imported: RecursionError" in found.out
    assert "1 of 2 episodes imported" in found.out
