"""What cannot be done is said in one line, with exit code 4, before anything is simulated."""

from __future__ import annotations

import pytest

from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.loading import package_assets
from tests.plugin.conftest import Suite

ON = "--safemanip-policy=scripted"
BROKEN_PROPERTY = (
    "id: broken\ncategory: c\ntitle: t\nsource: s\nformula: G (a -> F b)\natoms: {a: x}"
)

CASES = {
    "policy": (
        ["--safemanip-policy=scriptd"],
        "ERROR: unknown policy 'scriptd'; did you mean 'scripted'? (your own: MODULE:ATTRIBUTE)",
    ),
    "fault": (
        ["--safemanip-policy=scripted:drop_hihg"],
        "ERROR: unknown fault 'scripted:drop_hihg'; did you mean 'drop_high'?",
    ),
    "policy's module": (
        ["--safemanip-policy=no_such_module:thing"],
        "ERROR: policy 'no_such_module:thing': cannot import 'no_such_module' *",
    ),
    "policy's attribute": (
        ["--safemanip-policy=os:no_such_thing"],
        "ERROR: policy 'os:no_such_thing': 'os' has no 'no_such_thing'",
    ),
    "task": (
        [ON, "--safemanip-tasks=OpenDrawr"],
        "ERROR: --safemanip-tasks: 'OpenDrawr' matches no task; did you mean 'OpenDrawer'?",
    ),
    "task that the policy cannot do": (
        ["--safemanip-policy=scripted:sweep", "--safemanip-tasks=OpenDrawer"],
        "ERROR: policy 'scripted:sweep' has no plan for OpenDrawer; it knows PickPlace*",
    ),
    "property": (
        [ON, "--safemanip-properties=relase_stability"],
        "ERROR: --safemanip-properties: 'relase_stability' * did you mean 'release_stability'?",
    ),
    "seeds": (
        [ON, "--safemanip-seeds=5:2"],
        "ERROR: --safemanip-seeds: expected N, A:B or A,B,C with seeds from 0 up, found '5:2'",
    ),
    "parameter": (
        [ON, "--safemanip-params=settled.sped=1"],
        "ERROR: unknown proposition parameter 'settled.sped'; did you mean 'settled.speed'?",
    ),
    "parameter's value": (
        [ON, "--safemanip-params=settled.speed=fast"],
        "ERROR: --safemanip-params: expected NAME=VALUE with a number, *",
    ),
    "option": (
        [ON, "--safemanip-seed=3"],
        "*error: unrecognized arguments: --safemanip-seed=3*",
    ),
    "choice": (
        [ON, "--safemanip-scenes=compat"],
        "*error: argument --safemanip-scenes: invalid choice: 'compat' (choose from *compact*",
    ),
    "choice in the ini file": (
        [ON, "--override-ini=safemanip_stop=sucess"],
        "ERROR: safemanip_stop in the ini file: unknown value 'sucess'; did you mean 'success'?",
    ),
    "backend": (
        [ON, "--safemanip-backend=robocassa"],
        "ERROR: --safemanip-backend: unknown backend 'robocassa'; did you mean 'robocasa'?",
    ),
    "horizon scale": (
        [ON, "--safemanip-horizon-scale=0"],
        "ERROR: --safemanip-horizon-scale: expected a number above 0, found '0'",
    ),
    "option without effect": (
        ["--safemanip-tasks=quick"],
        "ERROR: --safemanip-tasks has no effect without --safemanip-policy or *",
    ),
    "no policy": (["--safemanip-policy="], "ERROR: --safemanip-policy: expected NAME*"),
    "id": (
        ["safemanip::test_safety[OpenDrawer-scripted-enclosure_access-seed0]"],
        "ERROR: not found: safemanip::*enclosure_access-seed0[]]; did you mean 'safemanip::*'?",
    ),
    "malformed id": (
        ["safemanip::test_safety[OpenDrawer]"],
        "ERROR: 'safemanip::test_safety[[]OpenDrawer]' is no id of this suite; ids look like *",
    ),
    "output": (
        [ON, "--safemanip-out=a_file/out"],
        "ERROR: --safemanip-out: cannot write to *a_file/out (Not a directory); *",
    ),
    "folder of properties": (
        [ON, "--override-ini=safemanip_property_paths=nowhere"],
        "ERROR: *nowhere: no such folder of properties",
    ),
    "broken property": (
        [ON, "--override-ini=safemanip_property_paths=properties"],
        "ERROR: *properties/broken.yaml:5: key 'formula': atom 'b' is not declared *",
    ),
    "broken task": (
        [ON, "--override-ini=safemanip_task_paths=tasks"],
        "ERROR: *tasks/broken.yaml:2: unknown key 'sets_'; did you mean 'sets'?",
    ),
    "recordings": (
        ["--safemanip-recordings=nowhere"],
        "ERROR: --safemanip-recordings: *nowhere is no folder",
    ),
    "no recordings": (
        ["--safemanip-recordings=tasks"],
        "ERROR: --safemanip-recordings: no [*].rollout file in *tasks is selected",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_one_line_and_exit_code_4(one_suite: Suite, name: str) -> None:
    arguments, line = CASES[name]
    folder = one_suite.pytester.path
    (folder / "a_file").touch()
    for kind, text in {"properties": BROKEN_PROPERTY, "tasks": "task: T\nsets_: [a]"}.items():
        (folder / kind).mkdir()
        (folder / kind / "broken.yaml").write_text(text)
    result = one_suite.run(*arguments)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([line])
    assert not any("Traceback" in text for text in (*result.outlines, *result.errlines))
    assert one_suite.recordings() == []


def test_robocasa_is_not_installed(suite: Suite) -> None:
    suite.pytester.makeconftest("import sys\nsys.modules['robocasa'] = None\n")
    result = suite.run(ON, "--safemanip-tasks=quick")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: robocasa is not installed; install it with: pip install 'pytest-safemanip[[]ro*"]
    )


def test_official_assets_are_not_there(suite: Suite) -> None:
    if prepare_assets(package_assets(), "auto").kind == "official":
        pytest.skip("they are, on this machine")
    result = suite.run(ON, "--safemanip-tasks=quick", "--safemanip-assets=official")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: RoboCasa's downloaded assets are incomplete in *python -m robocasa.scripts.*"]
    )


def test_a_damaged_recording_is_no_verdict(suite: Suite) -> None:
    suite.has_recorded(("OpenDrawer", "scripted"))
    path = suite.recordings()[0]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.unlink()  # a link to the shared one
    path.write_bytes(content)
    result = suite.run(f"--safemanip-recordings={suite.out / 'recordings'}")
    assert result.ret in (pytest.ExitCode.USAGE_ERROR, pytest.ExitCode.TESTS_FAILED)
    outcomes = result.parseoutcomes() if result.ret == pytest.ExitCode.TESTS_FAILED else {}
    assert not {"passed", "failed", "skipped"} & set(outcomes)
