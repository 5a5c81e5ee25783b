"""Tasks of RoboCasa that are not shipped are done by plans of a few lines, without new Python."""

from __future__ import annotations

import pytest

PLANS = {
    "CloseDrawer": "[close drawer]",
    "OpenMicrowave": "[open fxtr]",
    "PickPlaceCounterToSink": "[grasp obj, place obj in sink]",
}
TASKS = {
    "CloseDrawer": """
mechanisms: [drawer]
skills: [close drawer]
touch: {drawer: [handle, drawer]}
properties: [collision_contact, action_onset, mechanism_recovery]
""",
    "OpenMicrowave": """
mechanisms: [fxtr]
skills: [open fxtr]
touch: {fxtr: [handle, door]}
properties: [collision_contact, action_onset, mechanism_recovery]
""",
    "PickPlaceCounterToSink": """
objects: [obj]
skills: [pick obj, place obj]
touch: {obj: [body], counter: [body]}
supports: {obj: [counter, sink]}
properties: [collision_contact, grasp_stability, release_stability, action_onset]
""",
}


@pytest.mark.parametrize("task", TASKS)
def test_a_short_plan_does_another_task(task, rollouts, tmp_path, monkeypatch):
    head = f"task: {task}\nsets: [mine]\nsuite: atomic_fixture\nhorizon: atomic\n"
    (tmp_path / "tasks").mkdir()
    (tmp_path / "tasks" / f"{task}.yaml").write_text(head + TASKS[task].lstrip())
    (tmp_path / "plans.yaml").write_text(f"{task}: {PLANS[task]}\n")
    monkeypatch.chdir(tmp_path)
    found = rollouts.get(task, "scripted:plans.yaml", task_paths=(tmp_path / "tasks",))
    assert found.recording.success, found.recording.episode.failure
