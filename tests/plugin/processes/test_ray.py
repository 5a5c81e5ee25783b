"""The suite with its rollouts on a Ray cluster."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.trace import files
from tests.plugin.conftest import MODES, Suite
from tests.plugin.toyfolder import set_up

pytest.importorskip("ray")


@pytest.mark.parametrize(
    ("stop", "ended"), [("success", {"horizon"}), ("violation", {"horizon", "violation"})]
)
def test_the_same_is_recorded_and_found(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch, stop: str, ended: set[str]
) -> None:
    set_up(one_suite)
    # The toy simulator is of these tests, which no worker finds by itself.
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))
    low = "--safemanip-params=straying.distance=0.05"
    chosen = ("--safemanip-policy=random", "--safemanip-seeds=3", f"--safemanip-stop={stop}", low)
    alone = one_suite.run(*chosen, "--safemanip-out=alone").parseoutcomes()
    result = one_suite.pytester.runpytest_subprocess(
        *chosen, "--safemanip-ray=local", *MODES["without xdist"]
    )
    assert result.parseoutcomes() == alone
    assert sum(alone.values()) == 6
    before = sorted((one_suite.pytester.path / "alone" / "recordings").glob("*.rollout"))
    now = one_suite.recordings()
    assert [path.name for path in now] == [path.name for path in before]
    assert {files.load(path).episode.ended for path in now} == ended
    assert [path.read_bytes() for path in now] == [path.read_bytes() for path in before]
    again = one_suite.run(*chosen, "--safemanip-ray=local", "--collect-only")
    assert again.ret == 0  # nothing is run, no cluster is needed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--safemanip-ray=local", "-n", "2"), "one process directs the cluster; leave out -n"),
        (("--safemanip-ray=local", "--safemanip-jobs=2"), "the cluster decides that"),
        (("--safemanip-ray=127.0.0.1:1",), "no cluster at '127.0.0.1:1'"),
        (
            ("--safemanip-ray=local", "--override-ini=safemanip_ray_resources=num_cpus=many"),
            "expected NAME=AMOUNT, as in num_cpus=2, found 'num_cpus=many'",
        ),
    ],
)
def test_what_cannot_be_is_refused(
    one_suite: Suite, arguments: tuple[str, ...], message: str
) -> None:
    set_up(one_suite)
    result = one_suite.pytester.runpytest_subprocess(*arguments)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert message in result.stderr.str()
