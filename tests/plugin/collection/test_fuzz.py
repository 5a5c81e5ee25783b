"""``--safemanip-fuzz``: laws as items."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings

from pytest_safemanip.fuzz.laws import laws_of
from pytest_safemanip.propositions.catalogue import SHIPPED
from pytest_safemanip.trace import files
from tests.plugin.conftest import Suite

CONFTEST = """
import numpy as np
from pytest_safemanip.propositions.definition import Parameter, Proposition

def straying(view, o):
    '''A hand is further from where it started than allowed, whatever the object.'''
    hands = view.trace.steps.eef_poses[..., :3]
    way = np.linalg.norm(hands - hands[0], axis=-1)
    return (way > view.parameters["straying.distance"]).any(axis=1)

def pytest_safemanip_propositions():
    limit = Parameter("straying.distance", "m", 0.12, "for the test")
    return [Proposition("straying", ("object",), lambda parameters: 0.0, (limit,), straying)]
"""
NEAR = """
id: near
category: housekeeping
title: The hand stays near
source: the house rules
for_each: o in objects
formula: G !straying
atoms: {straying: straying(o)}
"""
THREE = """
import numpy as np
from pytest_safemanip.propositions.definition import Proposition

def three(view):
    if len(view.trace) >= 3:
        raise ValueError("three steps")
    return np.ones(len(view.trace), bool)

def pytest_safemanip_propositions():
    return [Proposition("three", (), lambda parameters: 0.0, (), three)]
"""
UNSHRUNK = """
from hypothesis import Phase, settings
settings.register_profile("unshrunk", phases=[Phase.generate], database=None)
settings.load_profile("unshrunk")
"""
LAWS = len([law for proposition in SHIPPED for law in laws_of(proposition)])
FEW = ("--safemanip-fuzz", "--safemanip-fuzz-examples=25")


@pytest.fixture(autouse=True)
def _own_profile() -> Iterator[None]:
    """What a conftest.py loads is for its run alone."""
    before = settings.get_current_profile_name()
    yield
    settings.load_profile(before)


@pytest.fixture
def own(suite: Suite) -> Suite:
    suite.pytester.makeconftest(CONFTEST)
    return suite


def test_a_users_proposition_is_tried(own: Suite) -> None:
    with (own.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(UNSHRUNK)
    result = own.run(*FEW, "-k", "straying and (window or motion or swap)")
    result.assert_outcomes(passed=2, failed=1, deselected=own.seen_deselected(LAWS + 9))
    result.stdout.fnmatch_lines(
        [
            "safemanip: * laws of 43 propositions, examples of each: 25",
            "*fuzz / straying / window*",
            "law window: a value depends on the steps of its window only",
            "straying(obj) at step *: True on the recording, False without the steps before *",
            "recording       .safemanip/fuzz/straying-window.rollout",
            "reproduce with  pytest --safemanip-fuzz-examples=25 'safemanip::fuzz[[]straying-w*",
            "FAILED safemanip::fuzz[[]straying-window]*",
        ]
    )
    assert files.load(own.out / "fuzz" / "straying-window.rollout").episode.task == "fuzz"


def test_the_smallest_failure_is_shown_and_kept(one_suite: Suite) -> None:
    one_suite.pytester.makeconftest(THREE)
    result = one_suite.run("safemanip::fuzz[three-total]", "--safemanip-fuzz-examples=200")
    result.stdout.fnmatch_lines(
        [
            "law total: it has a boolean value at every step of any recording",
            "three raises ValueError: three steps",
            "obj (apple); cab (HingeCabinet), sink (Sink), stove (Stove); 3 steps of 0.05 s",
            "  step  what changes",
            "     0  hand at *",
            '    raise ValueError("three steps")',
            "recording       .safemanip/fuzz/three-total.rollout",
        ]
    )
    kept = one_suite.out / "fuzz" / "three-total.rollout"
    assert len(files.load(kept).steps) == 3


def test_an_id_is_enough(suite: Suite) -> None:
    result = suite.run("safemanip::fuzz[settled-swap]", "--safemanip-fuzz-examples=2", "-v")
    result.assert_outcomes(passed=1)
    assert not (suite.out / "summary.json").exists()


def test_beside_the_judgement_of_recordings(one_suite: Suite) -> None:
    one_suite.has_recorded(("OpenDrawer", "scripted"))
    recorded = f"--safemanip-recordings={one_suite.out / 'recordings'}"
    chosen = ["--safemanip-fuzz", "--safemanip-fuzz-examples=2", recorded]
    result = one_suite.run(*chosen, "-k", "reach_in-sign or collision_contact")
    result.assert_outcomes(passed=2, deselected=LAWS - 1 + 2)
    assert one_suite.summary()["metrics"]["scripted"]["rollouts"] == 1


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--safemanip-properties=release_stability"], {"obj_released", "settled", "obj_grasped"}),
        (["--safemanip-properties=near"], {"straying"}),
        (["--safemanip-fuzz-propositions=mine"], {"straying"}),
        (["--safemanip-fuzz-propositions=reach_*,mine"], {"reach_in", "straying"}),
        (["--safemanip-fuzz-propositions=all", "--safemanip-properties=near"], None),
        ([], None),
    ],
)
def test_the_propositions_that_are_tried_are_chosen(
    one_suite: Suite, arguments: list[str], names: set[str] | None
) -> None:
    one_suite.pytester.makeconftest(CONFTEST)
    one_suite.pytester.mkdir("rules").joinpath("near.yaml").write_text(NEAR)
    one_suite.pytester.makeini("[pytest]\nsafemanip_property_paths = rules\n")
    result = one_suite.run("--safemanip-fuzz", *arguments, "--collect-only", "-q")
    listed = {line.split("[")[1].split("-")[0] for line in result.outlines if "fuzz[" in line}
    assert listed == (names or {"straying", *(proposition.name for proposition in SHIPPED)})


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["--safemanip-fuzz", "--safemanip-fuzz-propositions=setled"],
            "--safemanip-fuzz-propositions: 'setled' matches no proposition; did you mean *",
        ),
        (
            ["safemanip::fuzz[setled-swap]"],
            "unknown node id: safemanip::fuzz[[]setled-swap]; did you mean "
            "'safemanip::fuzz[[]settled-swap]'[?]",
        ),
        (
            ["--safemanip-fuzz", "--safemanip-fuzz-examples=none"],
            "--safemanip-fuzz-examples: expected a number from 1 to 1000000, found 'none'",
        ),
        (
            ["--safemanip-fuzz-examples=5"],
            "--safemanip-fuzz-examples has no effect without --safemanip-policy or *",
        ),
    ],
)
def test_what_cannot_be_done_is_said_at_once(
    one_suite: Suite, arguments: list[str], says: str
) -> None:
    result = one_suite.run(*arguments)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: {says}"])


def test_without_hypothesis_it_says_what_to_install(one_suite: Suite) -> None:
    missing = "raise ModuleNotFoundError(\"No module named 'hypothesis'\", name='hypothesis')"
    one_suite.pytester.makepyfile(hypothesis=missing)
    chosen = ("--safemanip-fuzz", "-p", "no:hypothesispytest")
    result = one_suite.pytester.runpytest_subprocess(*chosen)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: --safemanip-fuzz needs Hypothesis: pip install '.[[]fuzz]' in a *"]
    )


def test_hypothesis_profile_is_respected(one_suite: Suite) -> None:
    one_suite.pytester.makeconftest(CONFTEST + UNSHRUNK.replace("phases", "max_examples=1, phases"))
    # The first example that Hypothesis makes is the simplest one, in which nothing moves.
    one_suite.run("safemanip::fuzz[straying-window]").assert_outcomes(passed=1)
