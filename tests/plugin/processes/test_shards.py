"""A run on several machines: parts that together are the run, and gates on all of them."""

from __future__ import annotations

import itertools
import json
from typing import Any

import pytest

from pytest_safemanip.cli.main import main
from tests.plugin.conftest import Suite

GATE = "violation_rate <= 0.9"
PARTS = (1, 2, 3)


@pytest.fixture
def parts(suite: Suite) -> list[str]:
    """The folders of a run of three rollouts in three parts, the last of them empty."""
    suite.has_recorded(("OpenDrawer", "scripted"), ("OpenCabinet", "scripted"))
    suite.has_recorded(("OpenDrawer", "hold"))
    suite.pytester.makeini(f"[pytest]\nsafemanip_gate =\n    {GATE}\n")
    recorded = f"--safemanip-recordings={suite.out / 'recordings'}"
    for number in PARTS:
        result = suite.run(recorded, f"--safemanip-shard={number}/3", f"--safemanip-out={number}")
        assert result.ret == 0
        result.stdout.no_fnmatch_line("*gate[[]*")
        result.stdout.fnmatch_lines([f"*shard {number}/3"])
    return [str(number) for number in PARTS]


def rollouts(folder: Any) -> list[tuple[str, str, int]]:
    found = json.loads((folder / "summary.json").read_text())["rollouts"]
    return [(r["policy"], r["task"], r["seed"]) for r in found]


def test_together_the_parts_are_the_run(suite: Suite, parts: list[str], capsys: Any) -> None:
    path = suite.pytester.path
    each = [rollouts(path / part) for part in parts]
    every = sorted(itertools.chain.from_iterable(each))
    assert every == [
        ("hold", "OpenDrawer", 0),
        ("scripted", "OpenCabinet", 0),
        ("scripted", "OpenDrawer", 0),
    ]
    assert main(["merge", *parts, "-o", "all"]) == 0
    assert "not all of the run" not in capsys.readouterr().out
    assert rollouts(path / "all") == every
    merged = json.loads((path / "all" / "summary.json").read_text())
    assert all((path / "all" / r["recording"]).resolve().exists() for r in merged["rollouts"])
    assert main(["report", "all", "--gate", GATE]) == 0
    assert f"PASS  {GATE}, scripted: 0 of 2" in capsys.readouterr().out

    # A part that is missing is not overlooked.
    assert main(["merge", *parts[:-1], "-o", "most"]) == 0
    assert "not all of the run: no shard 3/3" in capsys.readouterr().out
    for given in (["most"], parts[:-1]):
        assert main(["report", *given, "--gate", GATE]) == 4
        assert "nothing is decided: not all of the run: no shard 3/3" in capsys.readouterr().err
        assert main(["report", *given]) == 0
        assert "not all of the run: no shard 3/3" in capsys.readouterr().out


def test_what_a_shard_cannot_do_is_refused(one_suite: Suite) -> None:
    chosen = ["--safemanip-policy=hold", "--safemanip-tasks=OpenDrawer", "--safemanip-shard=1/2"]
    result = one_suite.run(*chosen, f"--safemanip-gate={GATE} @0.9", "--safemanip-early-stop=0.1")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--safemanip-early-stop decides as results come in*"])
    result = one_suite.run(*chosen[:2], "--safemanip-shard=3/2")
    result.stderr.fnmatch_lines(["*--safemanip-shard: expected I/N*found '3/2'"])
    result = one_suite.run(*chosen[:2], "--safemanip-shard=")
    result.stderr.fnmatch_lines(["*--safemanip-shard: expected I/N, found nothing"])
