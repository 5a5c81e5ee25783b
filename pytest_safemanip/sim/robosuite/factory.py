"""Makes the robosuite backend in a child process, after checking its requirements."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
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
from pytest_safemanip.sim.robosuite import environment
from pytest_safemanip.sim.robosuite.robots import declare, parse_robots
from pytest_safemanip.sim.robosuite.tasks import TASKS

if TYPE_CHECKING:
    from pytest_safemanip.sim.robosuite.backend import RobosuiteBackend

_PACKAGES = ("numpy", "mujoco", "robosuite")
_BODY = frozenset({"body"})
_PARTS = {"Door": frozenset({"body", "door", "handle"})}
"""Parts of the fixtures that have more than one."""


class RobosuiteFactory:
    """Makes the backend, and knows robosuite's tasks.

    Args:
        robots: the robots that are chosen.
    """

    def __init__(self, robots: tuple[str, ...]) -> None:
        self._robots = robots

    def __call__(self, options: Options) -> ProcessBackend:
        """Make the backend of the test process; robosuite is imported at the first reset.

        Its assets are in its package: nothing stands in for them, whatever is asked for.

        Raises:
            ConfigError: if robosuite is not installed.
        """
        environment.check_installed()
        provenance = Provenance(
            backend="robosuite",
            assets="official",
            versions=versions(_PACKAGES),
            hashes={
                "backend": source_digest(*OWN_CODE),
                "simulator": installed_digest("robosuite"),
                "robot": "+".join(self._robots),
            },
            description=f"robot {'+'.join(self._robots)}, assets of its package",
        )
        arguments = {
            "robots": list(self._robots),
            "versions": dict(provenance.versions),
            "hashes": dict(provenance.hashes),
            "gl": os.environ.get("MUJOCO_GL", ""),
        }
        spec = declare(self._robots)
        return ProcessBackend(f"{__name__}:local", arguments, spec, provenance, options.logs)

    def task_names(self) -> frozenset[str]:
        """See :class:`~pytest_safemanip.sim.backend.DescribesTasks`."""
        return frozenset(TASKS)

    def describe_task(self, task: str) -> TaskDescription:
        """See :class:`~pytest_safemanip.sim.backend.DescribesTasks`."""
        return TaskDescription(
            fixtures={
                name: FixtureRole((name.rstrip("12").lower(),), _PARTS.get(name, _BODY))
                for name in TASKS[task].fixtures
            },
            object_parts=_BODY,
            any_part=_BODY,
            stages=False,
        )


def simulator(variant: str) -> Simulator:
    """Robosuite with the robots that a user names; see
    :func:`~pytest_safemanip.sim.robosuite.robots.parse_robots`.
    """
    robots = parse_robots(variant)
    return Simulator(declare(robots), RobosuiteFactory(robots))


def local(
    robots: Sequence[str], versions: Mapping[str, str], hashes: Mapping[str, str], gl: str
) -> RobosuiteBackend:
    """The backend itself, in the process that steps it."""
    from pytest_safemanip.sim.robosuite.backend import RobosuiteBackend

    return RobosuiteBackend(robots, Provenance("robosuite", "official", versions, hashes), gl)
