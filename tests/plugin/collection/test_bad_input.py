"""What cannot be done is said in one line, with exit code 4, before anything is simulated."""

from __future__ import annotations

import pytest

from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.loading import package_assets
from tests.plugin.conftest import Suite

ON = "--safemanip-policy=scripted"
HOLD = "--safemanip-policy=hold"
BROKEN_PROPERTY = (
    "id: broken\ncategory: c\ntitle: t\nsource: s\nformula: G (a -> F b)\natoms: {a: x}"
)
OWN_TASK = """\
task: {name}
sets: [own]
suite: own
horizon: atomic
mechanisms: [fxtr]
skills: [open fxtr]
properties: [collision_contact]
touch:
  fxtr: [{part}]
"""
BROKEN = {
    "properties": BROKEN_PROPERTY,
    "tasks": "task: T\nsets_: [a]",
    "misnamed": OWN_TASK.format(name="OpenDrawr", part="handle"),
    "parts": OWN_TASK.format(name="OpenFridge", part="hanle"),
}

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
        "ERROR: policy 'no_such_module:thing': cannot import 'no_such_module': *",
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
        "ERROR: --safemanip-seeds: expected N (that many), A:B (without B) or A,B,C: "
        "one seed or more, from 0 up, found '5:2'",
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
        "*--safemanip-scenes: unknown scenes 'compat'; did you mean 'compact'?*",
    ),
    "choice in the ini file": (
        [ON, "--override-ini=safemanip_stop=sucess"],
        "ERROR: safemanip_stop in the ini file: unknown value 'sucess'; did you mean 'success'?",
    ),
    "key of the ini file": (
        [ON, "--override-ini=safemanip_seed=3"],
        "ERROR: unknown key 'safemanip_seed' in the ini file; did you mean 'safemanip_seeds'?",
    ),
    "key of the ini file, without a suite": (
        ["--override-ini=safemanip_polcy=scripted"],
        "ERROR: unknown key 'safemanip_polcy' in the ini file; did you mean 'safemanip_policy'?",
    ),
    "backend": (
        [ON, "--safemanip-backend=robocassa"],
        "ERROR: --safemanip-backend: unknown backend 'robocassa'; did you mean 'robocasa'?",
    ),
    "horizon scale": (
        [ON, "--safemanip-horizon-scale=0"],
        "ERROR: --safemanip-horizon-scale: expected a number above 0, at most 1000, found '0'",
    ),
    "option without effect": (
        ["--safemanip-tasks=quick"],
        "ERROR: --safemanip-tasks has no effect without --safemanip-policy or *",
    ),
    "no policy": (["--safemanip-policy="], "ERROR: --safemanip-policy: expected NAME*"),
    "id": (
        ["safemanip::test_safety[OpenDrawer-scripted-enclosure_access-seed0]"],
        "ERROR: unknown node id: safemanip::*access-seed0[]]; did you mean 'safemanip::*'?",
    ),
    "malformed id": (
        ["safemanip::test_safety[OpenDrawer]"],
        "ERROR: unknown node id 'safemanip::test_safety[[]OpenDrawer]'; ids of the *",
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
    "task of the simulator": (
        [HOLD, "--safemanip-tasks=set:own", "--override-ini=safemanip_task_paths=misnamed"],
        "ERROR: *misnamed/broken.yaml:1: the simulator has no task 'OpenDrawr'; *'OpenDrawer'?",
    ),
    "part": (
        [HOLD, "--safemanip-tasks=OpenFridge", "--override-ini=safemanip_task_paths=parts"],
        "ERROR: *parts/broken.yaml:9: key 'touch.fxtr': unknown part 'hanle' of fxtr; did *",
    ),
    "recordings": (
        ["--safemanip-recordings=nowhere"],
        "ERROR: --safemanip-recordings: *nowhere is not a directory",
    ),
    "no recordings": (
        ["--safemanip-recordings=tasks"],
        "ERROR: --safemanip-recordings: no [*].rollout file in *tasks",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_one_line_and_exit_code_4(one_suite: Suite, name: str) -> None:
    arguments, line = CASES[name]
    folder = one_suite.pytester.path
    (folder / "a_file").touch()
    for kind, text in BROKEN.items():
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
        ["ERROR: robocasa is not installed; install it with: pip install '.[[]robocasa]'*"]
    )


def test_official_assets_are_not_there(suite: Suite) -> None:
    if prepare_assets(package_assets(), "auto").kind == "official":
        pytest.skip("they are, on this machine")
    result = suite.run(ON, "--safemanip-tasks=quick", "--safemanip-assets=official")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: RoboCasa's downloaded assets are incomplete in *python -m robocasa.scripts.*"]
    )


def test_a_download_that_was_not_unpacked_in_full_is_no_reason_to_use_stand_ins(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = one_suite.pytester.path / "assets" / "objects/objaverse/bowl/bowl_1/model.xml"
    model.parent.mkdir(parents=True)
    model.write_text('<mujoco><asset><mesh file="visual/bowl.obj"/></asset></mujoco>')
    monkeypatch.setenv("ROBOCASA_ASSETS_PATH", str(one_suite.pytester.path / "assets"))
    result = one_suite.run(HOLD, "--safemanip-tasks=OpenDrawer", "--safemanip-assets=auto")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["ERROR: *bowl_1/model.xml needs visual/bowl.obj, * --type objs_objaverse, or run with *"]
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
