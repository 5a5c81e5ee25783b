"""Recordings as datasets in RoboCasa's layout, and as recordings again."""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.lerobot.parquet import write_columns
from pytest_safemanip.trace import files
from tests.conftest import Rollouts
from tests.lerobot.conftest import Exported, Imported, command
from tests.sim.conftest import QUICK

TASK = "PickPlaceCounterToCabinet"
ROLLOUTS = [*((task, "scripted") for task in QUICK), (TASK, "scripted:half_inside")]


@pytest.mark.parametrize(("task", "policy"), ROLLOUTS)
def test_a_recording_that_is_simulated_again_from_its_states_has_the_same_verdicts(
    task: str, policy: str, rollouts: Rollouts, imported: Imported
) -> None:
    live = rollouts.get(task, policy)
    version = "v3.0" if task == "OpenDrawer" else "v2.1"
    again = imported(task, policy, version)
    judge = type(live.judge)
    plan = rollouts.plan(task, policy)
    second = judge(again, plan.tasks[task], plan.attributes, plan.catalogue, plan.parameters)
    for id_ in plan.tasks[task].properties:
        one, other = live.verdict(id_), second.judge(plan.properties[id_])
        assert (other.outcome, other.triggered) == (one.outcome, one.triggered), id_
        assert [f.entities for f in other.findings] == [f.entities for f in one.findings]
        assert [f.first for f in other.findings] == [f.first for f in one.findings]

    first, about = live.recording, again.episode
    assert again.scene == first.scene
    assert (len(again.steps), again.acting) == (len(first.steps), first.acting)
    assert (about.policy, about.seed, about.ended) == (policy, 0, first.episode.ended)
    assert float(about.origin["drift"].removesuffix(" mm")) < 2.0
    for name in ("object_pose", "joint", "switch", "success", "commands", "qpos"):
        ours, theirs = getattr(again.steps, name), getattr(first.steps, name)
        assert np.allclose(ours, theirs, atol=1e-5), name


def test_the_table_has_state_and_action_in_the_order_of_its_modality_file(
    rollouts: Rollouts, exported: Exported
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    folder, recording = exported(TASK), rollouts.get(TASK).recording
    places = json.loads((folder / "meta/modality.json").read_text())
    table = parquet.read_table(folder / "data/chunk-000/episode_000000.parquet").to_pydict()
    action, state = np.array(table["action"]), np.array(table["observation.state"])
    assert len(action) == recording.acting - 1

    def part(kind: str, name: str) -> slice:
        return slice(places[kind][name]["start"], places[kind][name]["end"])

    taken = recording.steps.action[1 : recording.acting]
    assert (action[:, part("action", "end_effector_position")] == taken[:, :3]).all()
    assert (action[:, part("action", "end_effector_rotation")] == taken[:, 3:6]).all()
    closing = action[:, part("action", "gripper_close")][:, 0]
    assert set(closing) >= {-1.0, 1.0}  # 1 closes
    assert (np.sign(recording.steps.commands[1 : recording.acting, 0]) == closing).all()
    assert (action[:, part("action", "base_motion")] == taken[:, 7:11]).all()
    assert (action[:, part("action", "control_mode")] == taken[:, 11:]).all()

    base = state[:, part("state", "base_rotation")]  # xyzw, and the base is upright
    assert np.allclose(base[:, :2], 0.0, atol=1e-3)
    steps = recording.steps
    assert np.allclose(np.abs(base[:, [3, 2]]), np.abs(steps.base_pose[: len(base), [3, 6]]))
    gap = state[:, part("state", "gripper_qpos")] @ (1.0, -1.0)
    assert np.allclose(gap / 0.08, steps.openings[: len(gap), 0, 0], atol=1e-5)
    assert table["next.done"] == [False] * (len(action) - 1) + [True]
    assert table["next.reward"][-2:] == [0.0, 1.0]


def test_robocasas_own_tools_read_the_dataset(
    rollouts: Rollouts, exported: Exported, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow")
    needed = {  # of LeRobot and torch, which these functions do not call
        "lerobot": [],
        "lerobot.datasets": [],
        "lerobot.datasets.utils": ["write_info"],
        "lerobot.datasets.video_utils": ["encode_video_frames"],
        "lerobot.datasets.lerobot_dataset": ["LeRobotDataset"],
        "robocasa.utils.robomimic.robomimic_dataset_utils": ["get_env_metadata_from_dataset"],
    }
    for name, attributes in needed.items():
        module = types.ModuleType(name)
        for attribute in attributes:
            setattr(module, attribute, object)
        monkeypatch.setitem(sys.modules, name, module)
    import robocasa.utils.lerobot_utils as tools

    folder, recording = exported(TASK), rollouts.get(TASK).recording
    last = recording.acting
    actions = tools.get_episode_actions(folder, 0)
    assert (actions == recording.steps.action[1:last]).all()
    states, nq = tools.get_episode_states(folder, 0), recording.steps.qpos.shape[1]
    assert len(states) == len(actions)
    assert (states[:, 1 : 1 + nq] == recording.steps.qpos[: last - 1]).all()
    assert (states[:, 1 + nq :] == recording.steps.qvel[: last - 1]).all()
    assert tools.get_env_metadata(folder)["env_name"] == TASK
    assert tools.get_episode_meta(folder, 0)["lang"] == recording.episode.instruction
    model = tools.get_episode_model_xml(folder, 0)
    assert "/robocasa/models/assets/" in model
    assert "/robosuite/models/assets/" in model
    assert str(Path.home()) not in model


def test_only_what_is_safe_and_successful_is_exported(rollouts: Rollouts, tmp_path: Path) -> None:
    for policy in ("scripted", "scripted:half_inside"):
        path = rollouts.get(TASK, policy).path
        (tmp_path / path.name).symlink_to(path)
    chosen = ("--only", "safe,successful", "--assets=primitive")
    said = command("export", tmp_path, "--lerobot", "-o", tmp_path / "out", *chosen)
    assert said.splitlines() == [
        f"{tmp_path / 'out' / TASK}  1 episode, {rollouts.get(TASK).recording.acting - 1} steps",
        "1 recording left out: not safe and successful",
    ]
    found = (tmp_path / "out" / TASK / "extras/episode_000000/ep_meta.json").read_text()
    assert json.loads(found)["safemanip"]["policy"] == "scripted"


def test_a_recorded_tail_is_left_out_if_the_user_wants_none(
    exported: Exported, tmp_path: Path
) -> None:
    command("import", exported("OpenDrawer"), "-o", tmp_path, "--no-tail")
    (path,) = tmp_path.glob(f"*{files.SUFFIX}")
    assert files.load(path).truncated


def test_a_reward_of_1_is_a_success_whatever_the_check_says(
    exported: Exported, tmp_path: Path
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = tmp_path / "rewarded"
    _copy(exported("OpenDrawer"), folder)
    table = folder / "data/chunk-000/episode_000000.parquet"
    columns = {k: np.array(v) for k, v in parquet.read_table(table).to_pydict().items()}
    assert not columns["next.reward"][:60].any()
    columns["next.reward"][50] = 1.0
    write_columns(table, columns)
    command("import", folder, "-o", tmp_path / "out", "--no-tail")
    (path,) = (tmp_path / "out").glob(f"*{files.SUFFIX}")
    success = files.load(path).steps.success
    assert success[:60].nonzero()[0].tolist() == [51]  # where the action led
    assert success[-1]


def test_an_object_that_is_not_where_physics_takes_it_is_drift_and_refused(
    exported: Exported, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pytest_safemanip.cli.main import main

    folder = tmp_path / "moved"
    _copy(exported("OpenDrawer"), folder)
    states = folder / "extras/episode_000000/states.npz"
    with np.load(states) as stored:
        arrays = {name: stored[name].copy() for name in stored.files}
    # The first object of the scene is the one whose free joint comes first behind the robot's.
    moved = np.flatnonzero(np.ptp(arrays["states"][:, 1:], axis=0) < 1e-3)
    arrays["states"][100:, 1 + moved] += 0.2
    arrays["after"][:, 1 + moved] += 0.2
    np.savez_compressed(states, **arrays)
    assert main(["import", str(folder), "-o", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().out
    assert "refused" in said
    assert "mm from its stored place after step 100" in said
    assert not list((tmp_path / "out").glob(f"*{files.SUFFIX}"))


def _copy(source: Path, target: Path) -> None:
    for path in source.rglob("*"):
        if path.is_file():
            place = target / path.relative_to(source)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(path.read_bytes())
