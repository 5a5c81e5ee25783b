"""A policy behind a server, in a run: found, asked, lost, refused."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import textwrap
from collections.abc import Callable, Iterator

import pytest

from pytest_safemanip.trace import files
from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up
from tests.warm import Warm

MODEL = """
import os
import sys
import time
from pathlib import Path

import numpy as np

CALLS = Path("calls.txt")

def note(word):
    with CALLS.open("a") as log:
        log.write(word + "\\n")

class Model:
    '''Looks at one image, and rises.'''

    def reset(self, seed):
        note(f"reset {seed}")

    def infer(self, request):
        note(request["prompt"])
        seen = int(request["observation/image"].mean())
        assert request["observation/state"].shape == (16,)
        actions = np.zeros((50, 12))
        actions[:, 2], actions[:, 3] = 0.5, 1.5
        time.sleep(0.1)
        return {"actions": actions}

class Known(Model):
    fingerprint = "weights 1"

class Other(Model):
    fingerprint = "weights 2"

class Beside(Known):
    '''Answers in a rollout once two servers have been asked.'''

    def infer(self, request):
        if request["prompt"] == "open the drawer":  # is being tried
            return super().infer(request)
        note(f"server {os.getpid()}")
        for _ in range(80):
            if len({line for line in CALLS.read_text().splitlines() if "server" in line}) == 2:
                return super().infer(request)
            time.sleep(0.1)
        raise RuntimeError("no other server was asked within 8 s")

class Dies(Model):
    '''Is killed at the second call of an episode, the first time.'''

    def infer(self, request):
        lines = CALLS.read_text().splitlines()
        if lines.count("put it there") == 1 and "dies" not in lines:
            note("dies")
            os._exit(1)
        return super().infer(request)

class Wrong(Model):
    def infer(self, request):
        answer = super().infer(request)
        answer["actions"][2, 7] = np.nan
        return answer
"""
INI = """
[pytest]
safemanip_backend = toy
safemanip_tasks = Reach
safemanip_scenes = compact
safemanip_task_paths = mine/tasks
safemanip_property_paths = mine/properties
safemanip_deadlines =
    start = 0.5
    warm_up = 10
    call = 10
"""
Serve = Callable[[str], str]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port: int = listening.getsockname()[1]
        return port


def with_models(suite: Suite) -> Suite:
    set_up(suite)
    suite.pytester.makeini(INI)
    suite.pytester.makepyfile(model=textwrap.dedent(MODEL))
    return suite


@pytest.fixture
def served(suite: Suite) -> Suite:
    """In each of the three modes."""
    return with_models(suite)


@pytest.fixture
def alone(one_suite: Suite) -> Suite:
    """Without xdist, where the mode cannot matter."""
    return with_models(one_suite)


@pytest.fixture
def serve(pytester: pytest.Pytester, warm: Warm) -> Iterator[Serve]:
    """Starts the package's own server on a model; gives its address."""
    with contextlib.ExitStack() as stack:

        def start(name: str, again: bool = False) -> str:
            port = free_port()
            command = [warm.python, "-m", "pytest_safemanip", "serve", f"model:{name}"]
            script = f"while ! {' '.join(command)} --port {port}; do :; done" if again else ""
            running = stack.enter_context(
                subprocess.Popen(
                    ["sh", "-c", script] if again else [*command, "--port", str(port)],
                    cwd=pytester.path,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    start_new_session=True,
                )
            )
            stack.callback(stop, running)
            assert running.stdout is not None
            running.stdout.readline()
            return f"ws://127.0.0.1:{port}"

        yield start


def stop(running: subprocess.Popen[str]) -> None:
    import os
    import signal

    with contextlib.suppress(ProcessLookupError):
        os.killpg(running.pid, signal.SIGKILL)


TRIED = ["reset 0", "open the drawer"]
"""What a server is asked when it is tried."""


def calls(suite: Suite) -> list[str]:
    """What the server was asked for, but for being tried."""
    told = (suite.pytester.path / "calls.txt").read_text().splitlines()
    assert told[:2] == TRIED  # before anything else
    while TRIED[1] in told:  # by each worker
        place = told.index(TRIED[1])
        assert told[place - 1] == TRIED[0]
        del told[place - 1 : place + 1]
    return told


def test_a_model_is_asked_for_chunks_and_judged(served: Suite, serve: Serve) -> None:
    address = serve("Model")
    result = served.run(f"--safemanip-policy=openpi={address}", "--safemanip-seeds=2", "-v")
    result.stdout.fnmatch_lines(
        [
            "safemanip: openpi at ws://127.0.0.1:*, not claimed; *",
            "safemanip: rollouts of openpi are run again * --safemanip-policy=openpi@CHECKPOINT=*",
            "  server     openpi; 4 calls, 20 actions, 20 of their 240 entries",
            "             outside [[]-1, 1] and clipped",
        ]
    )
    assert result.parseoutcomes()["failed"] == 2
    first, *_ = told = calls(served)
    other = {"reset 0": "reset 1", "reset 1": "reset 0"}[first]
    # The model keeps its state of one episode: they do not mix.
    assert told == [first, *["put it there"] * 2, other, *["put it there"] * 2]
    again = f"pytest --safemanip-policy=openpi={address} 'safemanip::test_safety[[]Reach-openpi-*"
    result.stdout.fnmatch_lines([f"reproduce with  {again}"])
    recording, _ = served.recordings()
    facts = files.load(recording).episode.served
    assert facts["seeded"] == "yes"
    assert (facts["calls"], facts["actions"], facts["clipped"]) == ("2", "10", "10")
    assert served.summary()["settings"]["served"]["openpi"]["servers"] == {"all": address}


def test_what_is_claimed_is_used_again_while_it_is_the_same(served: Suite, serve: Serve) -> None:
    first, second = serve("Model"), serve("Model")
    two = "--safemanip-seeds=2"
    served.run(f"--safemanip-policy=openpi@run/1={first}", two)
    before = {path.name: path.read_bytes() for path in served.recordings()}
    assert len(before) == 2
    assert files.load(served.recordings()[0]).episode.served["checkpoint"] == "run/1"
    asked = calls(served)
    # At another address, and at none.
    for address in (second, f"ws://127.0.0.1:{free_port()}"):
        result = served.run(f"--safemanip-policy=openpi@run/1={address}", two)
        result.stdout.fnmatch_lines(
            [
                f"safemanip: openpi at {address}, claimed to be run/1; open-loop steps: *",
                "safemanip: 2 of 2 rollouts reused from .safemanip *",
            ]
        )
        assert calls(served) == asked
    assert {path.name: path.read_bytes() for path in served.recordings()} == before
    result = served.run(f"--safemanip-policy=openpi@run/2={second}", two)
    result.stdout.no_fnmatch_line("*reused*")
    assert len(calls(served)) == 2 * len(asked)


def test_what_a_server_says_of_itself_is_used_again_while_it_is_the_same(
    alone: Suite, serve: Serve
) -> None:
    alone.run(f"--safemanip-policy=openpi={serve('Known')}")
    asked = calls(alone)
    again = alone.run(f"--safemanip-policy=openpi={serve('Known')}")
    again.stdout.fnmatch_lines(["safemanip: 1 of 1 rollout reused from .safemanip *"])
    assert calls(alone) == asked
    recording = files.load(alone.recordings()[0])
    assert recording.episode.served["announced"] == "model:Known weights 1"
    alone.run(f"--safemanip-policy=openpi={serve('Other')}")
    assert len(calls(alone)) == 2 * len(asked)


def test_what_nobody_knows_is_run_again(alone: Suite, serve: Serve) -> None:
    address = serve("Model")
    for times in (1, 2):
        result = alone.run(f"--safemanip-policy=openpi={address}")
        assert len([word for word in calls(alone) if word.startswith("reset")]) == times
    result.stdout.fnmatch_lines(["safemanip: rollouts of openpi are run again *@CHECKPOINT=*"])


def test_a_claim_may_be_in_the_ini_file(alone: Suite, serve: Serve) -> None:
    alone.pytester.makeini(f"{INI}safemanip_checkpoint =\n    openpi = run/3\n")
    result = alone.run(f"--safemanip-policy=openpi={serve('Model')}")
    result.stdout.fnmatch_lines(
        ["safemanip: openpi at ws:*, claimed to be run/3; open-loop steps: 5"]
    )
    said = alone.summary()["settings"]["served"]["openpi"]
    assert said["claimed_checkpoints"] == {"all": "run/3"}


def test_several_servers_of_one_policy_share_its_rollouts(alone: Suite, serve: Serve) -> None:
    one, two = serve("Beside"), serve("Beside")
    policy = f"--safemanip-policy=openpi={one}+{two}"
    result = alone.run(policy, "--safemanip-seeds=6", "--safemanip-jobs=4")
    assert "errors" not in result.parseoutcomes()
    told = calls(alone)
    assert len([word for word in told if word.startswith("reset")]) == 6
    other = alone.run(f"--safemanip-policy=openpi={one}+{serve('Other')}", "--safemanip-fresh")
    assert other.parseoutcomes()["errors"] == 1
    other.stdout.fnmatch_lines(["*its servers do not have the same checkpoint: ws:*weights 1; *2"])


def test_a_server_that_is_not_there_is_said_once(served: Suite) -> None:
    address = f"ws://127.0.0.1:{free_port()}"
    result = served.run(f"--safemanip-policy=pi05={address}", "--safemanip-seeds=4")
    assert result.parseoutcomes()["errors"] <= 2  # with workers, each says it
    result.stdout.fnmatch_lines([f"*{address}: nothing listens*serve_policy.py*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_other_policies_go_on(alone: Suite) -> None:
    address = f"ws://127.0.0.1:{free_port()}"
    chosen = f"--safemanip-policy=openpi={address},rises"
    result = alone.run(chosen, "--safemanip-seeds=2", "-k", "near")
    assert result.parseoutcomes()["errors"] == 2
    assert result.parseoutcomes()["failed"] == 2
    assert alone.summary()["metrics"]["rises"]["rollouts"] == 2


def test_a_server_that_dies_within_an_episode_has_it_begun_again(
    served: Suite, serve: Callable[..., str]
) -> None:
    served.pytester.makeini(INI.replace("start = 0.5", "start = 20"))
    address = serve("Dies", again=True)
    result = served.run(f"--safemanip-policy=openpi={address}", "-k", "near", "--safemanip-seeds=2")
    assert result.parseoutcomes()["failed"] == 2
    assert "errors" not in result.parseoutcomes()
    told = calls(served)
    begun = [word for word in told if word.startswith("reset")]
    result.stdout.fnmatch_lines(["  restarts   1 rollout begun again, 1 time in all: *"])
    assert served.summary()["policies"]["openpi"]["restarts"] == 1
    assert "dies" in told
    assert len(begun) == 3
    before, after = told[: told.index("dies")], told[told.index("dies") :]
    assert [word for word in before if word.startswith("reset")][-1] in after


def test_an_answer_that_cannot_be_executed_is_an_error_and_kept(alone: Suite, serve: Serve) -> None:
    result = alone.run(f"--safemanip-policy=openpi={serve('Wrong')}", "-k", "near")
    assert result.parseoutcomes()["errors"] == 1
    result.stdout.fnmatch_lines(["*actions[[]2, 7] (base_motion) is nan*request and reply: *.npz*"])


def test_what_is_told_can_be_more_than_the_task(alone: Suite, serve: Serve) -> None:
    address = serve("Model")
    (alone.pytester.path / "careful.txt").write_text("Slowly: {instruction}!")
    policy = f"--safemanip-policy=openpi={address}"
    alone.run(policy, "--safemanip-prompt=careful.txt", "-k", "near")
    assert "Slowly: put it there!" in calls(alone)
    (recording,) = alone.recordings()
    assert files.load(recording).episode.instruction == "Slowly: put it there!"


def test_an_address_may_be_in_the_environment(
    alone: Suite, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAFEMANIP_OPENPI", serve("Model"))
    result = alone.run("--safemanip-policy=openpi", "-k", "near")
    assert result.parseoutcomes()["failed"] == 1


def test_recorded_actions_can_be_done_again(alone: Suite) -> None:
    alone.run("--safemanip-policy=rises", "-k", "near")
    (alone.out / "recordings").rename(alone.pytester.path / "before")
    alone.run("--safemanip-policy=recording:before", "-k", "near")
    (before,) = (alone.pytester.path / "before").glob("*.rollout")
    (after,) = alone.recordings()
    one, other = files.load(before), files.load(after)
    assert (one.steps.action == other.steps.action).all()
    assert (one.steps.eef_pose == other.steps.eef_pose).all()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--safemanip-policy=scripted=ws://a"], "*'scripted=ws://a' has an address; *"),
        (["--safemanip-policy=scripted:slip(distance=0.03)"], "*an @, as in scripted:slip@0.03"),
        (
            ["--safemanip-policy=pi05=ws://a,pi05=ws://b"],
            "*'pi05' has two addresses; *: pi05=ws://a+ws://b",
        ),
        (["--safemanip-policy=pi05=tcp://a"], "*this policy is reached over ws or wss*"),
        (["--safemanip-policy=groot-to=tcp://a"], "*expected groot-to=atomic_seen@tcp://*"),
        (
            ["--safemanip-policy=groot-to=atomic_seen@a"],
            "*no server is given for Reach, which is in mine; there are servers for atomic_seen",
        ),
        (["--safemanip-policy=rises", "--safemanip-prompt=shrot"], "*'shrot' is none of task*"),
    ],
)
def test_what_cannot_be_asked_is_refused_at_once(
    one_suite: Suite, arguments: list[str], says: str
) -> None:
    set_up(one_suite)
    one_suite.pytester.makeini(INI)
    result = one_suite.run(*arguments)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: {says}"])
