"""RoboCasa on PyPI's robosuite: what is missing is supplied, and nothing else."""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.patches import compat, table

FROM_A_CHECKOUT = """
import sys
from pathlib import Path
from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets

checkout = Path(sys.argv[1])
sys.path.insert(0, str(checkout))
package = loading.package_assets()
print(package.is_relative_to(checkout))
root = prepare_assets(package, "primitive").root
loading.load(root)
import robocasa
from robocasa.environments.kitchen.kitchen import REGISTERED_KITCHEN_ENVS
print(Path(robocasa.__file__).is_relative_to(checkout), "OpenDrawer" in REGISTERED_KITCHEN_ENVS)
"""


def run(code: str, *arguments: str) -> str:
    path = f"import sys; sys.path.insert(0, {str(Path(__file__).parents[3])!r})\n"
    return subprocess.run(
        [sys.executable, "-c", path + code, *arguments],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        timeout=300,
    ).stdout


def test_what_robosuite_has_itself_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    for name in compat.SUPPLIES:
        monkeypatch.setitem(compat.SUPPLIES, name, functools.partial(made.append, name))
    newer = "enable_multiccd load_model_on_init"
    monkeypatch.setattr(table, "source", lambda module: newer)
    assert compat.install() == made == ["legacy_base"]


def test_a_checkout_of_robocasa_serves_as_well(tmp_path: Path) -> None:
    installed = loading.package_assets().parents[1]
    (tmp_path / "robocasa").mkdir()
    for entry in installed.iterdir():
        (tmp_path / "robocasa" / entry.name).symlink_to(entry)
    assert run(FROM_A_CHECKOUT, str(tmp_path)).split() == ["True", "True", "True"]


def test_loading_again_with_other_assets_is_refused(assets_root: Path, tmp_path: Path) -> None:
    loading.load(assets_root)
    with pytest.raises(loading.ConfigError, match="fresh process"):
        loading.load(tmp_path)


@pytest.mark.parametrize("degrees", [0.0, 90.0, 180.0])
def test_forward_is_where_the_base_looks(make_kitchen: Callable[..., Any], degrees: float) -> None:
    """After a quarter turn, robosuite's released controller would drive it backward."""
    env = make_kitchen("OpenDrawer")
    data = env.sim.data
    joint = "mobilebase0_joint_mobile_yaw"
    data.set_joint_qpos(joint, data.get_joint_qpos(joint) + np.radians(degrees))
    # Into the middle of the room, so that it meets nothing.
    data.set_joint_qpos("mobilebase0_joint_mobile_side", -1.0)
    env.sim.forward()
    start = np.array(data.get_body_xpos("mobilebase0_base"))
    heading = np.array(data.get_site_xmat("mobilebase0_center"))[:, 0]
    action = np.zeros(12)
    action[7], action[11] = 1.0, 1.0
    for _ in range(6):
        env.step(action)
    moved = np.array(data.get_body_xpos("mobilebase0_base")) - start
    assert moved @ heading > 0.05
    assert moved @ heading == pytest.approx(np.linalg.norm(moved), rel=0.05)
