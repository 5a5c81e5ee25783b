"""A policy that was trained on pictures of another world than there is: never gated silently."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree

import pytest

from pytest_safemanip.cli.main import main
from tests.plugin.conftest import Suite
from tests.plugin.servers.test_served import INI, Serve, serve, with_models

__all__ = ["serve"]

SAYS = "NOT COMPARABLE: stand-in assets"
GATE = "--safemanip-gate=violation_rate <= 100 %"


@pytest.fixture
def served(suite: Suite) -> Suite:
    """In each of the three modes."""
    return with_models(suite)


@pytest.fixture
def alone(one_suite: Suite) -> Suite:
    """Without xdist, where the mode cannot matter."""
    return with_models(one_suite)


def asked(suite: Suite) -> bool:
    return (suite.pytester.path / "calls.txt").exists()


def test_without_official_assets_nothing_is_simulated(served: Suite, serve: Serve) -> None:
    result = served.run(f"--safemanip-policy=openpi={serve('Model')}", "--safemanip-assets=auto")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: policy 'openpi' looks through cameras, *--safemanip-assets=primitive*"]
    )
    assert not asked(served)
    assert not served.recordings()


def test_robocasas_download_is_named_with_its_size(alone: Suite, serve: Serve) -> None:
    alone.pytester.makeini("[pytest]\nsafemanip_tasks = OpenDrawer\n")
    policy = f"--safemanip-policy=pi05={serve('Model')}"
    result = alone.run(policy, "--safemanip-assets=auto", "-p", "no:randomly")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: policy 'pi05' *python -m robocasa.scripts.download_kitchen_assets (10 GB)*"]
    )
    assert not asked(alone)


def test_a_policy_that_sees_no_pictures_needs_no_assets(alone: Suite) -> None:
    result = alone.run("--safemanip-policy=rises", "--safemanip-assets=auto", GATE)
    assert result.ret == 0
    assert SAYS not in result.stdout.str()


def test_a_gate_on_stand_ins_has_an_exit_status_of_its_own(served: Suite, serve: Serve) -> None:
    policy = f"--safemanip-policy=openpi={serve('Model')}"
    result = served.run(policy, GATE, "--junitxml=found.xml", "-q")
    assert result.ret == 11
    # Below the options that shorten it, too.
    result.stdout.fnmatch_lines(
        [
            f"openpi: 1 of 1 rollout complete*; {SAYS}",
            f"{SAYS} (PASS)",
            "  violation_rate <= 1, openpi: *",
            "exit status 11: *--safemanip-allow-standins*",
        ]
    )
    found = served.summary()
    assert found["policies"]["openpi"] == {
        "restarts": 0,
        "infrastructure_failures": 0,
        "comparable": False,
        "note": SAYS,
    }
    assert found["release"]["not_comparable"] == {"openpi": SAYS}
    assert [gate["comparable"] for gate in found["release"]["gates"]] == [False]
    cases = ElementTree.parse(served.pytester.path / "found.xml").iter("testcase")
    told = {
        case.attrib["name"]: {p.attrib["name"]: p.attrib["value"] for p in case.iter("property")}
        for case in cases
    }
    assert len(told) == 3
    assert {properties["safemanip.comparable"] for properties in told.values()} == {SAYS}


def test_it_decides_where_that_is_allowed_and_still_says_so(served: Suite, serve: Serve) -> None:
    policy = f"--safemanip-policy=openpi={serve('Model')}"
    allowed = "--safemanip-allow-standins"
    result = served.run(policy, GATE, allowed)
    assert result.ret == 0
    result.stdout.fnmatch_lines(
        [
            f"safemanip: openpi: {SAYS}",
            f"openpi: 1 complete rollout of 1 task; {SAYS}",
            f"  PASS, {SAYS}",
            "    violation_rate <= 1, openpi: *",
        ]
    )
    result = served.run(policy, "--safemanip-gate=violation_rate <= 0", allowed)
    assert result.ret == 1
    result.stdout.fnmatch_lines([f"  FAIL, {SAYS}", "    violation_rate <= 0, openpi: *"])


def test_a_test_of_ones_own_that_fails_is_not_hidden(alone: Suite, serve: Serve) -> None:
    alone.pytester.makepyfile(test_own="def test_own(): assert False")
    of_ini = f"safemanip_policy = openpi={serve('Model')}\nsafemanip_gate = violation_rate <= 1\n"
    alone.pytester.makeini(INI + of_ini)
    result = alone.run()
    assert result.parseoutcomes()["failed"] == 2
    assert result.ret == 1


def test_recordings_and_reports_remember_it(
    alone: Suite, serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    alone.run(f"--safemanip-policy=openpi={serve('Model')}", GATE)
    recordings = f"--safemanip-recordings={alone.out / 'recordings'}"
    again = alone.run(recordings, GATE, "--safemanip-out=again")
    assert again.ret == 11
    capsys.readouterr()
    run = [str(alone.out), "--gate", "violation_rate <= 100 %"]
    assert main(["report", *run]) == 11
    assert f"  {SAYS} (PASS)" in capsys.readouterr().out
    assert main(["report", *run, "--allow-standins"]) == 0
    capsys.readouterr()
    assert main(["report", *run, "--json"]) == 11
    assert json.loads(capsys.readouterr().out)["policies"]["openpi"]["note"] == SAYS


def test_a_comparison_with_a_baseline_is_none_either(alone: Suite, serve: Serve) -> None:
    address = serve("Model")
    policy = f"--safemanip-policy=openpi={address}"
    alone.run(policy, "--safemanip-out=before", "--safemanip-seeds=4")
    margin = alone.pytester.path / "gates.yaml"
    margin.write_text("margin: 0.9\n")
    against = ("--safemanip-baseline=before", "--safemanip-gates=gates.yaml")
    result = alone.run(policy, *against, "--safemanip-seeds=4")
    assert result.ret == 11
    result.stdout.fnmatch_lines([f"openpi against openpi of before*: {SAYS}"])
    assert alone.run(policy, *against, "--safemanip-seeds=4", "--safemanip-allow-standins").ret == 0


def test_the_fixture_does_not_show_it_another_world_either(alone: Suite, serve: Serve) -> None:
    alone.pytester.makepyfile(
        test_own="""
        def test_own(safemanip_rollout):
            safemanip_rollout("Reach", policy="openpi")
        """
    )
    alone.pytester.makeini((alone.pytester.path / "tox.ini").read_text())
    environment = ["-o", "safemanip_policy=", "test_own.py", "--safemanip-assets=auto"]
    serve("Model")
    result = alone.run(*environment)
    assert result.parseoutcomes()["failed"] == 1
    result.stdout.fnmatch_lines(["*looks through cameras, and RoboCasa*official assets are not*"])
