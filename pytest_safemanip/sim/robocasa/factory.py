"""Making the RoboCasa365 backend: what it needs is checked here, it runs in a child process."""

from __future__ import annotations

import hashlib
import importlib.util
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_safemanip.sim.backend import Options, Provenance
from pytest_safemanip.sim.process import ProcessBackend
from pytest_safemanip.sim.provenance import source_digest, versions
from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets

if TYPE_CHECKING:
    from pytest_safemanip.sim.robocasa.backend import RoboCasaBackend

_PACKAGES = ("numpy", "mujoco", "robosuite", "rlinf-robocasa365", "robocasa")


def create(options: Options) -> ProcessBackend:
    """The backend of the test process; no simulator is imported before its first reset.

    Raises:
        ConfigError: if RoboCasa is not installed or its assets cannot be had.
    """
    assets = prepare_assets(loading.package_assets(), options.assets)
    provenance = Provenance(
        backend="robocasa",
        assets=assets.kind,
        versions={k: v for k, v in versions(_PACKAGES).items() if v != "unknown"},
        hashes={
            "backend": source_digest("sim", "trace", "rollout.py"),
            "simulator": _installed_digest("robocasa", "robosuite"),
            "assets": assets.key,
        },
        description=assets.describe(),
    )
    arguments = {
        "assets_root": str(assets.root),
        "kind": assets.kind,
        "versions": dict(provenance.versions),
        "hashes": dict(provenance.hashes),
        "gl": os.environ.get("MUJOCO_GL", ""),
    }
    return ProcessBackend(f"{__name__}:local", arguments, provenance, options.logs)


def local(
    assets_root: str, kind: str, versions: Mapping[str, str], hashes: Mapping[str, str], gl: str
) -> RoboCasaBackend:
    """The backend itself, in the process that steps it."""
    from pytest_safemanip.sim.robocasa.backend import RoboCasaBackend

    return RoboCasaBackend(Path(assets_root), Provenance("robocasa", kind, versions, hashes), gl)


def _installed_digest(*packages: str) -> str:
    """Digest of the installed code: a checkout has no version that tells its states apart."""
    digest = hashlib.sha256()
    for package in packages:
        spec = importlib.util.find_spec(package)
        for place in (spec.submodule_search_locations or ()) if spec else ():
            for file in sorted(Path(place).rglob("*.py")):
                digest.update(file.relative_to(place).as_posix().encode() + b"\0")
                digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
