"""RoboCasa's own gym wrapper over robosuite's own renderer: what official policies are given.

Run as a program, since robosuite takes its GL library from the environment while it is imported.
"""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa import environment, loading

CAMERAS = ["robot0_agentview_left", "robot0_agentview_right", "robot0_eye_in_hand"]


def wrapped(request: Request, assets_root: Path) -> Any:
    """The wrapper, without its constructor, around the environment of an episode."""
    loading.load(assets_root)
    import robosuite

    sys.modules.setdefault("cv2", types.ModuleType("cv2"))
    from robocasa.wrappers.gym_wrapper import PandaOmronKeyConverter, RoboCasaGymEnv

    make = robosuite.make
    drawn = {
        "has_offscreen_renderer": True,
        "use_camera_obs": True,
        "camera_names": CAMERAS,
        "camera_widths": 256,
        "camera_heights": 256,
    }
    robosuite.make = lambda *args, **kwargs: make(*args, **{**kwargs, **drawn})
    wrapper = RoboCasaGymEnv.__new__(RoboCasaGymEnv)
    wrapper.env = environment.make(request, assets_root)
    wrapper.key_converter, wrapper.enable_render = PandaOmronKeyConverter, True
    wrapper.camera_names, wrapper.render_obs_key = CAMERAS, f"{CAMERAS[0]}_image"
    return wrapper


def observe(wrapper: Any) -> dict[str, Any]:
    """The observation of the present state."""
    wrapper.env.sim.forward()
    observation = wrapper.get_observation(wrapper.env._get_observations(force_update=True))
    del observation["annotation.human.task_description"]
    return dict(observation)


def main(assets_root: str, request: str, actions: str, out: str) -> None:
    """Run an episode to its end and keep the observation there."""
    wrapper = wrapped(Request(**json.loads(request)), Path(assets_root))
    for action in np.load(actions):
        wrapper.env.step(action)
    np.savez(out, **observe(wrapper))


if __name__ == "__main__":
    main(*sys.argv[1:])
