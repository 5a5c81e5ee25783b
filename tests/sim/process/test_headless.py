"""A machine without a screen and without graphics libraries runs rollouts all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# Python imports this by itself at start-up, in the simulator's process too.
WITHOUT_GRAPHICS = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("OpenGL", "cv2"):
            raise ModuleNotFoundError(f"no {name} on this machine", name=name)

sys.meta_path.insert(0, Missing())
"""
RUN = """
import os, sys
from pathlib import Path
import numpy as np
from pytest_safemanip.sim.backend import Options, Request
from pytest_safemanip.sim.robocasa.factory import create

backend = create(Options("primitive", Path(sys.argv[1])))
backend.reset(Request("OpenDrawer", 0, "compact"))
print(np.isfinite(backend.step(np.zeros(12)).eef_pose).all())
# MuJoCo warns about these torques, by default on the screen and in a file.
backend.step(np.full(12, np.nan))
print(os.environ.get("MUJOCO_GL"))
backend.close()
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[subprocess.CompletedProcess[str], Path]:
    """A rollout on such a machine, and the folder that it was started in."""
    site, folder, logs = (tmp_path_factory.mktemp(n) for n in ("site", "folder", "logs"))
    (site / "sitecustomize.py").write_text(WITHOUT_GRAPHICS)
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    environment["PYTHONPATH"] = os.pathsep.join((str(site), str(Path(__file__).parents[3])))
    process = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUN, str(logs)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return process, folder


def test_a_rollout_needs_no_graphics(done: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    process, _ = done
    assert process.returncode == 0, process.stderr
    assert process.stdout.split() == ["True", "None"]


def test_the_simulators_noise_is_not_on_the_screen(
    done: tuple[subprocess.CompletedProcess[str], Path],
) -> None:
    assert done[0].stderr == ""


def test_nothing_is_left_in_the_working_folder(
    done: tuple[subprocess.CompletedProcess[str], Path],
) -> None:
    assert list(done[1].iterdir()) == []
