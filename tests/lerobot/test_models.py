"""The model of an episode, as it is simulated again: without what only pictures need."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from pytest_safemanip.sim.mujoco import strangers
from pytest_safemanip.sim.robocasa.playback import model_xml

PYRAMID = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
MODEL = """<mujoco>
<compiler inertiagrouprange="0 0"/>
<asset>
  <texture name="wood" type="2d" file="{0}/wood.png"/>
  <material name="wood" texture="wood"/>
  <mesh name="looks" file="{0}/looks.obj" scale="2 2 2"/>
  <mesh name="solid" file="{0}/solid.obj"/>
</asset>
<worldbody><body><freejoint/>
  <geom type="mesh" mesh="looks" material="wood" contype="0" conaffinity="0" group="1"/>
  <geom type="mesh" mesh="solid" contype="0" conaffinity="0" group="1"/>
  <geom type="mesh" mesh="solid" name="solid"/>
</body></worldbody>
</mujoco>"""


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    for name in ("looks.obj", "solid.obj"):
        (tmp_path / name).write_text(PYRAMID)
    (tmp_path / "wood.png").write_bytes(b"a picture that nobody reads")
    return tmp_path


def simulated(text: str, assets: Path) -> str:
    xml = text.format("/x/robosuite/models/assets")
    return model_xml.rerooted(strangers.parse(xml), {"robosuite": assets})


def test_what_is_only_seen_is_not_read(assets: Path) -> None:
    (assets / "looks.obj").write_text("no mesh")
    model = mujoco.MjModel.from_xml_string(simulated(MODEL, assets))
    assert model.ngeom == 3
    assert model.geom("solid").size.max() > 0.1
    assert model.body_mass[1] == pytest.approx(1000.0 / 6.0)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (' inertiagrouprange="0 0"', ""),  # what is seen weighs something
        ('contype="0" conaffinity="0" group="1"/>', 'conaffinity="0" group="1"/>'),
        ("<asset>", '<default><geom contype="0"/></default><asset>'),
        ("</mujoco>", '<contact><pair geom1="a" geom2="solid"/></contact></mujoco>'),
    ],
)
def test_what_may_touch_or_weigh_something_stays(before: str, after: str, assets: Path) -> None:
    assert "looks.obj" not in simulated(MODEL, assets)
    assert "looks.obj" in simulated(MODEL.replace(before, after, 1), assets)
