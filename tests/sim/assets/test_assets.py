"""The overlay of RoboCasa's assets, on a RoboCasa package in miniature."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robocasa import assets, downloads, loading
from pytest_safemanip.sim.robocasa.assets import Mode, prepare_assets
from pytest_safemanip.sim.robocasa.standins.inventory import Inventory

CATEGORIES = """
import os
BASE = "zoo"
OBJ_CATEGORIES = dict(
    apple=dict(types=("fruit"), graspable=True, objaverse=dict(scale=0.9), aigen=dict()),
    jar=dict(types=("receptacle",), lightwheel=dict(scale=0.9, exclude=["a"] + ["b"])),
    liquor=dict(types=("drink"), aigen=dict(model_folders=[os.path.join(BASE, "aigen_objs/gin")])),
    saucepan=dict(types=("receptacle"), lightwheel=dict(scale=-(-0.92))),
    saucepan_lid=dict(
        types=("lid"),
        is_auxiliary_obj=True,
        lightwheel=dict(model_folders=["lightwheel/saucepan"], scale=[0.98, 0.98, 0.98]),
    ),
)
"""
FILES = {
    "objects/kitchen_objects.py": CATEGORIES,
    "fixtures/cabinets.py": """
VISUAL_MESH_PANEL_PATH_REG = {"Panel1": "fixtures/cabinets/cabinet_panels/Panel1/model.xml"}
""",
    "fixtures/cabinet_panels.py": """
VISUAL_MESH_ELONGATED_HANDLE_REG = {"Bar1": "fixtures/handles/Bar1/model.xml"}
VISUAL_MESH_KNOB_HANDLE_REG = {"Knob1": "fixtures/handles/Knob1/model.xml"}
DEFAULT = "textures/metals/bright_metal.png"
""",
    "scenes/scene.py": "",
    "assets/arenas/arena.xml": "<mujoco/>",
    "assets/scenes/kitchen_styles/test/style001.yaml": "sink: Sink001",
    "assets/novel_instructions/some.csv": "a,b",
    "assets/fixtures/fixture_registry/sink.yaml": """
default: {size: [null, 0.53, null], xml: fixtures/sinks/Sink001}
Sink001: {xml: fixtures/sinks/Sink001}
Sink002: {xml: fixtures/sinks/Sink002, size: [null, 0.47, null]}
""",
    "assets/fixtures/fixture_registry/jar.yaml": """
default: {size: [null, null, 0.14], xml: objects/lightwheel/jar/Jar001}
""",
    "assets/fixtures/fixture_registry/jar_lid.yaml": """
default: {size: [0.1, null, null], xml: objects/lightwheel/jar/Jar001/Jar001_Lid}
""",
    "assets/fixtures/fixture_registry/cabinet.yaml": """
default: {texture: textures/wood/oak.png}
Bar1: {handle_type: Bar1, handle_config: {half_size: [0.02, 0.01]}}
""",
    "assets/fixtures/counters/counter/model.xml": '<texture file="visuals/marble.png"/>',
    "assets/fixtures/counters/counter/visuals/marble.png": "png",
    "assets/fixtures/handles/bar.xml": '<texture file="../handles/visuals/brass.png"/>',
    "assets/fixtures/cabinets/cabinet.xml": '<texture file="../../../textures/outside.png"/>',
}
DOWNLOADS = (
    "fixtures/sinks/Sink001/model.xml",
    "fixtures/sinks/Sink001/visuals/sink.obj",
    "fixtures/sinks/Sink002/model.xml",
    "fixtures/cabinets/cabinet_panels/Panel1/model.xml",
    "fixtures/handles/Bar1/model.xml",
    "fixtures/handles/Knob1/model.xml",
    "fixtures/handles/visuals/brass.png",
    "textures/flat/gray.png",
    "textures/metals/bright_metal.png",
    "textures/wood/oak.png",
    "objects/objaverse/apple/apple_1/model.xml",
    "objects/objaverse/apple/apple_1/visual/apple.obj",
    "objects/aigen_objs/apple/apple_1/model.xml",
    "objects/aigen_objs/gin/gin_1/model.xml",
    "objects/lightwheel/jar/Jar001/model.xml",
    "objects/lightwheel/jar/Jar001/Jar001_Lid/model.xml",
    "objects/lightwheel/saucepan/Saucepan1/model.xml",
    "objects/lightwheel/saucepan/Saucepan1/lid/model.xml",
)

APPLE = tuple(path for path in DOWNLOADS if "objaverse" in path)


def make_package(folder: Path) -> Path:
    """A RoboCasa without downloads; its assets folder."""
    for path, text in FILES.items():
        write(folder / "robocasa" / "models" / path, text)
    return folder / "robocasa" / "models" / "assets"


def write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def download(root: Path, *paths: str) -> None:
    for path in paths or DOWNLOADS:
        write(root / path, official(path))


def official(path: str) -> str:
    """What a download has there; a model names a file beside it if there is one in the list."""
    beside = [p for p in DOWNLOADS if p.startswith(path.removesuffix("model.xml")) and p != path]
    files = [p.removeprefix(path.removesuffix("model.xml")) for p in beside if p[-4:] == ".obj"]
    meshes = "".join(f'<mesh name="mesh" file="{file}"/>' for file in files)
    return f"<mujoco><!-- official {path} -->{meshes}</mujoco>" if path[-4:] == ".xml" else path


def snapshot(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {
        str(file.relative_to(folder)): (file.stat().st_mtime_ns, file.read_bytes())
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


def real_files(root: Path) -> dict[str, bytes]:
    """Content of what was generated in an overlay, by path."""
    return {
        file.relative_to(root).as_posix(): file.read_bytes()
        for file in sorted(root.rglob("*"))
        if file.is_file() and not file.is_symlink()
    }


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return make_package(tmp_path / "site")


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    return tmp_path / "cache"


def test_without_downloads_everything_is_generated(package: Path, cache: Path) -> None:
    before = snapshot(package)
    prepared = prepare_assets(package, "auto", cache)
    assert prepared.kind == "primitive"
    assert (prepared.official, prepared.generated) == (0, 17)
    generated = real_files(prepared.root)
    for path in DOWNLOADS:
        if not path.startswith("objects/") and path.endswith((".xml", ".png")):
            assert path in generated
    for path in (
        "objects/objaverse/apple/apple_standin5/model.xml",
        "objects/aigen_objs/gin/liquor_standin0/model.xml",
        "objects/lightwheel/saucepan/saucepan_standin3/lid/model.xml",
        "objects/lightwheel/jar/Jar001/Jar001_Lid/model.xml",
    ):
        assert path in generated
    assert not any("outside" in path for path in generated)
    assert snapshot(package) == before


def test_what_ships_with_the_package_is_linked(package: Path, cache: Path) -> None:
    root = prepare_assets(package, "auto", cache).root
    for path in (
        "arenas/arena.xml",
        "scenes/kitchen_styles/test/style001.yaml",
        "novel_instructions/some.csv",
        "fixtures/fixture_registry/sink.yaml",
        "fixtures/counters/counter/visuals/marble.png",
        "fixtures/handles/bar.xml",
    ):
        assert (root / path).resolve() == (package / path).resolve()


def test_parent_folders_in_shipped_models_lead_into_the_overlay(package: Path, cache: Path) -> None:
    root = prepare_assets(package, "auto", cache).root
    texture = root / "fixtures" / "handles" / "../handles/visuals/brass.png"
    assert texture.resolve().is_relative_to(root.resolve())


def test_auto_generates_exactly_what_is_missing(package: Path, cache: Path) -> None:
    kept = (DOWNLOADS[0], DOWNLOADS[1], "textures/wood/oak.png", DOWNLOADS[10], DOWNLOADS[11])
    download(package, *kept)
    before = snapshot(package)
    prepared = prepare_assets(package, "auto", cache)
    assert prepared.kind == "mixed"
    assert (prepared.official, prepared.generated) == (3, 14)
    for path in kept:
        assert (prepared.root / path).read_text() == official(path)
    generated = real_files(prepared.root)
    assert not set(kept) & set(generated)
    assert "fixtures/sinks/Sink002/model.xml" in generated
    assert "textures/flat/gray.png" in generated
    assert not any("objaverse" in path for path in generated)
    assert "14 of 17" in prepared.describe()
    assert snapshot(package) == before


def test_scratch_files_beside_official_objects_stay_in_the_overlay(
    package: Path, cache: Path
) -> None:
    download(package, *APPLE)
    root = prepare_assets(package, "auto", cache).root
    (root / "objects/objaverse/apple/apple_1/scratch.xml").write_text("")
    assert not (package / "objects/objaverse/apple/apple_1/scratch.xml").exists()


def test_a_missing_lid_does_not_end_up_in_the_official_folder(package: Path, cache: Path) -> None:
    download(package, "objects/lightwheel/jar/Jar001/model.xml")
    root = prepare_assets(package, "auto", cache).root
    assert (root / "objects/lightwheel/jar/Jar001/Jar001_Lid/model.xml").is_file()
    assert not (package / "objects/lightwheel/jar/Jar001/Jar001_Lid").exists()


def test_a_later_download_is_noticed(package: Path, cache: Path) -> None:
    first = prepare_assets(package, "auto", cache)
    download(package, *APPLE)
    second = prepare_assets(package, "auto", cache)
    download(package, "objects/objaverse/apple/apple_2/model.xml")
    third = prepare_assets(package, "auto", cache)
    assert [first.official, second.official, third.official] == [0, 1, 1]
    assert len({first.key, second.key, third.key}) == 3
    assert (third.root / "objects/objaverse/apple/apple_2/model.xml").is_file()


def test_a_model_that_is_written_over_is_other_assets(package: Path, cache: Path) -> None:
    download(package)
    keys = [prepare_assets(package, "auto", cache).key]
    model = package / "fixtures/sinks/Sink001/model.xml"
    text = model.read_text()
    write(model, text.replace("<mesh", '<mesh scale="2 2 2"'))
    keys.append(prepare_assets(package, "auto", cache).key)
    write(package / "fixtures/sinks/Sink001/visuals/sink.obj", "a larger mesh")
    write(model, text)
    keys.append(prepare_assets(package, "auto", cache).key)
    assert len(set(keys)) == 3


def test_scratch_files_of_robocasas_do_not_make_other_assets(package: Path, cache: Path) -> None:
    download(package)
    key = prepare_assets(package, "auto", cache).key
    write(package / "objects/objaverse/apple/apple_1/model_4711.xml", "<mujoco/>")
    shutil.rmtree(cache)
    assert prepare_assets(package, "auto", cache).key == key


def test_complete_downloads_need_no_overlay(package: Path, cache: Path) -> None:
    download(package)
    for mode in ("auto", "official"):
        prepared = prepare_assets(package, mode, cache)
        assert (prepared.root, prepared.kind) == (package, "official")
        assert (prepared.official, prepared.generated) == (17, 0)


def test_primitive_ignores_downloads(package: Path, cache: Path) -> None:
    clean = prepare_assets(package, "primitive", cache)
    download(package)
    prepared = prepare_assets(package, "primitive", cache)
    assert (prepared.kind, prepared.official, prepared.key) == ("primitive", 0, clean.key)
    overlay = prepared.root.rglob("*")
    assert not any(b"official" in f.read_bytes() for f in overlay if f.is_file())


def test_official_names_what_is_missing_and_how_to_get_it(package: Path, cache: Path) -> None:
    download(package, *(path for path in DOWNLOADS if "sinks" not in path and "gin" not in path))
    with pytest.raises(ConfigError) as error:
        prepare_assets(package, "official", cache)
    message = str(error.value)
    assert "2 fixtures (fixtures/sinks/Sink001/model.xml, " in message
    assert "1 aigen_objs objects (objects/aigen_objs/gin)" in message
    assert "python -m robocasa.scripts.download_kitchen_assets" in message
    assert str(package) in message


@pytest.mark.parametrize("mode", ["auto", "official"])
def test_a_model_without_its_meshes_is_named_with_what_completes_it(
    package: Path, cache: Path, mode: Mode
) -> None:
    meshes = [path for path in DOWNLOADS if path.endswith(".obj")]
    download(package)
    for path in meshes:
        (package / path).unlink()
    with pytest.raises(ConfigError) as error:
        prepare_assets(package, mode, cache)
    assert str(error.value) == (
        f"RoboCasa's downloaded assets are incomplete in {package}: "
        "objects/objaverse/apple/apple_1/model.xml needs visual/apple.obj, which is not there "
        "(2 models like this); complete them with: python -m robocasa.scripts."
        "download_kitchen_assets --type fixtures_lw objs_objaverse, or run with "
        "--safemanip-assets=primitive"
    )
    assert prepare_assets(package, "primitive", cache).kind == "primitive"
    download(package, *meshes)
    assert prepare_assets(package, mode, cache).kind == "official"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('<mujoco><mesh file="visual/apple.obj"/></mujoco>', None),
        ("<mujoco><mesh file='visual/pear.obj'/></mujoco>", "needs visual/pear.obj"),
        ('<mujoco><!-- <mesh file="visual/pear.obj"/> --></mujoco>', None),
        ('<mujoco><texture file="../../textures/pear.png"/></mujoco>', None),
        ('<mujoco><texture file="/home/me/textures/pear.png"/></mujoco>', None),
        ('<mujoco><mesh file="visual/app', "is cut off"),
        ("<mujoco>\n<geom size=.1/></mujoco>", "is no XML: not well-formed .*: line 2"),
    ],
)
def test_a_model_needs_the_files_below_its_folder(
    package: Path, cache: Path, text: str, fault: str | None
) -> None:
    download(package)
    write(package / "objects/objaverse/apple/apple_1/model.xml", text)
    if fault is None:
        assert prepare_assets(package, "auto", cache).kind == "official"
        return
    with pytest.raises(ConfigError, match=f"apple_1/model.xml {fault}"):
        prepare_assets(package, "auto", cache)


def test_a_command_completes_each_archive_of_robocasas() -> None:
    script = loading.package_assets().parents[1] / "scripts" / "download_kitchen_assets.py"
    entry = re.compile(r'^    "(\w+)": dict\(.*?models/assets/([\w/]+)"', re.MULTILINE | re.DOTALL)
    registry = entry.findall(script.read_text())
    assert {folder: name for name, folder in registry} == downloads.ARCHIVES


def test_downloads_beside_the_package_are_used(
    package: Path, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "downloads"
    download(elsewhere)
    monkeypatch.syspath_prepend(str(package.parents[2]))
    monkeypatch.delitem(sys.modules, "robocasa", raising=False)
    write(package.parents[1] / "__init__.py", "raise RuntimeError('must not be imported')")
    prepared = prepare_assets(elsewhere, "official", cache)
    assert prepared.kind == "official"
    assert prepared.root not in (elsewhere, package)
    assert (prepared.root / "arenas/arena.xml").is_file()
    assert (prepared.root / DOWNLOADS[0]).read_text() == official(DOWNLOADS[0])


def test_the_same_everywhere(cache: Path, tmp_path: Path) -> None:
    one, other = make_package(tmp_path / "a"), make_package(tmp_path / "b" / "c")
    first = prepare_assets(one, "auto", cache)
    second = prepare_assets(other, "auto", tmp_path / "cache2")
    assert first.key == second.key
    assert real_files(first.root) == real_files(second.root)


def test_two_installations_do_not_share_links(cache: Path, tmp_path: Path) -> None:
    one, other = make_package(tmp_path / "a"), make_package(tmp_path / "b")
    first, second = (prepare_assets(root, "auto", cache) for root in (one, other))
    shutil.rmtree(tmp_path / "a")
    assert (second.root / "arenas/arena.xml").is_file()
    assert not (first.root / "arenas/arena.xml").exists()


@pytest.mark.parametrize(
    ("path", "old", "new"),
    [
        ("objects/kitchen_objects.py", "scale=0.9)", "scale=0.8)"),
        ("assets/fixtures/fixture_registry/sink.yaml", "0.47", "0.46"),
        ("assets/scenes/kitchen_styles/test/style001.yaml", "Sink001", "Sink002"),
    ],
)
def test_the_key_follows_the_package(
    package: Path, cache: Path, path: str, old: str, new: str
) -> None:
    before = prepare_assets(package, "auto", cache).key
    file = package.parent / path
    file.write_text(file.read_text().replace(old, new))
    assert prepare_assets(package, "auto", cache).key != before


def test_it_is_found_again_without_looking_around(
    package: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = prepare_assets(package, "auto", cache)

    def fail(*_: object, **__: object) -> Inventory:
        raise AssertionError("took an inventory")

    monkeypatch.setattr(Inventory, "take", fail)
    assert prepare_assets(package, "auto", cache) == first


def test_a_half_built_overlay_is_not_used(package: Path, cache: Path) -> None:
    first = prepare_assets(package, "auto", cache)
    lost = first.root / "fixtures/sinks/Sink001/model.xml"
    lost.unlink()
    (first.root / assets.COMPLETE).unlink()
    assert prepare_assets(package, "auto", cache) == first
    assert lost.is_file()


def test_two_processes_at_once(package: Path, cache: Path) -> None:
    code = (
        "import sys; from pathlib import Path\n"
        "from pytest_safemanip.sim.robocasa.assets import prepare_assets\n"
        "print(prepare_assets(Path(sys.argv[1]), 'auto', Path(sys.argv[2])).root)"
    )
    command = [sys.executable, "-c", code, str(package), str(cache)]
    running = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[3])
        for _ in range(3)
    ]
    roots = {process.communicate(timeout=60)[0].strip() for process in running}
    assert [process.returncode for process in running] == [0, 0, 0]
    assert len(roots) == 1
    assert (Path(roots.pop()) / assets.COMPLETE).is_file()


def test_an_unwritable_cache_is_named(package: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(ConfigError, match=r"cannot write .*file/assets.*XDG_CACHE_HOME"):
        prepare_assets(package, "auto", blocked)


def test_a_path_that_robocasa_would_cut_is_refused(package: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"contains 'textures/'"):
        prepare_assets(package, "auto", tmp_path / "textures")


def test_a_folder_of_something_else_is_refused(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "modules.conf").write_text("")
    with pytest.raises(ConfigError, match=r"none of arenas, .* check ROBOCASA_ASSETS_PATH"):
        prepare_assets(tmp_path, "auto", cache)


def test_an_overlay_is_not_taken_for_robocasas_own(package: Path, cache: Path) -> None:
    overlay = prepare_assets(package, "auto", cache).root
    with pytest.raises(ConfigError, match="unset ROBOCASA_ASSETS_PATH"):
        prepare_assets(overlay, "auto", cache)


def test_a_missing_folder_is_named(tmp_path: Path, cache: Path) -> None:
    with pytest.raises(ConfigError, match="nowhere is not a folder"):
        prepare_assets(tmp_path / "nowhere", "auto", cache)


@pytest.mark.parametrize("link", ["gone.obj", "loop.obj"])
def test_a_link_that_leads_nowhere_is_named(package: Path, cache: Path, link: str) -> None:
    download(package)
    (package / "objects/objaverse/apple/apple_1/loop.obj").symlink_to(link)
    with pytest.raises(ConfigError, match=r"assets in .* cannot be read: .*apple_1/loop\.obj"):
        prepare_assets(package, "auto", cache)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"sink: [1, 2"])
def test_a_registry_that_is_no_yaml_is_named(package: Path, cache: Path, content: bytes) -> None:
    (package / "fixtures/fixture_registry/sink.yaml").write_bytes(content)
    with pytest.raises(ConfigError, match=r"sink\.yaml is no YAML: .*; download"):
        prepare_assets(package, "auto", cache)


def test_a_category_that_is_new_gets_a_plain_shape_and_a_warning(
    package: Path, cache: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = package.parent / "objects/kitchen_objects.py"
    file.write_text(CATEGORIES.replace("apple=", "durian="))
    for _ in range(2):
        caplog.clear()
        prepared = prepare_assets(package, "auto", cache)
        assert prepared.generic == ("durian",)
        assert "durian" in caplog.text
    assert "durian" in prepared.describe()
    assert (prepared.root / "objects/objaverse/durian/durian_standin0/model.xml").is_file()


def test_a_fixture_that_is_new_gets_a_plain_shape(package: Path, cache: Path) -> None:
    write(
        package / "fixtures/fixture_registry/waffle_iron.yaml",
        "default: {xml: fixtures/waffle_irons/Iron1, size: [0.3, null, null]}",
    )
    assert prepare_assets(package, "auto", cache).generic == ("waffle_iron",)


def test_a_category_that_would_have_to_be_run_is_named(package: Path, cache: Path) -> None:
    file = package.parent / "objects/kitchen_objects.py"
    file.write_text(CATEGORIES.replace("scale=0.9)", "scale=factor())"))
    with pytest.raises(ConfigError, match=r"kitchen_objects.py:5: cannot read 'factor\(\)'"):
        prepare_assets(package, "auto", cache)


def test_a_robocasa_of_another_make_is_named(package: Path, cache: Path) -> None:
    write(package.parent / "fixtures/cabinets.py", "")
    with pytest.raises(ConfigError, match="does not define VISUAL_MESH_PANEL_PATH_REG"):
        prepare_assets(package, "auto", cache)
