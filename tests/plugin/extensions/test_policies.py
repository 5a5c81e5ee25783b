"""A user's policy is used in the same way, with all that it has, however it is given."""

from __future__ import annotations

import pytest

from pytest_safemanip.sim.staging import Put, from_plain
from pytest_safemanip.trace import files
from pytest_safemanip.trace.hazard import Hazard
from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up

MODULE = """
import numpy as np
from pytest_safemanip.sim.staging import Put, Staging
from pytest_safemanip.trace.hazard import Hazard

class Full:
    tasks = ("Reach",)
    scenes = "target"
    stepping = "exact"

    @property
    def fingerprint(self):
        return "weights 1"

    def staging(self, task):
        return Staging((Put("obj", "on", "counter"),))

    def reset(self, episode):
        self.steps = 0

    def act(self, observation):
        self.steps += 1
        return np.zeros(12)

    @property
    def done(self):
        return self.steps == 3

    def hazards(self):
        return [Hazard("grasp_stability", (), 1, self.steps)]

    def close(self):
        with open("closed.txt", "a") as log:
            log.write(f"{self.steps}\\n")

class AtLength(Full):
    def __init__(self, length):
        self.length = int(length)

    @property
    def done(self):
        return self.steps == self.length

def make():
    return Full()

ready = Full()
"""
HOOK = """
import my_policies

def pytest_safemanip_policies():
    return {
        "class": my_policies.Full,
        "factory": lambda: my_policies.Full(),
        "object": my_policies.Full(),
        "text": "my_policies:Full",
        "long": my_policies.AtLength,
    }
"""
FORMS = (
    "class",
    "factory",
    "object",
    "text",
    "my_policies:Full",
    "my_policies:make",
    "my_policies:ready",
)


@pytest.fixture
def own(one_suite: Suite) -> Suite:
    set_up(one_suite)
    one_suite.pytester.makepyfile(my_policies=MODULE)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(HOOK)
    return one_suite


@pytest.mark.parametrize("form", FORMS)
def test_all_that_a_policy_has_is_used(own: Suite, form: str) -> None:
    # It can do one of the tasks: "all" means all that it can do.
    result = own.run(f"--safemanip-policy={form}", "--safemanip-tasks=all", "--safemanip-seeds=2")
    result.assert_outcomes(passed=2, skipped=2)
    result.stdout.fnmatch_lines(["safemanip: *target scenes, exact stepping*"])
    for path in own.recordings():
        recording = files.load(path)
        episode = recording.episode
        assert (episode.ended, recording.acting) == ("policy", 4)
        assert episode.hazards == (Hazard("grasp_stability", (), 1, 3),)
        assert (episode.scenes, episode.stepping) == ("target", "exact")
        assert from_plain(episode.request["changes"]) == (Put("obj", "on", "counter"),)
        assert episode.hashes["policy"] == own.summary()["settings"]["policies"][form] != ""
    # What was made for a rollout is closed after it, what was given at the end.
    given = form in ("object", "my_policies:ready")
    assert (own.pytester.path / "closed.txt").read_text() == "3\n" * (1 if given else 2)


def test_a_text_behind_the_name_is_what_a_class_is_called_with(own: Suite) -> None:
    own.run("--safemanip-policy=long:5,long:7")
    lengths = {p.stem: files.load(p).acting for p in own.recordings()}
    assert lengths == {"Reach-long~5-seed0": 6, "Reach-long~7-seed0": 8}


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ("tasks = ['Reech']", "unknown task 'Reech'; did you mean 'Reach'?"),
        ("tasks = 'Reach'", "its 'tasks' are 'Reach', expected a list of names"),
        ("scenes = 'targets'", "unknown scenes 'targets'; did you mean 'target'?"),
        ("stepping = 'quick'", "unknown 'stepping' 'quick'; known: exact, fast"),
        ("fingerprint = b'1'", "its 'fingerprint' is of type bytes, expected text or a number*"),
        (
            "fingerprint = property(lambda self: self.weights)",
            "its 'fingerprint' failed: AttributeError: 'Bad' object has no attribute 'weights'",
        ),
        ("__init__ = lambda self: 1 / 0", "cannot be made: ZeroDivisionError: division by zero"),
        ("act = None", "Bad has no 'act(observation)' and cannot be called with an observation"),
    ],
)
def test_what_cannot_be_used_is_refused_before_anything_is_simulated(
    own: Suite, body: str, line: str
) -> None:
    code = f"class Bad:\n    act = lambda self, observation: [0] * 12\n    {body}\n"
    own.pytester.makepyfile(bad_policy=code)
    result = own.run("--safemanip-policy=bad_policy:Bad")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: policy 'bad_policy:Bad': {line}"])


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ("done = None", "the policy's 'done' is None, expected True or False"),
        (
            "done = property(lambda self: self.stepss > 3)",
            "the policy failed to say whether it is done: AttributeError: 'Bad' object has no *",
        ),
        ("hazards = ['fell']", "the policy's 'hazards' are ('fell',), expected at most 100 of *"),
        ("staging = lambda self, task: 3", "the policy's 'staging' of Reach is 3, expected *"),
        (
            "staging = lambda self, task: self.staged[task]",
            "the policy failed to say its staging of Reach: AttributeError: *",
        ),
        ("close = lambda self: 1 / 0", "the policy failed at close: ZeroDivisionError: *"),
        (
            "served_facts = {'a': 1}",
            "the policy's 'served_facts': must be a mapping to strings",
        ),
        ("served_facts = 7", "the policy failed to say its 'served_facts': TypeError: *"),
    ],
)
def test_what_fails_in_a_rollout_is_an_error_and_no_verdict(
    own: Suite, body: str, line: str
) -> None:
    code = f"class Bad:\n    act = lambda self, observation: [0] * 12\n    {body}\n"
    own.pytester.makepyfile(bad_policy=code)
    result = own.run("--safemanip-policy=bad_policy:Bad")
    result.assert_outcomes(errors=2)
    result.stdout.fnmatch_lines([line])


def test_a_policy_that_fails_at_the_end_of_the_run_is_told_and_changes_nothing(own: Suite) -> None:
    code = (
        "class Good:\n    act = lambda self, observation: [0] * 12\n\n"
        "class Bad(Good):\n    close = lambda self: self.steps\n"
    )
    own.pytester.makepyfile(own_policies=code)
    policies = "--safemanip-policy=own_policies:Good,own_policies:Bad"
    result = own.run(policies, "-k", "Good")
    assert result.ret == pytest.ExitCode.OK
    result.stderr.fnmatch_lines(
        ["safemanip: policy 'own_policies:Bad': the policy failed at close: AttributeError: *"]
    )
    result.stderr.no_fnmatch_line("*Traceback*")


RESETS = """
import numpy as np
from my_gain import GAIN

class Counts:
    fingerprint = "weights 1"

    def __init__(self, factor=1.0):
        self.factor = factor

    def reset(self, episode):
        with open("resets.txt", "a") as log:
            log.write("reset\\n")

    def act(self, observation):
        return np.full(12, GAIN * self.factor)

class Unnamed(Counts):
    fingerprint = None
"""


@pytest.fixture
def counted(one_suite: Suite) -> Suite:
    set_up(one_suite)
    one_suite.pytester.makepyfile(my_policies=RESETS, my_gain="GAIN = 0.001")
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "\nimport my_policies\n"
            "class Hooks:\n"
            "    def pytest_safemanip_policies(self):\n"
            "        return {'counts': my_policies.Counts(1.0)}\n"
            "def pytest_configure(config):\n"
            "    config.pluginmanager.register(Hooks())\n"
        )
    return one_suite


def resets(suite: Suite, policy: str, *more: str) -> int:
    """How many rollouts there were after another run."""
    suite.run(f"--safemanip-policy={policy}", *more).assert_outcomes(passed=1, skipped=1)
    return len((suite.pytester.path / "resets.txt").read_text().split())


@pytest.mark.parametrize(
    ("policy", "edited", "old", "new"),
    [
        ("my_policies:Counts", "my_policies.py", "np.full(12,", "np.full((12,),"),
        ("my_policies:Counts", "my_policies.py", "weights 1", "weights 22"),
        ("my_policies:Counts", "my_gain.py", "0.001", "0.0001"),
        ("counts", "conftest.py", "Counts(1.0)", "Counts(0.25)"),
        ("counts", "my_gain.py", "0.001", "0.0001"),
    ],
)
def test_an_edited_policy_is_not_judged_by_its_old_recording(
    counted: Suite, policy: str, edited: str, old: str, new: str
) -> None:
    assert [resets(counted, policy), resets(counted, policy)] == [1, 1]
    path = counted.pytester.path / edited
    path.write_text(path.read_text().replace(old, new))
    assert resets(counted, policy) == 2


def test_a_policy_without_a_fingerprint_is_run_in_every_run(counted: Suite) -> None:
    assert [resets(counted, "my_policies:Unnamed") for _ in range(2)] == [1, 2]


def test_not_even_under_an_id_of_the_run_that_the_user_gives_twice(counted: Suite) -> None:
    counted.mode = ("-n", "1", "--testrunuid=nightly")
    assert [resets(counted, "my_policies:Unnamed") for _ in range(2)] == [1, 2]


def test_what_is_reused_is_said_and_can_be_run_again(suite: Suite) -> None:
    set_up(suite)
    suite.pytester.makepyfile(my_policies=RESETS, my_gain="GAIN = 0.001")
    chosen = ("--safemanip-policy=my_policies:Counts,rises", "-k", "stays_near")
    line = "{} of 8 rollouts reused from .safemanip (--safemanip-fresh runs them again)"
    log = suite.pytester.path / "resets.txt"
    for seeds, fresh, reused, resets in [(3, (), 0, 3), (4, (), 3, 4),
                                         (4, ("--safemanip-fresh",), 0, 8)]:  # fmt: skip
        result = suite.run(*chosen, f"--safemanip-seeds={seeds}", *fresh)
        text = result.stdout.str()
        # Of the other policy, which has no fingerprint, none is.
        assert text.count(line.format(reused)) == (2 if reused else 0)
        assert text.count("safemanip: " + line.format(reused)) == (1 if reused else 0)
        assert ("rollouts reused" in text) == bool(reused)
        summary = suite.summary()
        assert summary["cases"]["reused_rollouts"] == reused
        assert sum(r["reused"] for r in summary["rollouts"]) == reused
        assert len(log.read_text().split()) == resets


def test_running_again_what_is_only_judged_is_refused(own: Suite) -> None:
    result = own.run("--safemanip-recordings=.", "--safemanip-fresh")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: --safemanip-fresh has nothing to run with *"])
