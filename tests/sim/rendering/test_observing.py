"""Observations: what RoboCasa's gym wrapper gives, and the simulation is none the wiser."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.sim.backend import Backend, Options, Request, Start
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.sim.robocasa.observation import CAMERAS, LEFT, RIGHT, STATE, WRIST
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.trace import Step
from tests.sim.rendering import stock
from tests.sim.stepping.test_reproducible import assert_identical, run

TASK = "PickPlaceCounterToCabinet"
ROOT = Path(__file__).parents[3]

Groups = Callable[[str], dict[str, list[str]]]
Seen = Mapping[str, NDArray[Any]]

# Python imports this by itself at start-up, in the simulator's process too.
WITHOUT_LIBRARIES = """
import ctypes, ctypes.util

hidden = {hidden!r}
find, load = ctypes.util.find_library, ctypes.CDLL.__init__

def find_library(name):
    return None if name in hidden else find(name)

def init(self, name, *args, **kwargs):
    if name and any(f"lib{{each}}." in str(name) or each == name for each in hidden):
        raise OSError(f"{{name}}: cannot open shared object file")
    load(self, name, *args, **kwargs)

ctypes.util.find_library, ctypes.CDLL.__init__ = find_library, init
"""

DRAW = """
import os
import mujoco
from pytest_safemanip.sim.mujoco import graphics

context = graphics.open_context("")
empty = mujoco.MjModel.from_xml_string("<mujoco/>")
mujoco.MjrContext(empty, mujoco.mjtFontScale.mjFONTSCALE_50)
print(os.environ["PYOPENGL_PLATFORM"], flush=True)
os._exit(0)
"""

NAMED = """
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.mujoco import graphics

try:
    graphics.open_context("osmesa")
except ConfigError as error:
    print(error)
"""


@pytest.fixture
def make_backend(tmp_path: Path) -> Iterator[Callable[[], Backend]]:
    made: list[Backend] = []

    def make() -> Backend:
        made.append(create(Options("primitive", tmp_path / "logs")))
        return made[-1]

    yield make
    for backend in made:
        backend.close()


@pytest.fixture
def hide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Takes GL libraries from the processes that start from now on."""

    def hide(*libraries: str) -> None:
        (tmp_path / "sitecustomize.py").write_text(WITHOUT_LIBRARIES.format(hidden=libraries))
        path = os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", "")))
        monkeypatch.setenv("PYTHONPATH", path)

    return hide


@pytest.fixture
def request_(object_groups: Groups) -> Request:
    return Request(TASK, 0, "compact", object_groups(TASK))


@pytest.fixture
def start(backend: Backend, request_: Request) -> Start:
    return backend.reset(request_)


def works(platform: str) -> bool:
    code = f"from mujoco.{platform} import GLContext; GLContext(8, 8).make_current()"
    # What has drawn in this process has set this to its own platform.
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, check=False, env=environment)
    return done.returncode == 0


def require(platform: str) -> None:
    if not works(platform):
        pytest.skip(f"this machine cannot draw with {platform}")


def moving(count: int) -> NDArray[np.float64]:
    """The arm swings, the base drives and turns."""
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (count, 12))
    actions[:, 11] = np.where(np.arange(count) % 4 < 2, -1.0, 1.0)
    return actions


def red(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Where the compact kitchen's wall is."""
    r, g, b = image.astype(int).transpose(2, 0, 1)
    return (r > 2 * g) & (r > 2 * b) & (r > 60)


def test_observations_are_those_of_the_official_wrapper(
    request_: Request,
    make_backend: Callable[[], Backend],
    assets_root: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # One library is enough here, and each takes a quarter minute: both draw with the same Mesa.
    platform = "osmesa" if works("osmesa") else "egl"
    monkeypatch.setenv("MUJOCO_GL", platform)
    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    actions, out = tmp_path / "actions.npy", tmp_path / "out.npz"
    np.save(actions, moving(5))
    arguments = [str(assets_root), json.dumps(dataclasses.asdict(request_)), str(actions), str(out)]
    done = subprocess.run(
        [sys.executable, "-m", stock.__name__, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    official = dict(np.load(out))
    ours = make_backend()
    ours.reset(request_)
    for action in moving(5):
        ours.step(action)
    seen = ours.observe()
    assert seen.keys() == official.keys()
    for key in STATE:
        assert seen[key].dtype == official[key].dtype == np.float32
        assert np.allclose(seen[key], official[key], rtol=0.0, atol=1e-6), key
    for key in CAMERAS:
        assert np.array_equal(seen[key], official[key]), key


def test_observations_have_the_names_shapes_and_types(backend: Backend, start: Start) -> None:
    seen = backend.observe()
    assert set(seen) == {*CAMERAS, *STATE}
    declared = {camera.name: (camera.height, camera.width, 3) for camera in SPEC.cameras}
    assert {name: seen[name].shape for name in declared} == declared
    assert {name: seen[name].shape for name in SPEC.state} == {
        name: (size,) for name, size in SPEC.state.items()
    }
    for key in CAMERAS:
        assert (seen[key].shape, seen[key].dtype) == ((256, 256, 3), np.uint8)
        assert seen[key].std() > 20.0, f"{key} shows nothing"
    for key, size in STATE.items():
        assert (seen[key].shape, seen[key].dtype) == ((size,), np.float32)
    assert all(array.flags.writeable for array in seen.values())


def test_cameras_differ_and_are_the_right_way_up(backend: Backend, start: Start) -> None:
    seen = backend.observe()
    for one, other in ((LEFT, RIGHT), (LEFT, WRIST), (RIGHT, WRIST)):
        assert (seen[one] != seen[other]).mean() > 0.3
    for key in (LEFT, RIGHT):
        wall = red(seen[key])
        assert wall[:128].mean() > 3.0 * wall[128:].mean(), "the wall is above the counter"
    # The robot stands in the middle: to the right of its left camera's view.
    robot = (np.ptp(seen[LEFT][200:], axis=2) < 8) & (seen[LEFT][200:].min(axis=2) > 230)
    assert robot[:, 128:].mean() > 2.0 * robot[:, :128].mean()


def test_images_show_the_present_state_and_nothing_else(
    backend: Backend, start: Start, request_: Request
) -> None:
    first = backend.observe()
    again = backend.observe()
    assert all(np.array_equal(first[key], again[key]) for key in first)
    for action in moving(6):
        backend.step(action)
    later = backend.observe()
    for key in (*CAMERAS, "state.end_effector_position_relative"):
        assert not np.array_equal(first[key], later[key]), f"{key} did not change"
    backend.reset(request_)
    assert all(np.array_equal(first[key], seen) for key, seen in backend.observe().items())


class Looking:
    """A backend that observes at every step."""

    def __init__(self, backend: Backend) -> None:
        self._backend, self.spec, self.provenance = backend, backend.spec, backend.provenance
        self.observe, self.close = backend.observe, backend.close

    def reset(self, request: Request) -> Start:
        start = self._backend.reset(request)
        self.observe()
        return start

    def step(self, action: NDArray[np.float64]) -> Step:
        step = self._backend.step(action)
        self.observe()
        return step


def test_observing_changes_no_bit_of_an_episode(backend: Backend, object_groups: Groups) -> None:
    groups = object_groups(TASK)
    blind, seeing = (run(b, TASK, groups, "exact") for b in (backend, Looking(backend)))
    assert_identical(blind, seeing)


def test_the_live_data_are_only_read(
    make_kitchen: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from pytest_safemanip.sim.robocasa.rendering import observing

    class Pictures:
        def __init__(self, *_: Any) -> None: ...
        def take(self, *_: Any) -> None: ...

    monkeypatch.setattr(observing, "Painter", Pictures)
    env = make_kitchen("OpenDrawer")
    env.step(moving(1)[0])  # from here on, what is derived from the state lags behind it
    data = env.sim.data._data
    fields = (
        "time",
        "qpos",
        "qvel",
        "qacc_warmstart",
        "xpos",
        "site_xpos",
        "cam_xpos",
        "efc_force",
    )
    before = {name: np.array(getattr(data, name)) for name in fields}
    observer = observing.Observer(env, None)
    observer.observe()
    assert not np.array_equal(before["xpos"], observer._scratch.xpos)
    for name in fields:
        assert np.array_equal(before[name], getattr(data, name)), name


def test_observing_before_a_reset_is_refused(make_backend: Callable[[], Backend]) -> None:
    with pytest.raises(RolloutError, match="before reset"):
        make_backend().observe()


def test_without_a_gl_library_the_packages_are_named_and_the_rollout_goes_on(
    hide: Callable[..., None], make_backend: Callable[[], Backend], request_: Request
) -> None:
    hide("EGL", "OSMesa")
    backend = make_backend()
    backend.reset(request_)
    with pytest.raises(ConfigError, match="cannot be rendered") as caught:
        backend.observe()
    for part in ("libegl1", "libosmesa6", "policies that need no images run without"):
        assert part in str(caught.value)
    assert np.isfinite(backend.step(np.zeros(12)).eef_pose).all()


@pytest.mark.parametrize("lacking", ["library", "device"])
def test_osmesa_serves_where_egl_does_not(
    lacking: str, hide: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    require("osmesa")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    if lacking == "library":
        hide("EGL")
    else:
        monkeypatch.setenv("MUJOCO_EGL_DEVICE_ID", "99")
    command = [sys.executable, "-c", DRAW]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "osmesa\n"), done.stderr


def test_the_library_that_the_user_names_is_the_only_one_tried(
    hide: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    hide("OSMesa")
    command = [sys.executable, "-c", NAMED]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert re.search(r"MUJOCO_GL=osmesa.*install libosmesa6", done.stdout)
    assert "libegl1" not in done.stdout
