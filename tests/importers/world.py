"""A hand on two slides, a cube and a table, named as robosuite names such things, and an episode of
it: the cube is grasped, lifted, put down and let go.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import mujoco
import numpy as np

PERIOD = 0.05
MODEL = """
<mujoco model="base">
  <compiler angle="radian" meshdir="meshes/"/>
  <option timestep="0.002" cone="elliptic" impratio="20"/>
  <size nconmax="5000" njmax="5000"/>
  <asset>
    <texture file="/home/somebody/robosuite/models/assets/textures/wood.png" name="wood" type="2d"/>
    <material name="wood" texture="wood"/>
  </asset>
  <actuator>
    <motor joint="robot0_joint1" name="robot0_torq_j1" ctrllimited="true" ctrlrange="-80 80"/>
    <motor joint="robot0_joint2" name="robot0_torq_j2" ctrllimited="true" ctrlrange="-80 80"/>
    <position joint="gripper0_finger_joint1" ctrllimited="true" ctrlrange="0 0.04" kp="10000"
      forcelimited="true" forcerange="-20 20"/>
    <position joint="gripper0_finger_joint2" ctrllimited="true" ctrlrange="-0.04 0" kp="10000"
      forcelimited="true" forcerange="-20 20"/>
  </actuator>
  <worldbody>
    <geom name="floor" type="plane" size="3 3 .1" material="wood"/>
    <body name="table" pos="0 0 .4"><geom name="table_collision" type="box" size=".4 .4 .4"/></body>
    <body name="robot0_base" pos="-.3 0 .8">
      <body name="robot0_link1" pos="0 0 .3">
        <joint name="robot0_joint1" type="slide" axis="1 0 0" range="-1 1" damping="1"/>
        <geom type="box" size=".02 .02 .02" mass="1"/>
        <body name="robot0_right_hand">
          <joint name="robot0_joint2" type="slide" axis="0 0 1" range="-1 1" damping="1"/>
          <geom type="box" size=".03 .03 .03" mass="1"/>
          <body name="gripper0_right_gripper" pos="0 0 -.05" quat="0 1 0 0">
            <geom name="gripper0_hand_collision" type="box" size=".03 .06 .01" mass=".2"/>
            <site name="gripper0_grip_site" pos="0 0 .08"/>
            <body name="gripper0_leftfinger" pos="0 0 .06">
              <joint name="gripper0_finger_joint1" type="slide" axis="0 1 0" range="0 .04"
                limited="true" damping="100"/>
              <geom type="box" size=".01 .005 .04" pos="0 .005 0" mass=".05"
                friction="2 .05 .0001"/>
            </body>
            <body name="gripper0_rightfinger" pos="0 0 .06">
              <joint name="gripper0_finger_joint2" type="slide" axis="0 1 0" range="-.04 0"
                limited="true" damping="100"/>
              <geom type="box" size=".01 .005 .04" pos="0 -.005 0" mass=".05"
                friction="2 .05 .0001"/>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="cube_main" pos="0 0 .82" quat=".7071068 0 0 .7071068">
      <joint name="cube_joint0" type="free" damping=".0005"/>
      <geom name="cube_g0" type="box" size=".015 .02 .02" density="1000"/>
    </body>
  </worldbody>
</mujoco>
"""
SCRIPT = (
    # seconds, x and z of the hand above its zero, whether it is closed
    (0.6, (0.3, -0.10), False),
    (0.6, (0.3, -0.145), False),
    (0.6, (0.3, -0.145), True),
    (0.8, (0.3, -0.05), True),
    (0.6, (0.35, -0.05), True),
    (0.8, (0.35, -0.143), True),
    (0.6, (0.35, -0.143), False),
    (0.6, (0.35, 0.0), False),
)


@dataclass(frozen=True)
class Played:
    """An episode.

    Attributes:
        states: time, positions and velocities, every 0.05 s (T, 1 + nq + nv).
        actions: where the hand goes and whether it closes, from each state on (T, 3).
    """

    states: np.ndarray
    actions: np.ndarray


def compiled() -> Any:
    """The model, without the texture that nobody has."""
    lines = [line for line in MODEL.splitlines() if "texture" not in line]
    return mujoco.MjModel.from_xml_string("\n".join(lines).replace(' material="wood"', ""))


def play() -> Played:
    """The episode, simulated."""
    model = compiled()
    data = mujoco.MjData(model)
    data.qpos[:2] = 0.0, 0.0
    data.qpos[2:4] = 0.04, -0.04
    states, actions, at = [], [], np.zeros(2)
    substeps = round(PERIOD / model.opt.timestep)
    for seconds, goal, closed in SCRIPT:
        count = round(seconds / PERIOD)
        for number in range(count):
            way = at + (np.array(goal) - at) * (number + 1) / count
            states.append(np.concatenate(([data.time], data.qpos, data.qvel)))
            actions.append((*way, 1.0 if closed else -1.0))
            for _ in range(substeps):
                mujoco.mj_step1(model, data)
                hand, speed = data.qpos[:2], data.qvel[:2]
                data.ctrl[:2] = 2000.0 * (way - hand) - 90.0 * speed + data.qfrc_bias[:2]
                data.ctrl[2:] = (0.0, 0.0) if closed else (0.04, -0.04)
                mujoco.mj_step2(model, data)
        at = np.array(goal)
    return Played(np.array(states), np.array(actions))


def write(
    path: Path,
    played: Played,
    *,
    model: str = MODEL,
    name: str = "demo_1",
    env: str = "Lift",
    arrays: dict[str, np.ndarray] | None = None,
) -> Path:
    """Write an episode as robosuite does.

    Args:
        path: of the file; an episode is added to one that there is.
        played: the episode.
        model: XML.
        name: of the episode.
        env: name of the task.
        arrays: instead of states and actions, or beside them.
    """
    with h5py.File(path, "a") as file:
        data = file.require_group("data")
        data.attrs["env"] = env
        data.attrs["repository_version"] = "1.4.0"
        data.attrs["env_info"] = json.dumps({"robots": "Panda"})
        episode = data.create_group(name)
        episode.attrs["model_file"] = model
        for key, array in {
            "states": played.states,
            "actions": played.actions,
            **(arrays or {}),
        }.items():
            episode[key] = array
    return path
