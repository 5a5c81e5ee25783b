"""Simulators in another interpreter than that of pytest."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.option_values import parse_backend_paths, parse_pythons
from pytest_safemanip.sim import process
from pytest_safemanip.sim.backend import Provenance, Request
from pytest_safemanip.sim.interpreter import IMPORTABLE, installed
from tests import toy

LISTS = (
    "import json, sys, numpy, mujoco; before = set(sys.modules); "
    f"{IMPORTABLE}; import pytest_safemanip.sim.host, pytest_safemanip.sim.libero.backend; "
    "print(json.dumps(sorted({name.partition('.')[0] for name in set(sys.modules) - before} "
    "- set(sys.stdlib_module_names))))"
)


@pytest.fixture(scope="session")
def bare(tmp_path_factory) -> str:
    """An interpreter with nothing installed."""
    folder = tmp_path_factory.mktemp("bare")
    venv.EnvBuilder(symlinks=True).create(folder)
    return str(folder / "bin" / "python")


def test_the_simulators_process_needs_numpy_and_mujoco_and_nothing_else_of_what_we_need():
    said = subprocess.run(
        [sys.executable, "-P", "-c", LISTS], capture_output=True, text=True, check=True
    )
    # isal is used where it is.
    assert set(json.loads(said.stdout)) <= {"pytest_safemanip", "numpy", "mujoco", "isal"}


def test_another_interpreter_finds_this_package_and_nothing_that_is_installed_beside_it(bare):
    code = (
        f"{IMPORTABLE}; import pytest_safemanip.errors, pytest_safemanip.provenance; import numpy"
    )
    said = subprocess.run([bare, "-P", "-c", code], capture_output=True, text=True, check=False)
    assert "No module named 'numpy'" in said.stderr


def test_a_backend_runs_in_the_interpreter_that_is_named(bare, tmp_path):
    backend = process.ProcessBackend(
        "platform:no_such_backend", {}, toy.SPEC, Provenance("toy", "none"), tmp_path, bare
    )
    with pytest.raises(
        ConfigError, match=r"(?s)simulator process died at start-up.*No module named 'numpy'"
    ):
        backend.reset(Request("x", 0, "compact"))


def test_what_pytests_python_is_told_about_paths_is_not_told_to_another(
    bare, tmp_path, monkeypatch
):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    assert installed(bare, (), ("numpy",)).folders == {}


def test_an_interpreter_says_what_it_has_without_importing_it():
    found = installed(sys.executable, ("numpy", "no-such-thing"), ("numpy", "no_such_thing"))
    assert found.python == sys.version_info[:2]
    assert found.versions["numpy"]
    assert found.versions["no-such-thing"] == ""
    assert list(found.folders) == ["numpy"]


def test_an_interpreter_that_is_none_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"safemanip_python: .*missing: no such interpreter"):
        installed(str(tmp_path / "missing"), (), ())
    with pytest.raises(ConfigError, match=r"cannot be run, or is older than Python 3\.11"):
        installed("/bin/true", (), ())


def test_paths_in_the_ini_file_are_relative_to_it(tmp_path):
    assert parse_pythons(["libero = venv/bin/python"], tmp_path) == {
        "libero": str(tmp_path / "venv/bin/python")
    }
    assert parse_backend_paths(["libero.assets = /a", "libero.suites = ~/s"], tmp_path) == {
        "libero": {"assets": Path("/a"), "suites": Path("~/s").expanduser()}
    }


@pytest.mark.parametrize("line", ["libero", "= python", "libero ="])
def test_a_line_that_names_no_interpreter_is_refused(line, tmp_path):
    with pytest.raises(ConfigError, match="safemanip_python: expected BACKEND = PATH"):
        parse_pythons([line], tmp_path)


@pytest.mark.parametrize("line", ["libero = x", "libero. = x", "libero.assets ="])
def test_a_line_that_names_no_folder_is_refused(line, tmp_path):
    with pytest.raises(ConfigError, match=r"safemanip_backend_paths: expected BACKEND\.NAME"):
        parse_backend_paths([line], tmp_path)
