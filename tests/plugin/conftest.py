"""Runs of the plugin in a folder of their own: without xdist, with it switched off, and with it."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

# What a run of pytester's imports first is forgotten with it: each would import these anew, and of
# msgpack imported twice the types differ, with which Ray fails.
import msgpack  # noqa: F401
import platformdirs
import pytest
import websockets.sync.client  # noqa: F401

import pytest_safemanip.faults.policy
import pytest_safemanip.plugin.configure
import pytest_safemanip.policies.remote.served  # noqa: F401
from pytest_safemanip.report.ci.places import ROOTS
from tests.conftest import Rollouts
from tests.warm import Warm

CACHE = platformdirs.user_cache_dir()
MODES = {"without xdist": ("-p", "no:xdist"), "-n 0": ("-n", "0"), "-n 2": ("-n", "2")}
IDLE = ("hypothesispytest", "allure_pytest", "anyio", "timeout", "html", "metadata")
"""Plugins that happen to be installed; each process of each run would import them again."""


def joined(result: pytest.RunResult) -> pytest.LineMatcher:
    """The output with gates in a line each, however narrow the terminal is."""
    lines: list[str] = []
    for line in result.outlines:
        if lines and line.startswith(" " * 8) and lines[-1].startswith("  "):
            lines[-1] += f" {line.strip()}"
        else:
            lines.append(line)
    return pytest.LineMatcher(lines)


class Suite:
    """A user's folder.

    Attributes:
        without: plugins that are left out of its runs.
        python: what its runs start workers and simulators with.
    """

    def __init__(
        self, pytester: pytest.Pytester, rollouts: Rollouts, mode: tuple[str, ...], python: str
    ):
        self.pytester, self.mode, self.without = pytester, mode, IDLE
        self.out = pytester.path / ".safemanip"
        self.python, self._rollouts = python, rollouts

    def has_recorded(self, *wanted: tuple[str, str]) -> None:
        """There was a run before that left these recordings, task and policy each."""
        self._rollouts.put_into(self.out, *wanted)

    def run(self, *arguments: str) -> pytest.RunResult:
        """Run pytest as the user does."""
        chosen = [*arguments, *self.mode, *(f"-pno:{plugin}" for plugin in self.without)]
        if "--lf" not in arguments:
            chosen += ["-p", "no:cacheprovider"]
        if not any(a.startswith("--safemanip-assets") for a in arguments):
            chosen.append("--override-ini=safemanip_assets=primitive")
        with self._warm():
            return self.pytester.runpytest(*chosen)

    def run_apart(self, *arguments: str) -> pytest.RunResult:
        """Run pytest in a process of its own, that may be killed."""
        plugins = ("-p", "no:hypothesispytest", "-p", "no:cacheprovider")
        with self._warm():
            return self.pytester.runpytest_subprocess(*arguments, *plugins, timeout=120)

    @contextlib.contextmanager
    def _warm(self) -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "executable", self.python)
            yield

    def seen_deselected(self, number: int) -> int:
        """How many deselected items the summary line counts: workers do not tell."""
        return 0 if self.mode == MODES["-n 2"] else number

    def summary(self) -> dict[str, Any]:
        """What the run wrote."""
        found: dict[str, Any] = json.loads((self.out / "summary.json").read_text())
        return found

    def recordings(self) -> list[Path]:
        """What is on disk."""
        return sorted((self.out / "recordings").glob("*.rollout"))


@pytest.fixture
def make_suite(
    pytester: pytest.Pytester, rollouts: Rollouts, warm: Warm, monkeypatch: pytest.MonkeyPatch
) -> Callable[[tuple[str, ...]], Suite]:
    # pytester moves HOME; the generated assets need not be generated again for every test.
    monkeypatch.setenv("XDG_CACHE_HOME", CACHE)
    ours = ("CI", "BUILD_NUMBER", "PYTEST_ADDOPTS", "PYTEST_XDIST_WORKER", "NO_COLOR")
    for name in (*ours, "GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY", *ROOTS):
        monkeypatch.delenv(name, raising=False)
    return lambda mode: Suite(pytester, rollouts, mode, warm.python)


@pytest.fixture(params=MODES)
def suite(request: pytest.FixtureRequest, make_suite: Callable[..., Suite]) -> Suite:
    """In each of the three modes."""
    return make_suite(MODES[request.param])


@pytest.fixture
def one_suite(make_suite: Callable[..., Suite]) -> Suite:
    """Without xdist, where the mode cannot matter."""
    return make_suite(MODES["without xdist"])
