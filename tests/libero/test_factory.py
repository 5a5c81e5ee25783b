"""What the backend needs is checked before anything is simulated."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Options
from pytest_safemanip.sim.interpreter import Installed
from pytest_safemanip.sim.libero import factory
from pytest_safemanip.sim.libero.factory import SOME_ASSETS, create

VERSIONS = {"numpy": "1.26.4", "mujoco": "3.8.1", "robosuite": "1.4.0", "hf-libero": "0.1.4"}


@pytest.fixture
def having(monkeypatch, tmp_path):
    """Lets an interpreter have something, and gives the options that name it."""

    def have(versions, python=(3, 11), **paths: Path) -> Options:
        folders = {name: tmp_path / name for name in ("libero", "robosuite") if name in versions}
        for folder in folders.values():
            folder.mkdir(exist_ok=True)
        given = Installed(python, versions, folders)
        monkeypatch.setattr(factory, "installed", lambda *_: given)
        monkeypatch.setattr(factory, "CACHED", tmp_path / "cache")
        return Options("auto", tmp_path / "logs", sys.executable, paths)

    return have


def assets(folder: Path) -> Path:
    for name in SOME_ASSETS:
        (folder / name).mkdir(parents=True)
    return folder


def test_without_libero_the_commands_that_install_it_are_named(having):
    with pytest.raises(ConfigError) as refused:
        create(having({"robosuite": "1.4.0"}))
    assert "has no libero" in str(refused.value)
    assert "pip install --no-deps hf-libero==0.1.4 robosuite==1.4.0 bddl==1.0.1" in str(
        refused.value
    )
    assert "safemanip_python" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_interpreter_that_is_not_there_is_refused_with_the_commands_that_make_one(tmp_path):
    python = str(tmp_path / "python")
    with pytest.raises(ConfigError, match="no such interpreter; make an interpreter for it with"):
        create(Options("official", tmp_path, python, {}))


def test_a_newer_robosuite_is_refused(having):
    with pytest.raises(ConfigError, match=r"has robosuite 1.5.2, and LIBERO is written for 1.4"):
        create(having({**VERSIONS, "libero": "", "robosuite": "1.5.2"}))


def test_an_older_python_is_refused(having):
    with pytest.raises(ConfigError, match=r"is Python 3.8, expected 3.11 or newer"):
        create(having({**VERSIONS, "libero": ""}, python=(3, 8)))


def test_without_assets_the_command_that_downloads_them_and_their_size_are_named(having):
    with pytest.raises(ConfigError) as refused:
        create(having({**VERSIONS, "libero": ""}))
    assert "download them (0.4 GB) with" in str(refused.value)
    assert "snapshot_download('lerobot/libero-assets'" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_assets_are_taken_from_the_folder_that_is_named(having, tmp_path):
    options = having({**VERSIONS, "libero": ""}, assets=assets(tmp_path / "mine"))
    backend = create(options)
    assert str(tmp_path / "mine") in backend.provenance.description
    assert backend.provenance.assets == "official"
    assert backend.provenance.versions["robosuite"] == "1.4.0"


def test_assets_are_known_by_what_they_are(having, tmp_path):
    first, second = assets(tmp_path / "a"), assets(tmp_path / "b")
    (second / "scenes" / "x.xml").write_text("<mujoco/>")
    keys = {
        create(having({**VERSIONS, "libero": ""}, assets=folder)).provenance.hashes["assets"]
        for folder in (first, second)
    }
    assert len(keys) == 2


def test_a_path_that_the_backend_does_not_know_is_refused(having, tmp_path):
    with pytest.raises(ConfigError, match=r"unknown path 'libero.asets'; did you mean 'assets'"):
        create(having({**VERSIONS, "libero": ""}, asets=tmp_path))


def test_a_folder_without_suites_is_refused(having, tmp_path):
    options = having({**VERSIONS, "libero": ""}, suites=tmp_path)
    with pytest.raises(ConfigError, match=r"no bddl_files/SUITE/TASK.bddl in"):
        create.derived_tasks(options)
