"""Makes the RoboCasa365 backend in a child process, after checking its requirements."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_safemanip.provenance import installed_digest, source_digest, versions
from pytest_safemanip.sim.backend import (
    FixtureRole,
    Options,
    Provenance,
    Simulator,
    TaskDescription,
)
from pytest_safemanip.sim.process import OWN_CODE, ProcessBackend
from pytest_safemanip.sim.robocasa import downloads, fixture_parts, loading, task_source
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.robot import SPEC

if TYPE_CHECKING:
    from pytest_safemanip.sim.robocasa.backend import RoboCasaBackend

_PACKAGES = ("numpy", "mujoco", "robosuite", "rlinf-robocasa365", "robocasa")


class RoboCasaFactory:
    """Makes the backend, and knows RoboCasa's tasks from its source."""

    def __call__(self, options: Options) -> ProcessBackend:
        """Make the backend of the test process; no simulator is imported before its first reset.

        Raises:
            ConfigError: if RoboCasa is not installed or its assets cannot be had.
        """
        assets = prepare_assets(loading.package_assets(), options.assets)
        provenance = Provenance(
            backend="robocasa",
            assets=assets.kind,
            versions={k: v for k, v in versions(_PACKAGES).items() if v != "unknown"},
            hashes={
                "backend": source_digest(*OWN_CODE),
                "simulator": installed_digest("robocasa", "robosuite"),
                "assets": assets.key,
            },
            description=assets.describe(),
            download=f"{downloads.COMMAND} ({downloads.SIZE})",
        )
        arguments = {
            "assets_root": str(assets.root),
            "kind": assets.kind,
            "versions": dict(provenance.versions),
            "hashes": dict(provenance.hashes),
            "gl": os.environ.get("MUJOCO_GL", ""),
        }
        return ProcessBackend(f"{__name__}:local", arguments, SPEC, provenance, options.logs)

    def task_names(self) -> frozenset[str]:
        """See :class:`~pytest_safemanip.sim.backend.DescribesTasks`; empty without RoboCasa."""
        folder = task_source.environments()
        return task_source.task_names(folder) if folder else frozenset()

    def describe_task(self, task: str) -> TaskDescription:
        """See :class:`~pytest_safemanip.sim.backend.DescribesTasks`."""
        folder = task_source.environments()
        roles = task_source.fixture_roles(folder, task) if folder else {}
        return TaskDescription(
            fixtures={
                role: FixtureRole(
                    tuple(sorted(kind.lower() for kind in kinds or ())),
                    fixture_parts.parts_of(kinds),
                )
                for role, kinds in roles.items()
            },
            object_parts=fixture_parts.OBJECT,
            any_part=fixture_parts.ANY,
            objects=task_source.object_roles(folder, task) if folder else None,
            other_fixtures=task_source.attributes(folder, task) if folder else frozenset(),
        )

    def object_kinds(self) -> frozenset[str]:
        """See :class:`~pytest_safemanip.sim.backend.DrawsObjects`; empty without RoboCasa."""
        table = task_source.categories()
        return task_source.object_kinds(table) if table else frozenset()


create = RoboCasaFactory()
SIMULATOR = Simulator(SPEC, create)


def local(
    assets_root: str, kind: str, versions: Mapping[str, str], hashes: Mapping[str, str], gl: str
) -> RoboCasaBackend:
    """The backend itself, in the process that steps it."""
    from pytest_safemanip.sim.robocasa.backend import RoboCasaBackend

    return RoboCasaBackend(Path(assets_root), Provenance("robocasa", kind, versions, hashes), gl)
