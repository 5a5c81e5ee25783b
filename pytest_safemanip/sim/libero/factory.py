"""Makes LIBERO's backend in a process of its own interpreter, after checking what it needs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.provenance import files_digest, source_digest
from pytest_safemanip.sim.backend import DerivedTask, Options, Provenance, Simulator
from pytest_safemanip.sim.interpreter import OLDEST, Installed, installed
from pytest_safemanip.sim.libero.bddl import load_problem
from pytest_safemanip.sim.libero.binding import derive
from pytest_safemanip.sim.libero.robot import SPEC
from pytest_safemanip.sim.libero.suites import TaskFiles, find_tasks
from pytest_safemanip.sim.process import ProcessBackend

if TYPE_CHECKING:
    from pytest_safemanip.sim.libero.backend import LiberoBackend

DISTRIBUTIONS = ("numpy", "mujoco", "robosuite", "hf-libero", "libero")
PATHS = ("assets", "suites")
"""Names of the folders that ``safemanip_backend_paths`` may give."""
SOME_ASSETS = ("articulated_objects", "scenes", "stable_scanned_objects")
"""Folders that any of LIBERO's scenes reads."""
MAKE = (
    "python3.11 -m venv libero-venv; libero-venv/bin/pip install --no-deps hf-libero==0.1.4 "
    "robosuite==1.4.0 bddl==1.0.1; libero-venv/bin/pip install 'mujoco>=3.3,<3.9' 'numpy<2' numba "
    "scipy easydict pyyaml Pillow opencv-python-headless termcolor future networkx gymnasium "
    "cloudpickle matplotlib huggingface_hub"
)
"""The commands that make an interpreter with LIBERO: its packages as far as its environments need
them, without torch."""
SIZE = "0.4 GB"
CACHED = Path("~/.cache/libero/assets")
"""Where hf-libero itself keeps its assets."""


class LiberoFactory:
    """Makes the backend, and derives LIBERO's tasks from its BDDL files."""

    def __call__(self, options: Options) -> ProcessBackend:
        """Make the backend of the test process; nothing is imported before its first reset.

        Raises:
            ConfigError: if LIBERO, its robosuite or its assets are missing; says how to get them.
        """
        python, found = _interpreter(options)
        assets = _assets(options, python, found)
        provenance = Provenance(
            backend="libero",
            assets="official",
            versions={name: version for name, version in found.versions.items() if version},
            hashes={
                "backend": source_digest("sim", "trace", "rollouts/loop.py", "policies/adapter.py"),
                "simulator": files_digest(found.folders["libero"], found.folders["robosuite"]),
                "assets": files_digest(assets, suffixes=(".xml", ".msh", ".stl", ".obj")),
            },
            description=f"LIBERO's assets in {assets}",
        )
        arguments = {
            "assets": str(assets),
            "tasks": {n: files.to_plain() for n, files in _tasks(options, found).items()},
            "versions": dict(provenance.versions),
            "hashes": dict(provenance.hashes),
            "gl": os.environ.get("MUJOCO_GL", ""),
        }
        return ProcessBackend(
            f"{__name__}:local", arguments, SPEC, provenance, options.logs, python
        )

    def derived_tasks(self, options: Options) -> Mapping[str, DerivedTask]:
        """See :class:`~pytest_safemanip.sim.backend.DerivesTasks`."""
        _, found = _interpreter(options)
        return {
            name: DerivedTask(
                files.problem, json.dumps(derive(load_problem(files.problem), name, files.suite))
            )
            for name, files in _tasks(options, found).items()
        }


create = LiberoFactory()
SIMULATOR = Simulator(SPEC, create)


def local(
    assets: str,
    tasks: Mapping[str, Mapping[str, Any]],
    versions: Mapping[str, str],
    hashes: Mapping[str, str],
    gl: str,
) -> LiberoBackend:
    """The backend itself, in the process that steps it."""
    from pytest_safemanip.sim.libero.backend import LiberoBackend

    files = {name: TaskFiles.from_plain(values) for name, values in tasks.items()}
    return LiberoBackend(
        Path(assets), files, Provenance("libero", "official", versions, hashes), gl
    )


def _interpreter(options: Options) -> tuple[str, Installed]:
    """The interpreter that has LIBERO, and what it has."""
    for name in options.paths:
        if name not in PATHS:
            hint = did_you_mean(name, PATHS)
            raise ConfigError(f"safemanip_backend_paths: unknown path 'libero.{name}'; {hint}")
    python = options.python or sys.executable
    remedy = (
        f"make an interpreter for it with: {MAKE}; and name it in the ini file: safemanip_python = "
        "libero = libero-venv/bin/python"
    )
    try:
        found = installed(python, DISTRIBUTIONS, ("libero", "robosuite"))
    except ConfigError as error:
        raise ConfigError(f"backend 'libero': {error}; {remedy}") from error
    for package in ("libero", "robosuite"):
        if package not in found.folders:
            raise ConfigError(f"backend 'libero': {python} has no {package}; {remedy}")
    if not found.versions["robosuite"].startswith("1.4."):
        raise ConfigError(
            f"backend 'libero': {python} has robosuite {found.versions['robosuite']}, and LIBERO "
            f"is written for 1.4; {remedy}"
        )
    if found.python < OLDEST:
        raise ConfigError(
            f"backend 'libero': {python} is Python {found.python[0]}.{found.python[1]}, expected "
            f"{OLDEST[0]}.{OLDEST[1]} or newer; {remedy}"
        )
    return python, found


def _tasks(options: Options, found: Installed) -> dict[str, TaskFiles]:
    """LIBERO's own tasks, and those of the user's suites."""
    own = found.folders["libero"] / "libero"
    suites = options.paths.get("suites")
    added = find_tasks(suites) if suites else {}
    if suites and not added:
        raise ConfigError(
            f"safemanip_backend_paths: libero.suites: no bddl_files/SUITE/TASK.bddl in {suites}"
        )
    return {**find_tasks(own), **added}


def _assets(options: Options, python: str, found: Installed) -> Path:
    """The folder of LIBERO's assets; nothing is downloaded."""
    own = found.folders["libero"] / "libero" / "assets"
    given = options.paths.get("assets")
    places = [given] if given else [own, CACHED.expanduser()]
    for place in places:
        if all((place / name).is_dir() for name in SOME_ASSETS):
            return place
    raise ConfigError(
        f"backend 'libero': LIBERO's assets are not in {' or '.join(map(str, places))}; download "
        f'them ({SIZE}) with: {python} -c "from huggingface_hub import snapshot_download; '
        "snapshot_download('lerobot/libero-assets', repo_type='dataset', "
        f"local_dir='{given or CACHED.expanduser()}')\""
    )
