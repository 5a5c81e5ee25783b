"""What is switched on is what RoboCasa says, and where its water falls."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from pytest_safemanip.trace.geometry import matrix
from tests.sim.conftest import Kitchen

GetKitchen = Callable[..., Kitchen]


def states(shared: Kitchen) -> dict[tuple[str, str], float]:
    keys = [(s.entity, s.name) for s in shared.scene.switches]
    assert len(set(keys)) == len(keys)
    return dict(zip(keys, shared.read().switch.tolist(), strict=True))


def set_joint(shared: Kitchen, name: str, value: float) -> None:
    shared.env.sim.data.set_joint_qpos(name, value)


@pytest.mark.parametrize(("angle", "on"), [(0.0, 0.0), (0.39, 0.0), (0.41, 1.0), (0.5, 1.0)])
def test_a_tap_runs_from_two_fifths_of_a_radian(
    kitchen: GetKitchen, angle: float, on: float
) -> None:
    shared = kitchen("TurnOnSinkFaucet")
    sink = shared.scene.roles["sink"]
    set_joint(shared, f"{sink}_handle_joint", angle)
    assert states(shared)[sink, "water"] == on


def test_water_falls_from_the_spout_into_the_basin_and_turns_with_it(kitchen: GetKitchen) -> None:
    shared = kitchen("TurnOnSinkFaucet")
    scene, sink = shared.scene, shared.scene.roles["sink"]
    (water,) = scene.boxes_of(sink, "water")
    (basin,) = scene.boxes_of(sink, "interior")
    poses = shared.read().box_pose
    low = poses[water, 2] - scene.boxes[water].half[2]
    high = poses[water, 2] + scene.boxes[water].half[2]
    assert abs(low - (poses[basin, 2] - scene.boxes[basin].half[2])) < 0.02
    assert high > poses[basin, 2] + scene.boxes[basin].half[2]
    across = np.abs(poses[water, :2] - poses[basin, :2])
    assert (across < np.array(scene.boxes[basin].half[:2])).all()
    set_joint(shared, f"{sink}_spout_joint", 0.5)
    assert np.linalg.norm(shared.read().box_pose[water, :2] - poses[water, :2]) > 0.05


def test_burners_and_appliances_are_on_when_robocasa_says_so(
    kitchen: GetKitchen, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = kitchen("OpenCabinet", "target")
    kinds = {s.kind for s in shared.scene.switches}
    assert kinds == {"water", "burner", "appliance"}
    stove = next(s.entity for s in shared.scene.switches if s.kind == "burner")
    burners = [s.name for s in shared.scene.switches if s.entity == stove]
    set_joint(shared, f"{stove}_knob_{burners[0]}_joint", 1.0)
    fixture = shared.env.fixtures[stove]
    wanted = {(stove, b): float(fixture.is_burner_on(shared.env, b)) for b in burners}
    assert wanted[stove, burners[0]] == 1.0
    assert states(shared).items() >= wanted.items()
    knobs = {s.joint for s in shared.scene.switches if s.entity == stove}
    assert knobs == {f"{stove}/knob_{burner}_joint" for burner in burners}
    places = shared.read().box_pose[shared.scene.boxes_of(stove, "burner"), :3]
    sites = [shared.env.sim.data.get_site_xpos(f"{stove}_burner_on_{burner}") for burner in burners]
    assert np.allclose(places, sites, atol=1e-5)
    microwave = next(n for n, f in shared.env.fixtures.items() if type(f).__name__ == "Microwave")
    assert states(shared)[microwave, "power"] == 0.0
    monkeypatch.setattr(shared.env.fixtures[microwave], "_turned_on", True)
    assert states(shared)[microwave, "power"] == 1.0


def test_a_start_button_is_a_part_of_its_own(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenCabinet", "target")
    microwave = next(n for n, f in shared.env.fixtures.items() if type(f).__name__ == "Microwave")
    assert len(shared.scene.parts_of(microwave, ("button",))) == 1


def test_what_a_knob_switches_is_on_once_it_is_set(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenCabinet", "target")
    by_class = {type(fixture).__name__: name for name, fixture in shared.env.fixtures.items()}
    dialled = [kind for kind in ("Oven", "ToasterOven", "StandMixer") if kind in by_class]
    assert dialled
    for kind in dialled:
        name = by_class[kind]
        (switch,) = [s for s in shared.scene.switches if s.entity == name]
        joint = switch.joint.replace("/", "_")
        assert states(shared)[name, "power"] == 0.0
        for share, on in ((0.05, 0.0), (0.3, 1.0)):
            shared.env.fixtures[name].set_joint_state(share, share, shared.env, [joint])
            assert states(shared)[name, "power"] == on, kind
        shared.env.fixtures[name].set_joint_state(0.0, 0.0, shared.env, [joint])


def test_cameras_are_where_policies_look_from(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenCabinet", "target")
    data, model = shared.env.sim.data._data, shared.env.sim.model._model
    names = ["robot0_agentview_left", "robot0_agentview_right", "robot0_eye_in_hand"]
    assert [camera.name for camera in shared.scene.cameras] == names
    mujoco.mj_forward(model, data)
    for camera, pose in zip(shared.scene.cameras, shared.read().camera_pose, strict=True):
        there = data.camera(camera.name)
        assert np.allclose(pose[:3], there.xpos, atol=1e-5)
        assert np.allclose(matrix(pose[3:]), there.xmat.reshape(3, 3), atol=1e-5)
        assert camera.fov == np.deg2rad(model.camera(camera.name).fovy[0])
