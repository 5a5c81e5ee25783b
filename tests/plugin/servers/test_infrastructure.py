"""Failures of servers and simulators: an exit status and words of their own, never a verdict."""

from __future__ import annotations

import textwrap

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.servers.test_served import INI, Serve, calls, free_port, serve, with_models

__all__ = ["serve"]

MODELS = '''

class Slow(Model):
    """Answers the second call of an episode far too late, once."""

    def infer(self, request):
        lines = CALLS.read_text().splitlines()
        if lines.count("put it there") == 1 and "slept" not in lines:
            note("slept")
            time.sleep(1.5)
        return super().infer(request)

class Crawls(Model):
    """Answers the trial, and then nothing of seed 0 in time."""

    seed = 0

    def reset(self, seed):
        super().reset(seed)
        self.seed = seed
        self.calls = 0

    def infer(self, request):
        self.calls += 1
        if request["prompt"] != "open the drawer" and self.seed == 0 and self.calls == 2:
            time.sleep(1.5)
        return super().infer(request)

class Short(Model):
    def infer(self, request):
        return {"actions": super().infer(request)["actions"][:2]}

class Raises(Model):
    def infer(self, request):
        if request["prompt"] != "open the drawer":
            raise MemoryError("out of memory")
        return super().infer(request)
'''
QUICK = INI.replace("    call = 10", "    call = 0.7\n    open = 5\n    restart = 20")
GATE = "--safemanip-gate=violation_rate <= 100 %"
ALLOW = "--safemanip-allow-standins"


@pytest.fixture
def served(suite: Suite) -> Suite:
    """In each of the three modes."""
    return prepared(suite)


@pytest.fixture
def alone(one_suite: Suite) -> Suite:
    """Without xdist, where the mode cannot matter."""
    return prepared(one_suite)


def prepared(suite: Suite) -> Suite:
    with_models(suite)
    suite.pytester.makeini(QUICK)
    model = suite.pytester.path / "model.py"
    model.write_text(model.read_text() + textwrap.dedent(MODELS))
    return suite


def test_a_call_that_is_too_slow_has_the_episode_begun_again(served: Suite, serve: Serve) -> None:
    policy = f"--safemanip-policy=openpi={serve('Slow')}"
    result = served.run(policy, "--safemanip-seeds=2", GATE, ALLOW)
    assert result.ret == 0
    assert "slept" in calls(served)
    assert "errors" not in result.parseoutcomes()
    result.stdout.fnmatch_lines(["  restarts   1 rollout begun again, 1 time in all: *"])
    assert served.summary()["policies"]["openpi"]["restarts"] == 1
    assert sum(rollout["restarts"] for rollout in served.summary()["rollouts"]) == 1


def test_calls_that_stay_too_slow_end_their_own_rollout_only(alone: Suite, serve: Serve) -> None:
    policy = f"--safemanip-policy=openpi={serve('Crawls')}"
    result = alone.run(policy, "--safemanip-seeds=3", GATE, ALLOW)
    assert result.ret == 10
    found = alone.summary()
    errors = {rollout["seed"]: rollout["error"] for rollout in found["rollouts"]}
    assert "the episode was begun 3 times, and never ended" in errors[0]
    assert (errors[1], errors[2]) == ("", "")
    assert found["policies"]["openpi"]["restarts"] == 2
    assert found["policies"]["openpi"]["infrastructure_failures"] == 1
    result.stdout.fnmatch_lines(
        [
            "openpi: 2 complete rollouts of 1 task, 1 with errors (1 for failures of the*",
            "  restarts   1 rollout begun again, 2 times in all: *",
            "exit status 10: the infrastructure failed, nothing else did; *",
            "INFRASTRUCTURE *",
            "*INCOMPLETE*1 of 3 rollouts have no verdict (1 for failures of the infrastructure)*",
        ]
    )
    assert "Traceback" not in result.stdout.str()


def test_a_server_that_is_not_there_is_no_violation(served: Suite) -> None:
    policy = f"--safemanip-policy=pi05=ws://127.0.0.1:{free_port()}"
    result = served.run(policy, "--safemanip-seeds=2", GATE)
    assert result.ret == 10
    assert "VIOLATED" not in result.stdout.str()


def test_a_violation_beside_it_is_one(alone: Suite) -> None:
    policy = f"--safemanip-policy=pi05=ws://127.0.0.1:{free_port()},rises"
    assert alone.run(policy).ret == 1


def test_a_model_that_does_not_fit_is_said_once_before_anything_is_simulated(
    alone: Suite, serve: Serve
) -> None:
    policy = f"--safemanip-policy=openpi={serve('Short')}"
    result = alone.run(policy, "--safemanip-seeds=4")
    assert result.ret == 1  # not the infrastructure's fault
    assert result.parseoutcomes()["errors"] == 1
    says = "trying the server: 2 actions, but 5 are executed"
    result.stdout.fnmatch_lines([f"*{says}*"])
    assert calls(alone) == []


def test_what_a_server_says_at_length_is_shown_once(alone: Suite, serve: Serve) -> None:
    policy = f"--safemanip-policy=openpi={serve('Raises')}"
    result = alone.run(policy, "--safemanip-seeds=3")
    assert result.parseoutcomes()["errors"] == 6
    text = result.stdout.str()
    assert text.count("Traceback (most recent call last)") == 1
    assert text.count("the server failed: MemoryError: out of memory") >= 6


def test_a_simulator_that_crashes_is_no_violation(alone: Suite) -> None:
    conftest = alone.pytester.path / "conftest.py"
    conftest.write_text(
        conftest.read_text()
        + textwrap.dedent(
            """
            from pytest_safemanip.sim.backend import Provenance
            from pytest_safemanip.sim.process import ProcessBackend
            from tests import toy

            def crashing(options):
                about = Provenance("toy", "primitive")
                factory = "tests.sim.process.children:simulator"
                return ProcessBackend(factory, {}, toy.SPEC, about, options.logs)

            def pytest_safemanip_backends():
                return {"toy": simulator(crashing)}
            """
        )
    )
    result = alone.run("--safemanip-policy=rises", GATE, "--safemanip-seeds=4:5")
    assert result.ret == 10
    result.stdout.fnmatch_lines(["*the simulator process died at step 1 (exit code 7)*"])


def test_a_token_is_sent_and_nowhere_else(
    served: Suite, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret = "-".join(["not", "to", "be", "seen"])
    monkeypatch.setenv("SAFEMANIP_TOKEN_OPENPI", secret)
    for model in ("Model", "Raises", "Wrong"):
        policy = f"--safemanip-policy=openpi={serve(model)}"
        result = served.run(policy, "--junitxml=found.xml", "-vv", "-l", "--safemanip-fresh")
        assert secret not in result.stdout.str() + result.stderr.str()
    kept = [path for path in served.pytester.path.rglob("*") if path.is_file()]
    assert {".rollout", ".json", ".xml", ".npz"} <= {path.suffix for path in kept}
    assert not [path for path in kept if secret.encode() in path.read_bytes()]


def test_a_setting_of_a_preset_is_obeyed_and_recorded(alone: Suite, serve: Serve) -> None:
    alone.pytester.makeini(QUICK + "safemanip_presets =\n    openpi.open_loop_steps = 2\n")
    alone.run(f"--safemanip-policy=openpi={serve('Model')}")
    assert len(calls(alone)) == 1 + 5  # ten steps, two at a time
    assert alone.summary()["settings"]["served"]["openpi"]["open_loop_steps"] == 2


def test_a_setting_that_there_is_not_is_a_usage_error(alone: Suite) -> None:
    alone.pytester.makeini(QUICK + "safemanip_presets = pi05.open_lop_steps = 2\n")
    result = alone.run("--safemanip-policy=pi05")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: safemanip_presets: *did you mean 'open_loop_steps'?"])
