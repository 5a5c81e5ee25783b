"""A pytest run that has nothing to do with safety is not slowed down or changed."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite

HEAVY = ("numpy", "yaml", "filelock", "mujoco", "robosuite", "robocasa", "ltlf2dfa")


def test_nothing_heavy_is_imported(one_suite: Suite) -> None:
    path = one_suite.pytester.makepyfile(
        f"""
        import sys
        def test_it(pytestconfig):
            assert pytestconfig.pluginmanager.hasplugin("safemanip")
            own = {{name for name in sys.modules if name.startswith("pytest_safemanip.")}}
            assert not own & {{"pytest_safemanip.run.plan", "pytest_safemanip.judge"}}
            assert not {set(HEAVY)} & set(sys.modules)
        """
    )
    result = one_suite.pytester.runpytest_subprocess(path, "-p", "no:hypothesispytest")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("*afemanip: *")
    assert not one_suite.out.exists()


def test_help_lists_the_options(one_suite: Suite) -> None:
    result = one_suite.pytester.runpytest("--help")
    result.stdout.fnmatch_lines(
        [
            "temporal safety of robot manipulation:",
            "*--safemanip-policy=*",
            "*--safemanip-tasks=*",
            "*--safemanip-params=*",
        ]
    )
    assert "safemanip-select" not in result.stdout.str()


@pytest.mark.parametrize("arguments", [[], ["-n", "2"], ["--collect-only"]])
def test_a_conftest_with_our_hooks_needs_no_suite(one_suite: Suite, arguments: list[str]) -> None:
    one_suite.pytester.makeconftest("def pytest_safemanip_policies():\n    return {}\n")
    one_suite.pytester.makepyfile("def test_it(): pass")
    assert one_suite.pytester.runpytest(*arguments).ret == 0


def test_hypothesis_is_told_about_types_without_importing_them(one_suite: Suite) -> None:
    one_suite.pytester.makepyfile(
        """
        import sys
        import hypothesis

        def test_it():
            own = {name for name in sys.modules if name.startswith("pytest_safemanip.trace")}
            assert not own | ({"numpy"} & set(sys.modules))
            from pytest_safemanip.trace import Recording, Scene
            from pytest_safemanip.ltlf import Formula
            found_first = hypothesis.settings(phases=[hypothesis.Phase.generate], database=None)
            for known in (Recording, Scene, Formula):
                strategy = hypothesis.strategies.from_type(known)
                found = hypothesis.find(strategy, lambda found: True, settings=found_first)
                assert isinstance(found, known)
        """
    )
    result = one_suite.pytester.runpytest_subprocess()
    result.assert_outcomes(passed=1)
