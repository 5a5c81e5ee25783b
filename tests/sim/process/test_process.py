"""The simulator's own process: it dies, hangs, prints and misses things, and the run goes on."""

from __future__ import annotations

import ast
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError, SimulatorFailed, TaskError
from pytest_safemanip.sim import process
from pytest_safemanip.sim.backend import Options, Provenance, Request
from pytest_safemanip.sim.process import ProcessBackend
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.sim.robocasa.loading import how_to_install
from tests.sim.process import children
from tests.toy import SPEC

STILL = np.zeros(12)
Start = Callable[..., ProcessBackend]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    made = []

    def start(factory: str = "simulator", **arguments: Any) -> ProcessBackend:
        name = f"{children.__name__}:{factory}"
        made.append(
            ProcessBackend(name, arguments, SPEC, Provenance("toy", "none"), tmp_path / "logs")
        )
        return made[-1]

    yield start
    for backend in made:
        backend.close()


def episode(seed: int = 0, task: str = "Task") -> Request:
    return Request(task, seed, "compact")


def log_in(error: pytest.ExceptionInfo[Any]) -> str:
    """The content of the log file that a message names."""
    word = next(w for w in str(error.value).split() if ".log" in w)
    return Path(word.rstrip(";")).read_text()


def is_alive(pid: int) -> bool:
    """Whether a process still runs, zombies left out."""
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_steps_come_back_as_the_simulator_made_them(start: Start) -> None:
    backend, local = start(), children.Simulator()
    here, there = local.reset(episode(3)), backend.reset(episode(3))
    assert there.scene == here.scene
    assert np.array_equal(there.step.eef_pose, here.step.eef_pose)
    assert (there.instruction, there.horizon) == (here.instruction, here.horizon)
    assert there.fingerprint == here.fingerprint


def test_observations_come_back_as_the_simulator_made_them(start: Start) -> None:
    backend, local = start(), children.Simulator()
    for world in (backend, local):
        world.reset(episode())
        world.step(STILL)
    here, there = local.observe(), backend.observe()
    assert there.keys() == here.keys()
    for key, array in here.items():
        assert there[key].dtype == array.dtype
        assert np.array_equal(there[key], array)


def test_an_observation_before_a_reset_is_refused(start: Start) -> None:
    with pytest.raises(RolloutError, match="before reset"):
        start().observe()


def test_an_observation_that_cannot_be_had_names_the_step(start: Start) -> None:
    backend = start()
    backend.reset(episode(children.BLIND))
    backend.step(STILL)
    with pytest.raises(RolloutError, match="failed at the observation of step 1: ZeroDivision"):
        backend.observe()
    backend.step(STILL)


def test_a_killed_simulator_ends_the_rollout_and_the_next_one_starts_anew(start: Start) -> None:
    backend = start()
    backend.reset(episode())
    backend.step(STILL)
    first = backend.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)
    with pytest.raises(RolloutError, match=r"died at step 2 \(killed by SIGKILL\)") as caught:
        backend.step(STILL)
    assert "noise on standard error" in log_in(caught)
    backend.reset(episode())
    assert backend.pid not in (first, None)
    assert np.isfinite(backend.step(STILL).eef_pose).all()


def test_a_simulator_that_dies_between_two_rollouts_harms_none(start: Start) -> None:
    backend = start()
    backend.reset(episode())
    pid = backend.pid or 0
    os.kill(pid, signal.SIGKILL)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)  # all of its threads are gone
    backend.reset(episode())
    assert backend.pid not in (None, pid)


def test_a_simulator_killed_while_it_steps_is_noticed_at_once(start: Start) -> None:
    backend = start()
    backend.reset(episode(children.HANGS_AT))
    killer = subprocess.Popen(["/bin/sh", "-c", f"sleep 0.2; kill -KILL {backend.pid}"])
    began = time.monotonic()
    with pytest.raises(RolloutError, match=r"died at step 1 \(killed by SIGKILL\)"):
        backend.step(STILL)
    assert time.monotonic() - began < process.STEP_DEADLINE / 2
    killer.wait()


def test_a_simulator_that_exits_says_its_code_and_its_last_words(start: Start) -> None:
    backend = start()
    backend.reset(episode(children.DIES_AT))
    with pytest.raises(RolloutError, match=r"exit code 7") as caught:
        backend.step(STILL)
    assert "last words" in str(caught.value)


def test_a_simulator_that_hangs_is_ended_at_the_deadline(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "STEP_DEADLINE", 0.3)
    backend = start()
    backend.reset(episode(children.HANGS_AT))
    pid = backend.pid
    with pytest.raises(RolloutError, match=r"did not answer within 0\.3 s at step 1") as caught:
        backend.step(STILL)
    assert pid is not None
    assert not is_alive(pid)
    assert "noise" in log_in(caught)
    backend.reset(episode())
    backend.step(STILL)


def test_an_error_of_the_simulator_names_the_step_and_the_log(start: Start) -> None:
    backend = start()
    backend.reset(episode(children.FAILS_AT))
    with pytest.raises(RolloutError, match="failed at step 1: ZeroDivisionError") as caught:
        backend.step(STILL)
    assert "Traceback" in log_in(caught)
    backend.close()
    assert "Traceback" in log_in(caught), "a log that was named is kept"


def test_a_wrong_request_is_the_users_to_mend(start: Start) -> None:
    backend = start()
    with pytest.raises(ConfigError, match="no task 'Missing'"):
        backend.reset(episode(task="Missing"))
    backend.reset(episode())


def test_a_scene_that_cannot_be_had_is_no_failure_of_the_simulator(start: Start) -> None:
    backend = start()
    with pytest.raises(TaskError, match=r"^the vase has no room$") as caught:
        backend.reset(episode(task="Crowded"))
    assert not caught.value.infrastructure
    backend.reset(episode())


def test_a_step_before_a_reset_is_refused(start: Start) -> None:
    with pytest.raises(RolloutError, match="before reset"):
        start().step(STILL)


def test_what_is_missing_at_start_up_is_told_as_the_simulator_tells_it(start: Start) -> None:
    with pytest.raises(ConfigError, match="install it with: pip install it"):
        start("unusable").reset(episode())


def test_a_start_up_that_hangs_is_an_error_of_the_configuration(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "START_DEADLINE", 0.3)
    with pytest.raises(ConfigError, match=r"did not answer within 0\.3 s at start-up"):
        start("slow").reset(episode())


@pytest.mark.parametrize("package", ["robocasa", "robosuite", "mujoco"])
def test_a_missing_package_is_told_with_the_install_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, package: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ConfigError, match=rf"{package} is not installed.*pip install") as caught:
        create(Options("primitive", tmp_path))
    assert ".[robocasa]" in str(caught.value)


def test_on_a_python_without_robosuite_another_one_is_named() -> None:
    assert "pip install '.[robocasa]'" in how_to_install((3, 12))
    assert how_to_install((3, 13)).startswith("use Python 3.11 or 3.12:")


def test_a_package_that_cannot_be_imported_is_told_with_the_install_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """RoboCasa is there, but something that it needs is not."""
    broken = tmp_path / "robosuite"
    broken.mkdir()
    (broken / "__init__.py").write_text("import something_that_nobody_has")
    monkeypatch.syspath_prepend(tmp_path)
    backend = create(Options("primitive", tmp_path))
    message = r"something_that_nobody_has is not installed; install it with: pip install"
    with pytest.raises(ConfigError, match=message):
        backend.reset(Request("OpenDrawer", 0, "compact"))


def test_a_simulator_that_is_killed_while_it_starts_is_missed_by_one_rollout_only(
    start: Start, tmp_path: Path
) -> None:
    backend = start("killed_at_first", path=str(tmp_path / "killed"))
    with pytest.raises(SimulatorFailed, match=r"died at start-up \(killed by SIGKILL\)"):
        backend.reset(episode())
    backend.reset(episode())


@pytest.mark.parametrize("seed", [0, children.HANGS_AT], ids=["idle", "busy"])
def test_the_simulator_ends_when_the_test_run_is_killed(tmp_path: Path, seed: int) -> None:
    code = (
        "import sys, time; import numpy as np; sys.path[:0] = [sys.argv[1]];"
        "from pathlib import Path;"
        "from pytest_safemanip.sim.backend import Provenance, Request;"
        "from pytest_safemanip.sim.process import ProcessBackend;"
        "from tests.toy import SPEC;"
        "where = Path(sys.argv[2]);"
        "made = Provenance('toy', '');"
        "b = ProcessBackend('tests.sim.process.children:simulator', {}, SPEC, made, where);"
        "b.reset(Request('Task', int(sys.argv[3]), 'compact'));"
        "print(b.pid, flush=True); b.step(np.zeros(12)); time.sleep(600)"
    )
    root = str(Path(__file__).parents[3])
    parent = subprocess.Popen(
        [sys.executable, "-c", code, root, str(tmp_path), str(seed)], stdout=subprocess.PIPE
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert is_alive(child)
    time.sleep(0.2)  # it has begun to step, or is done with it
    parent.kill()
    parent.wait()
    parent.stdout.close()
    deadline = time.monotonic() + 10.0
    while is_alive(child) and time.monotonic() < deadline:
        select.select([], [], [], 0.05)
    assert not is_alive(child)


def test_closing_ends_the_simulator_and_may_be_done_twice(start: Start, tmp_path: Path) -> None:
    backend = start()
    backend.reset(episode())
    pid = backend.pid
    assert pid is not None
    backend.close()
    backend.close()
    assert not is_alive(pid)
    assert backend.pid is None
    assert list((tmp_path / "logs").iterdir()) == [], "the log of a run without failure is dropped"
    backend.reset(episode())


def test_a_simulator_that_does_not_end_by_itself_is_ended_by_force(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "CLOSE_DEADLINE", 0.2)
    backend = start()
    backend.reset(episode())
    pid = backend.pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    backend.close()
    assert not is_alive(pid)


def test_a_simulator_that_a_thread_waits_for_is_ended_at_once_and_leaves_no_log(
    start: Start, tmp_path: Path
) -> None:
    backend = start()
    backend.reset(episode(children.HANGS_AT))
    pid, met = backend.pid, []

    def wait() -> None:
        with pytest.raises((RolloutError, ValueError)) as caught:
            backend.step(STILL)
        met.append(caught)

    waiting = threading.Thread(target=wait)
    waiting.start()
    time.sleep(0.2)
    began = time.monotonic()
    backend.close()
    waiting.join(5)
    assert time.monotonic() - began < process.CLOSE_DEADLINE / 2
    assert met
    assert pid is not None
    assert not is_alive(pid)
    assert list((tmp_path / "logs").iterdir()) == []


@pytest.mark.parametrize("busy", [False, True])
def test_a_simulator_that_is_killed_since_the_run_is_interrupted_leaves_no_log(
    start: Start, tmp_path: Path, busy: bool
) -> None:
    backend = start()
    backend.reset(episode(children.HANGS_AT if busy else 0))
    raised: list[BaseException] = []

    def wait() -> None:
        try:
            backend.step(STILL)
        except BaseException as error:
            raised.append(error)

    waiting = threading.Thread(target=wait)
    if busy:
        waiting.start()
        time.sleep(0.2)
    began = time.monotonic()
    backend.kill()
    if busy:
        waiting.join()
        assert isinstance(raised[0], SimulatorFailed)
    backend.close()
    assert time.monotonic() - began < 1.0
    assert backend.pid is None
    assert not list(tmp_path.rglob("*.log"))


def test_nothing_is_left_in_the_environment_and_on_the_screen(
    start: Start, capfd: pytest.CaptureFixture[str]
) -> None:
    before = dict(os.environ)
    backend = start()
    backend.reset(episode())
    backend.step(STILL)
    backend.close()
    assert dict(os.environ) == before
    assert capfd.readouterr() == ("", "")


def test_the_simulator_computes_on_one_thread_and_draws_nothing(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "8")
    note = tmp_path / "environment"
    start("environment", path=str(note)).reset(episode())
    assert ast.literal_eval(note.read_text()) == {
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONHASHSEED": "0",
        "MUJOCO_GL": None,
        "PYOPENGL_PLATFORM": None,
    }
    assert os.environ["MUJOCO_GL"] == "egl"
