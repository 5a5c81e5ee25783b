"""Stand-ins in a hand and on a slope: what is hollow holds, what is round rolls, handles carry."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import pytest

from pytest_safemanip.sim.robocasa.standins import objects, paint
from pytest_safemanip.sim.robocasa.standins.objects import Row, object_model, table

HOLLOW = ("bowl", "lugged", "mug", "pan", "pot", "colander", "goblet", "tray", "bin", "basket")
BARRELS = ("can", "bottle")
FLAT = ("block", "log", "board", "tray", "bin", "basket", "tool", "turner")
SLOPE = math.radians(5.0)
SPACING = 0.6
TABLE_TOP = '<geom name="table" type="box" size="99 2 .05" pos="0 0 -.05"/>'
LYING = "0.5 0.5 0.5 0.5"
"""The upright axis along x."""


@pytest.fixture(scope="module")
def mujoco() -> ModuleType:
    return pytest.importorskip("mujoco")


def put(
    row: Row,
    name: str,
    place: Sequence[float],
    *,
    free: bool,
    quat: str = "1 0 0 0",
    scale: float = 1.0,
) -> str:
    """The body of an object as RoboCasa would put it into a scene, with its contact settings."""
    # A model is written smaller by what RoboCasa is going to multiply it by.
    text = object_model(row, 1.0, (1.0 / scale, 1.0 / scale, 1.0 / scale)).to_xml()
    body = ET.fromstring(text).find("./worldbody/body/body")
    assert body is not None
    for element in body.iter():
        if element.get("name"):
            element.set("name", f"{name} {element.get('name')}")
        if element.tag == "geom":
            element.set("friction", "0.95 0.3 0.1")
            element.set("solref", "0.001 1")
            element.set("solimp", "0.998 0.998 0.001")
    body.set("name", name)
    body.set("pos", " ".join(map(str, place)))
    body.set("quat", quat)
    if free:
        ET.SubElement(body, "joint", name=name, type="free", damping="0.0005")
    return ET.tostring(body, encoding="unicode")


def half_height(row: Row) -> float:
    """From the origin down to where it stands."""
    centre, half = object_model(row, 1.0, (1.0, 1.0, 1.0)).extent
    return half[2] - centre[2]


def world(bodies: Sequence[str], actuators: str = "") -> str:
    return (
        '<mujoco><compiler angle="radian" inertiagrouprange="0 0"/>'
        '<option timestep="0.002" impratio="20" cone="elliptic"><flag multiccd="enable"/></option>'
        f"<worldbody>{''.join(bodies)}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )


def tilt(quat: Any) -> float:
    """How far from upright, degrees."""
    return math.degrees(math.acos(max(-1.0, min(1.0, 1 - 2 * (quat[1] ** 2 + quat[2] ** 2)))))


def of(shapes: Sequence[str], keep: Callable[[Row], bool] = lambda _: True) -> dict[str, Row]:
    return {name: row for name, row in table().items() if row.shape in shapes and keep(row)}


def test_what_falls_into_a_vessel_stays_until_that_is_turned_over(mujoco: ModuleType) -> None:
    vessels, bodies = of(HOLLOW), []
    for index, (name, row) in enumerate(vessels.items()):
        radius = min(0.02, 0.3 * row.size[0] / 2)
        ball = Row("ball", (2 * radius,) * 3, 0.02, paint.RED)
        x, above = index * SPACING, row.size[2] / 2 + 2 * radius
        bodies += [
            put(row, name, (x, 0, 1), free=False),
            put(ball, f"ball {name}", (x + 0.2 * radius, 0, 1 + above), free=True),
        ]
    model = mujoco.MjModel.from_xml_string(world([TABLE_TOP, *bodies]))
    data = mujoco.MjData(model)

    def inside() -> set[str]:
        found = set()
        for name in vessels:
            region = model.geom(f"{name} reg_int").id
            offset = data.body(f"ball {name}").xpos - data.geom_xpos[region]
            if (abs(offset) < model.geom_size[region] + 0.01).all():
                found.add(name)
        return found

    mujoco.mj_step(model, data, nstep=600)
    assert inside() == set(vessels)
    model.opt.gravity[2] *= -1  # as if the vessels were turned over
    mujoco.mj_step(model, data, nstep=250)
    assert inside() == set()


def test_round_things_roll_down_a_slope_and_others_stay(mujoco: ModuleType) -> None:
    lying = of(BARRELS, lambda row: row.size[2] > 1.2 * row.size[0])
    rolling = {**of(objects.ROUND), **{f"lying {name}": row for name, row in lying.items()}}
    resting = {**of(FLAT), **{f"standing {name}": row for name, row in of(BARRELS).items()}}
    bodies = []
    for index, (name, row) in enumerate({**rolling, **resting}.items()):
        lies = name.startswith("lying")
        z = row.size[1] / 2 if lies else half_height(row)
        quat = LYING if lies else "1 0 0 0"
        bodies.append(put(row, name, (index * SPACING - 35, 0, z), free=True, quat=quat))
    model = mujoco.MjModel.from_xml_string(world([TABLE_TOP, *bodies]))
    model.opt.gravity[:] = 0.0, 9.81 * math.sin(SLOPE), -9.81 * math.cos(SLOPE)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=250)
    down = {name: float(data.body(name).xpos[1]) for name in (*rolling, *resting)}
    # RoboCasa damps the turning of every object alike, which slows small fruit down.
    stuck = [n for n, row in rolling.items() if down[n] < (0.01 if row.kg > 0.05 else 0.0002)]
    slid = [name for name in resting if abs(down[name]) > 0.0001]
    assert (stuck, slid) == ([], [])


def test_bottles_tip_when_pushed_at_the_top_and_do_not_slide_away(mujoco: ModuleType) -> None:
    bottles = of(("bottle",))
    bodies = [
        put(row, name, (index * SPACING, 0, row.size[2] / 2), free=True)
        for index, (name, row) in enumerate(bottles.items())
    ]
    model = mujoco.MjModel.from_xml_string(world([TABLE_TOP, *bodies]))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=100)
    for share, falls in ((0.8, False), (1.3, True)):
        for name, row in bottles.items():
            body = model.body(name).id
            arm = 0.95 * row.size[2]
            force = share * row.kg * 9.81 * row.size[0] / 2 / arm
            # At the centre of mass, with the torque of a push at the cap.
            high = row.size[2] / 2 + data.xipos[body][2] - data.xpos[body][2]
            data.xfrc_applied[body] = 0.0, force, 0.0, -force * (arm - high), 0.0, 0.0
        mujoco.mj_step(model, data, nstep=150)
        tilted = {name for name in bottles if tilt(data.body(name).xquat) > 5.0}
        assert tilted == (set(bottles) if falls else set()), share
        if not falls:
            assert all(abs(data.body(name).xpos[1]) < 0.002 for name in bottles)


def gripper(place: Sequence[float], yaw: float) -> tuple[str, str]:
    """The Panda's pads, open at a place, closing along y (turned by ``yaw``); and its motors."""
    fingers = "".join(
        f'<body name="{name}" pos="0 {side * 0.004} 0">'
        f'<joint name="{name}" type="slide" axis="0 {side} 0" range="0 .04" damping="100"'
        ' armature="1"/>'
        f'<geom type="box" size=".01 .007 .022" pos="0 {side * 0.012} .03" mass=".1"/>'
        f'<geom name="{name}" type="box" size=".008 .004 .008" friction="2 .05 .0001" mass=".01"'
        ' solref=".01 .5"/></body>'
        for name, side in (("left", 1), ("right", -1))
    )
    x, y, z = place
    hand = (
        f'<body pos="{x} {y} {z}" euler="0 0 {yaw}"><joint name="up" type="slide" axis="0 0 1"/>'
        f'<geom type="box" size=".03 .1 .02" pos="0 0 .08" mass="1" contype="0" conaffinity="0"/>'
        f"{fingers}</body>"
    )
    motors = '<position joint="up" kp="20000" kv="800"/><motor joint="left"/><motor joint="right"/>'
    return hand, motors


def grip_of(row: Row) -> tuple[tuple[float, float, float], float]:
    """Where a hand from above takes hold of it, relative to its origin, and the hand's yaw."""
    x, y, z = (side / 2 for side in row.size)
    across = math.pi / 2
    match row.shape:
        case "pan":
            return (0.0, -y - 0.04, 0.6 * z), across
        case "lugged" | "basket":
            return (0.0, -y - 0.016, z - 0.008), across
        case "bin":
            return (-x - 0.016, 0.0, z - 0.008), 0.0
        case "mug":
            return (x + 0.035, 0.0, 0.0), 0.0
        case "kettle":
            return (0.0, 0.0, z - 0.009), 0.0
        case "lid":
            return (0.0, 0.0, 0.03), 0.0
        case "tool" | "turner":
            return (-0.4 * x, 0.0, max(min(0.007, z) - z, 0.009 - z)), 0.0
        case "bowl" | "tray":
            return (0.003 - x, 0.0, z - 0.007), across
        case _:
            return (0.0, 0.0, max(0.0, 0.009 - z)), 0.0


HELD = [
    "pan",
    "saucepan",
    "strainer",
    "mug",
    "jug",
    "pitcher",
    "measuring_cup",
    "kettle_non_electric",
    "teapot",
    "saucepan_lid",
    "bowl",
    "plate",
    "cup",
    "glass_cup",
    "basket",
    "tupperware",
    "jar",
    "knife",
    "fork",
    "spatula",
    "ladle",
    "tongs",
    "peeler",
    "apple",
    "egg",
    "can",
    "ketchup",
    "wine",
    "milk",
    "lemon",
    "straw",
    "kebab_skewer",
    "sponge",
]


@pytest.mark.parametrize("name", HELD)
def test_a_hand_lifts_it_by_its_handle(mujoco: ModuleType, name: str) -> None:
    row = table()[name]
    (x, y, z), yaw = grip_of(row)
    low = half_height(row)
    hand, motors = gripper((x, y, low + z), yaw)
    body = put(row, "object", (0, 0, low), free=True)
    model = mujoco.MjModel.from_xml_string(world([TABLE_TOP, body, hand], motors))
    data = mujoco.MjData(model)
    data.joint("left").qpos[0] = data.joint("right").qpos[0] = 0.036
    mujoco.mj_forward(model, data)
    assert not [contact for contact in data.contact if contact.dist < -1e-3]
    data.ctrl[1:] = -20.0  # N, the gripper's greatest force
    mujoco.mj_step(model, data, nstep=500)
    for step in range(100):  # 0.1 m/s
        data.ctrl[0] = 0.001 * (step + 1)
        mujoco.mj_step(model, data, nstep=5)
    assert data.body("object").xpos[2] - low > 0.08
    assert tilt(data.body("object").xquat) < 5.0


@pytest.mark.parametrize(
    ("content", "own", "vessel", "scale", "aside"),
    [
        ("bowl", 0.7, "bowl", 0.95, 0.0098),  # its lug fits in beside it
        ("waffle", 1.0, "bowl", 1.0, 0.005),
        ("straw", 1.5, "glass_cup", 1.0, 0.005),
    ],
)
def test_what_tasks_put_together_fits(
    mujoco: ModuleType, content: str, own: float, vessel: str, scale: float, aside: float
) -> None:
    outer, inner = table()[vessel], table()[content]
    height = scale * outer.size[2]
    upright = content == "straw"
    quat = "0.70 0.05 0.71 0" if upright else "0.924 0 0 0.383"  # leaning; turned by 45 degrees
    high = height / 2 + 0.1 if upright else height + own * inner.size[2] / 2 + 0.01
    # A lug to the front, so turned, is on the other side.
    where = (-aside / math.sqrt(2), aside / math.sqrt(2), high)
    bodies = [
        put(outer, "outer", (0, 0, height / 2), free=True, scale=scale),
        put(inner, "inner", where, free=True, quat=quat, scale=own),
    ]
    model = mujoco.MjModel.from_xml_string(world([TABLE_TOP, *bodies]))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1000)
    offset = data.body("inner").xpos - data.body("outer").xpos
    assert abs(offset[:2]).max() < scale * outer.size[0] / 2
    assert offset[2] < (0.08 if upright else 0.02)  # on the floor of it, not on the rim
    assert tilt(data.body("outer").xquat) < 1.0
