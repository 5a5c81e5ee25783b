"""The stand-in models: they are what RoboCasa asks for, and they behave like the real things."""

import importlib.util
import math
import struct
import subprocess
import sys
import xml.etree.ElementTree as ET
import zlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robocasa import kitchens
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.standins import (
    catalogue,
    fixtures,
    literals,
    objects,
    paint,
    source,
)
from pytest_safemanip.sim.robocasa.standins.elements import numbers
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models import (
    blenders,
    cabinet_parts,
    fridges,
    sinks,
    vessels,
)
from pytest_safemanip.sim.robocasa.standins.models.cabinet_parts import HandleSize

GRIPPER_OPENING = 0.079
HOLLOW = ("bowl", "lugged", "mug", "pan", "pot", "colander", "goblet", "tray", "bin", "basket")
SIMPLE = ("ball", "pod", "block", "log", "can", "bottle", "tool", "turner", "board")
TABLE_TOP = '<geom name="table" type="box" size="1 1 .05" pos="0 0 -.05"/>'


@pytest.fixture(scope="module")
def mujoco() -> ModuleType:
    return pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def models_folder() -> Path:
    """RoboCasa's source, found but not imported."""
    spec = importlib.util.find_spec("robocasa")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("robocasa is not installed")
    return Path(next(iter(spec.submodule_search_locations))) / "models"


@pytest.fixture(scope="module")
def needs(models_folder: Path) -> source.Needs:
    return source.read_needs(models_folder, models_folder / "assets")


def parse(model: Model) -> ET.Element:
    return ET.fromstring(model.to_xml())


def body_of(model: Model, *, name: str, z: float, free: bool, flipped: bool = False) -> str:
    """The body of an object as RoboCasa would put it into a scene, with its contact settings."""
    body = parse(model).find("./worldbody/body/body")
    assert body is not None
    for element in body.iter():
        if element.get("name"):
            element.set("name", f"{name}_{element.get('name')}")
        if element.tag == "geom":
            element.set("density", "100")
            element.set("friction", "0.95 0.3 0.1")
            element.set("solref", "0.001 2")
            element.set("solimp", "0.998 0.998 0.001")
    body.set("pos", f"0 0 {z}")
    if flipped:
        body.set("quat", "0 1 0 0")
    if free:
        ET.SubElement(body, "joint", type="free", damping="0.0005")
    return ET.tostring(body, encoding="unicode")


def world(*bodies: str) -> str:
    return (
        '<mujoco><compiler angle="radian" inertiagrouprange="0 0"/>'
        '<option timestep="0.002" impratio="20" cone="elliptic"/>'
        f"<worldbody>{''.join(bodies)}</worldbody></mujoco>"
    )


def fixture_world(model: Model) -> str:
    body = parse(model).find("./worldbody/body")
    return world(ET.tostring(body, encoding="unicode"))


def every_kind() -> dict[str, Model]:
    built = {name: kind.build(kind.size) for name, kind in fixtures.KINDS.items()}
    built["blender"] = blenders.blender(fixtures.BLENDER, lid_width=0.16)
    built["double sink"] = sinks.sink((0.84, 0.53, 0.21), basins=2)
    return built


def penetrations(mujoco: ModuleType, model: object, data: object, depth: float) -> list[str]:
    mujoco.mj_forward(model, data)
    return [
        " x ".join(model.geom(geom).name or str(geom) for geom in contact.geom)
        for contact in data.contact
        if contact.dist < -depth
    ]


# ---------------------------------------------------------------- objects


def test_every_category_has_a_row(needs: source.Needs) -> None:
    asked = {folder.category for folder in needs.objects}
    assert asked <= set(objects.table())
    assert len(objects.table()) == 198


def test_objects_have_their_size_once_robocasa_has_scaled_them(needs: source.Needs) -> None:
    for folder in needs.objects:
        row = objects.table()[folder.category]
        if row.shape not in SIMPLE:
            continue
        root = parse(objects.object_model(row, 1.04, folder.scale))
        box = root.find(".//geom[@name='reg_bbox']")
        assert box is not None
        half = map(float, str(box.get("size")).split())
        scaled = [2 * side * factor for side, factor in zip(half, folder.scale, strict=True)]
        wanted = [1.04 * side for side in row.size]
        assert scaled == pytest.approx(wanted, abs=2e-5), folder


def test_what_robocasa_calls_graspable_fits_the_gripper(models_folder: Path) -> None:
    file = models_folder / source.CATEGORIES
    tables = literals.dictionaries(
        {file: file.read_text()}, ("OBJ_CATEGORIES",), ignored=source.COMPUTED
    )
    solid = {name: row for name, row in objects.table().items() if row.shape in SIMPLE}
    for name, entry in tables["OBJ_CATEGORIES"].items():
        if entry["graspable"] and name in solid:
            width = min(solid[name].size[:2]) * max(objects.FACTORS)
            assert width < GRIPPER_OPENING - 0.004, name


def test_objects_come_to_rest_as_they_were_put_down(mujoco: ModuleType) -> None:
    restless = []
    for name, row in objects.table().items():
        model = objects.object_model(row, 1.0, (1.0, 1.0, 1.0))
        centre, half = model.extent
        bottom = half[2] - centre[2]
        body = body_of(model, name="object", z=bottom + 0.01, free=True)
        compiled = mujoco.MjModel.from_xml_string(world(TABLE_TOP, body))
        data = mujoco.MjData(compiled)
        mujoco.mj_step(compiled, data, nstep=1000)
        x, y = data.qpos[4:6]
        upright = 1 - 2 * (x * x + y * y)
        stands = row.shape in objects.ROUND or upright > math.cos(math.radians(1))
        if abs(data.qvel).max() > 1e-3 or not stands or abs(data.qpos[2] - bottom) > 1e-3:
            restless.append(name)
    assert restless == []


def test_masses_survive_robocasas_density(mujoco: ModuleType) -> None:
    for name in ("apple", "lemon", "pan", "wine", "cup", "saucepan_lid", "fork", "tray"):
        row = objects.table()[name]
        body = body_of(
            objects.object_model(row, 1.0, (2.0, 2.0, 2.0)), name="object", z=0.0, free=True
        )
        compiled = mujoco.MjModel.from_xml_string(world(body))
        assert compiled.body_subtreemass[1] == pytest.approx(row.kg, rel=1e-3), name


@pytest.mark.parametrize("flipped", [False, True])
def test_vessels_hold_things_unless_they_are_turned_over(mujoco: ModuleType, flipped: bool) -> None:
    ball = objects.Row("ball", (0.02, 0.02, 0.02), 0.01, paint.RED)
    for name, row in objects.table().items():
        if row.shape not in HOLLOW:
            continue
        vessel = objects.object_model(row, 1.0, (1.0, 1.0, 1.0))
        middle = 0.3 + row.size[2] / 2
        # Inside, 1.5 mm above a floor that is 6 mm thick at most, and its foot; the cup of a goblet
        # is its upper half. When the vessel is turned over, the floor is a ceiling.
        foot = vessels.FOOT if row.shape == "lugged" else 0.0
        above = 0.02 if row.shape == "goblet" else foot + 0.0175 - row.size[2] / 2
        start = middle + (-above if flipped else above)
        content = objects.object_model(ball, 1.0, (1.0, 1.0, 1.0))
        compiled = mujoco.MjModel.from_xml_string(
            world(
                TABLE_TOP,
                body_of(vessel, name="vessel", z=middle, free=False, flipped=flipped),
                body_of(content, name="ball", z=start, free=True),
            )
        )
        data = mujoco.MjData(compiled)
        assert not penetrations(mujoco, compiled, data, 1e-4), name
        mujoco.mj_step(compiled, data, nstep=300)
        inside = data.qpos[2] > 0.3
        assert inside != flipped, name


def test_an_upright_model_stands_on_its_edge() -> None:
    row = objects.table()["sandwich_bread"]
    assert row.upright
    _, half = objects.object_model(row, 1.0, (1.0, 1.0, 1.0), upright=True).extent
    assert [2 * side for side in half] == pytest.approx([row.size[2], *row.size[:2]])


@pytest.mark.parametrize(
    ("vessel", "lid"),
    [
        (
            replace(objects.table()["saucepan"], size=(0.18 / 0.92, 0.18 / 0.92, 0.1 / 0.92)),
            objects.object_model(objects.table()["saucepan_lid"], 1.0, (1.0, 1.0, 1.0)),
        ),
        (
            replace(objects.table()["jar"], size=(0.96 * 0.065, 0.96 * 0.065, 0.17)),
            blenders.lid(0.065, kg=0.08),
        ),
    ],
    ids=["saucepan", "jar"],
)
def test_lids_stay_where_they_are_put(mujoco: ModuleType, vessel: objects.Row, lid: Model) -> None:
    pot = objects.object_model(vessel, 1.0, (1.0, 1.0, 1.0))
    rim = vessel.size[2]
    compiled = mujoco.MjModel.from_xml_string(
        world(
            TABLE_TOP,
            body_of(pot, name="pot", z=rim / 2, free=True),
            body_of(lid, name="lid", z=rim, free=True),
        )
    )
    data = mujoco.MjData(compiled)
    mujoco.mj_step(compiled, data, nstep=750)
    assert data.qpos[7:10] == pytest.approx([0, 0, rim], abs=1e-3)
    assert abs(data.qvel).max() < 1e-3


@pytest.mark.parametrize("width", [0.12, 0.18, 0.2565])
def test_a_blender_takes_the_lid_of_its_width(mujoco: ModuleType, width: float) -> None:
    size = fixtures.BLENDER
    blender = blenders.blender(size, lid_width=width)
    lid = body_of(blenders.lid(width, kg=0.25), name="lid", z=size[2] / 2, free=True)
    outer = parse(blender).find("./worldbody/body")
    compiled = mujoco.MjModel.from_xml_string(world(ET.tostring(outer, encoding="unicode"), lid))
    data = mujoco.MjData(compiled)
    mujoco.mj_step(compiled, data, nstep=500)
    assert data.qpos[:3] == pytest.approx([0, 0, size[2] / 2], abs=1e-3)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"tin": ["cone", 1, 1, 1, 1, "red"]}, "row 'tin' has the unknown shape 'cone'"),
        ({"tin": ["can", 1, 1, 1, "red"]}, r"row 'tin' is not \[shape, x, y, z, kg, colour\]"),
        ({"tin": ["can", 1, 1, 1, 1, "mauve"]}, "mauve"),
        ({"tin": "same_as box"}, "row 'tin' is to be the same as 'box', which has no row"),
    ],
)
def test_mistakes_in_the_table_are_named(cells: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        objects.read_table(cells)


# ---------------------------------------------------------------- fixtures

NAMES = {
    "microwave": "microjoint door_handle_main start_button stop_button reg_main reg_tray",
    "stove": "burner_on_front_left burner_rear_right_place_site knob_front_left_joint reg_main",
    "stovetop": "burner_on_rear_left knob_rear_left_joint reg_main",
    "oven": "door_joint rack0_joint rack1_joint knob_temp_joint knob_time_joint reg_rack1",
    "toaster_oven": "door_joint rack0_joint knob_function_joint reg_main reg_rack0",
    "sink": "handle_joint handle_temp_joint spout_joint water reg_main reg_basin handle_main",
    "double sink": "reg_basin_left reg_basin_right",
    "fridge_french_door": "fridge_left_door_joint fridge_right_door_joint reg_fridge_shelf0",
    "fridge_side_by_side": "fridge_door_joint freezer_door_joint reg_freezer_shelf2",
    "fridge_bottom_freezer": "fridge_door_joint freezer0_door_joint reg_freezer0",
    "dishwasher": "door_joint rack1_joint reg_rack0 reg_rack1",
    "toaster": "slotL_floor slotR_floor lever_joint knob_doneness_joint reg_slotL reg_slotR",
    "electric_kettle": "lid_joint switch_joint button_lid_joint reg_main",
    "coffee_machine": "start_button receptacle_place_site coffee_liquid reg_main",
    "stand_mixer": "head_joint knob_speed_joint button_head_lock_joint reg_bowl",
    "blender": "power_button_main anchor_site reg_int reg_main",
    "dish_rack": "reg_int_0 reg_int_2 reg_bbox",
}


@pytest.mark.parametrize("kind", NAMES)
def test_fixtures_have_the_names_that_robocasa_looks_for(kind: str) -> None:
    root = parse(every_kind()[kind])
    there = {element.get("name") for element in root.iter()}
    assert set(NAMES[kind].split()) <= there


def test_fixtures_fill_the_size_that_they_are_given() -> None:
    for name, kind in fixtures.KINDS.items():
        root = parse(kind.build(kind.size))
        region = root.find(".//geom[@name='reg_main']")
        if region is None:
            region = root.find(".//geom[@name='reg_bbox']")
        assert region is not None, name
        half = [float(side) for side in str(region.get("size")).split()]
        assert [2 * side for side in half] == pytest.approx(kind.size, abs=1e-5), name


def test_the_fridge_of_the_roomy_kitchen_is_the_roomy_one_wherever_it_is_listed(
    needs: source.Needs,
) -> None:
    def fridge(fixtures: list[source.Fixture]) -> object:
        found = {item.path: item for item in catalogue.items(replace(needs, fixtures=fixtures))}
        return found[path].make()[path]

    path = f"fixtures/fridges/{kitchens.ROOMY_FRIDGE['config_name']}/model.xml"
    for listed in (list(needs.fixtures), list(needs.fixtures)[::-1]):
        assert fridge(listed) == fridges.side_by_side((0.85, 0.8, 1.75), roomy=True).to_xml()


def test_missing_sizes_follow_the_given_ones() -> None:
    assert fixtures.fill((None, 0.2, None), (0.3, 0.4, 0.5)) == pytest.approx((0.15, 0.2, 0.25))
    assert fixtures.fill((0.6, None, -1), (0.3, 0.4, 0.5)) == pytest.approx((0.6, 0.8, 1.0))
    assert fixtures.fill((None, None, None), (0.3, 0.4, 0.5)) == (0.3, 0.4, 0.5)


@pytest.mark.parametrize("kind", every_kind())
def test_nothing_in_a_fixture_is_in_the_way_of_its_moving_parts(
    mujoco: ModuleType, kind: str
) -> None:
    model = mujoco.MjModel.from_xml_string(fixture_world(every_kind()[kind]))
    data = mujoco.MjData(model)
    assert penetrations(mujoco, model, data, 1e-4) == []
    names = [model.joint(joint).name for joint in range(model.njnt)]
    for joint, name in enumerate(names):
        low, high = model.jnt_range[joint]
        for step in range(21):
            data.qpos[:] = 0
            if "rack" in name or "drawer" in name:  # behind a door, which has to be open
                for other, door in enumerate(names):
                    if door.endswith("door_joint") and not door.startswith("freezer0"):
                        data.qpos[other] = model.jnt_range[other][1]
            data.qpos[joint] = low + (high - low) * step / 20
            assert penetrations(mujoco, model, data, 5e-4) == [], (name, step)


@pytest.mark.parametrize("kind", every_kind())
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_doors_knobs_and_lids_stay_where_they_are_left(
    mujoco: ModuleType, kind: str, share: float
) -> None:
    model = mujoco.MjModel.from_xml_string(fixture_world(every_kind()[kind]))
    data = mujoco.MjData(model)
    for joint in range(model.njnt):
        low, high = model.jnt_range[joint]
        sprung = model.jnt_stiffness[joint] > 0
        if not sprung and "rack" not in model.joint(joint).name:
            data.qpos[joint] = (
                min(max(0.0, low), high) if share == 0 else low + share * (high - low)
            )
            if "drawer" in model.joint(joint).name:
                data.qpos[joint] = 0.0
    before = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=500)
    assert data.qpos == pytest.approx(before, abs=2e-3)


@pytest.mark.parametrize(
    ("kind", "joint"),
    [
        ("microwave", "microjoint"),
        ("oven", "door_joint"),
        ("toaster_oven", "door_joint"),
        ("dishwasher", "door_joint"),
        ("fridge_bottom_freezer", "fridge_door_joint"),
        ("fridge_bottom_freezer", "freezer0_door_joint"),
        ("stand_mixer", "head_joint"),
    ],
)
def test_doors_close_and_open_all_the_way(mujoco: ModuleType, kind: str, joint: str) -> None:
    model = mujoco.MjModel.from_xml_string(fixture_world(every_kind()[kind]))
    low, high = model.joint(joint).range
    address, dof = model.joint(joint).qposadr[0], model.joint(joint).dofadr[0]
    data = mujoco.MjData(model)
    for goal in (low, high):
        data.qpos[address] = (low + high) / 2
        data.qfrc_applied[dof] = math.copysign(30.0, goal - data.qpos[address])
        mujoco.mj_step(model, data, nstep=1000)
        # RoboCasa: closed below 0.5 % of the range.
        assert abs(data.qpos[address] - goal) < 0.005 * (high - low)


def test_a_hand_reaches_the_tray_of_a_coffee_machine_with_a_mug(mujoco: ModuleType) -> None:
    # Panda's hand, 20 cm wide and 6.6 cm long from 4.5 cm behind the grip point, then its flange,
    # tipped by 40 degrees from straight down; the grip point is at the rim of a mug on the tray.
    machine = every_kind()["coffee_machine"]
    site = parse(machine).find(".//site[@name='receptacle_place_site']")
    assert site is not None
    x, y, z = (float(word) for word in str(site.get("pos")).split())
    half = math.radians(20.0)
    hand = (
        f'<body pos="{x} {y} {z + 0.08}" quat="{math.cos(half)} {math.sin(half)} 0 0"><freejoint/>'
        '<geom type="box" size=".10 .032 .033" pos="0 0 .078"/>'
        '<geom type="cylinder" size=".045 .045" pos="0 0 .156"/></body>'
    )
    world = fixture_world(machine).replace("</worldbody>", f"{hand}</worldbody>")
    model = mujoco.MjModel.from_xml_string(world)
    assert penetrations(mujoco, model, mujoco.MjData(model), 1e-4) == []


def test_a_toasters_lever_springs_up(mujoco: ModuleType) -> None:
    model = mujoco.MjModel.from_xml_string(fixture_world(every_kind()["toaster"]))
    data = mujoco.MjData(model)
    lever = model.joint("lever_joint")
    data.qpos[lever.qposadr[0]] = lever.range[1]
    mujoco.mj_step(model, data, nstep=500)
    assert data.qpos[lever.qposadr[0]] < 0.3 * lever.range[1]


# ---------------------------------------------------------------- cabinets


@pytest.mark.parametrize(
    "size", [HandleSize(), HandleSize(0.02, 0.01), HandleSize(None, 0.0125), HandleSize(0.015)]
)
def test_the_bar_stands_off_whatever_the_registry_prescribes(size: HandleSize) -> None:
    root = parse(cabinet_parts.bar_handle("gray.png", size))
    geoms = {g.get("name"): g for g in root.iter("geom") if g.get("name")}
    half_depth = float(str(geoms["reg_main"].get("size")).split()[1])
    if size.half_depth is not None:
        assert half_depth == size.half_depth
    front_of_panel = half_depth - cabinet_parts.EMBEDDED
    bar = float(str(geoms["handle"].get("pos")).split()[1])
    assert front_of_panel - bar == pytest.approx(0.05)
    assert geoms["handle"].get("material") == "mat"


MEASURE = """
import sys, xml.etree.ElementTree as ET
from pathlib import Path
from pytest_safemanip.sim.robocasa import loading
loading.load(Path(sys.argv[1]))
import mujoco, numpy as np
from robocasa.models.fixtures import Drawer, HingeCabinet, SingleCabinet
for kind, size, door in (
    (HingeCabinet, [1.0, 0.4, 0.92], "left_door"),
    (SingleCabinet, [0.5, 0.4, 0.92], "door"),
    (Drawer, [0.6, 0.6, 0.21], "door"),
):
    for handle, half in (("CabinetHandle001", None), ("CabinetHandle005", [0.02, 0.01])):
        config = {} if half is None else {"half_size": half}
        cabinet = kind(name="c", size=size, texture="textures/flat/white.png",
                       panel_type="CabinetDoorPanel003", handle_type=handle, handle_config=config)
        model = mujoco.MjModel.from_xml_string(ET.tostring(cabinet.root, encoding="unicode"))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        def front(name):
            geom = model.geom(name).id
            half = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_size[geom]
            return data.geom_xpos[geom][1], half[1]
        panel, panel_half = front(f"c_{door}_door")
        bar, bar_half = front(f"c_{door}_handle_handle")
        print(kind.__name__, panel - panel_half - bar, 2 * bar_half)
"""


def test_handles_stand_off_in_robocasas_own_cabinets(
    mujoco: ModuleType, models_folder: Path, tmp_path: Path
) -> None:
    root = prepare_assets(models_folder / "assets", "primitive", tmp_path).root
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, str(root)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=Path(__file__).parents[3],
    )
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in lines] == ["HingeCabinet"] * 2 + ["SingleCabinet"] * 2 + [
        "Drawer"
    ] * 2
    for name, standoff, thickness in lines:
        assert float(standoff) == pytest.approx(0.05, abs=1e-3), name
        assert float(thickness) == pytest.approx(0.016, abs=1e-3), name


# ---------------------------------------------------------------- text and textures


def test_textures_are_pngs_of_their_colour() -> None:
    data = paint.png((10, 20, 30))
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    start = data.index(b"IDAT") + 4
    length = struct.unpack(">I", data[start - 8 : start - 4])[0]
    rows = zlib.decompress(data[start : start + length])
    assert rows == (b"\0" + bytes((10, 20, 30)) * width) * height


def test_textures_are_coloured_by_name() -> None:
    assert paint.texture_colour("textures/flat/dark_gray.png") < paint.texture_colour(
        "textures/flat/light_gray.png"
    )
    tones = {paint.texture_colour(f"generative_textures/cabinet/tex{i:03}.png") for i in range(50)}
    assert len(tones) > 25


def test_numbers_are_written_alike() -> None:
    assert numbers((-0.0, 1e-9, 0.1 + 0.2, 12.0)) == "0 0 0.3 12"
