"""Tasks whose scenes cannot be had: errors of theirs, and of nothing else in the run."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import CONFTEST, set_up

NARROW = """

from pytest_safemanip.errors import TaskError

class Narrow(World):
    def reset(self, request):
        for change in request.changes:
            raise TaskError(f"{change.role!r} has no room")
        return super().reset(request)

def pytest_safemanip_backends():
    return {"toy": simulator(lambda options: Narrow(succeeds_at=None))}
"""
CROWDED = """\
task: Crowded
base: Reach
sets: [mine]
suite: mine
staging:
  obj: {beside: other}
"""


@pytest.fixture
def narrow(one_suite: Suite) -> Suite:
    set_up(one_suite)
    one_suite.pytester.makeconftest(CONFTEST + NARROW)
    (one_suite.pytester.path / "mine" / "tasks" / "crowded.yaml").write_text(CROWDED)
    return one_suite


def test_a_scene_without_room_is_an_error_of_its_task_and_of_no_other(narrow: Suite) -> None:
    chosen = ("--safemanip-tasks=Crowded,Reach", "--safemanip-properties=stays_near")
    result = narrow.run("--safemanip-policy=hold", *chosen)
    assert result.ret == 1  # and not that of a failed infrastructure
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*mine/tasks/crowded.yaml: 'obj' has no room*"])
    assert "Traceback" not in result.stdout.str()
    assert "infrastructure" not in result.stdout.str().lower()
    found = {rollout["task"]: rollout["error"] for rollout in narrow.summary()["rollouts"]}
    assert found["Reach"] == ""
    assert "crowded.yaml: 'obj' has no room" in found["Crowded"]


def test_too_much_is_refused_before_anything_runs(narrow: Suite) -> None:
    many = "".join(f"  thing{n}: {{on: obj}}\n" for n in range(150))
    path = narrow.pytester.path / "mine" / "tasks" / "crowded.yaml"
    path.write_text(CROWDED + many)
    result = narrow.run("--safemanip-tasks=Reach")
    result.stderr.fnmatch_lines(
        ["ERROR: *mine/tasks/crowded.yaml:6: key 'staging': 151 things, of which a task may *"]
    )
    assert "Traceback" not in result.stderr.str()
