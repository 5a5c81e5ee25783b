"""Rollouts as tasks of a Ray cluster: each has a simulator and a policy of its own there.

What is sent is how to make simulator and policy, and what is to be run; what comes back is the file
of the recording. A rollout whose worker is lost is run again on another, with the same seed.
"""

from __future__ import annotations

import platform
import socket
import tempfile
import threading
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import (
    ConfigError,
    RolloutError,
    SafemanipError,
    SimulatorFailed,
    first_line,
    install_command,
    printable,
)
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.rollouts import loop, retry
from pytest_safemanip.sim.backend import Backend, Options, Provenance, Simulator
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

PERIOD = 0.25
"""Seconds between two looks at whether the run has ended."""
PER_SLOT = 2
"""Rollouts under way for each request that a policy's servers take at a time: while one waits for
its answer, another is in its simulator."""
REACH = 10.0
"""Seconds until a cluster's address has to answer."""
LOST = 3
"""How often a rollout is begun again whose worker is lost."""
CPU: Mapping[str, float] = {"num_cpus": 1.0}


@dataclass(frozen=True)
class Recipe:
    """How a worker makes what it runs rollouts with; is pickled, by Ray.

    Attributes:
        simulator: finds the simulator.
        policy: finds a policy by its name.
        options: what the simulator is made with; its logs stay on the worker.
        source: of the simulator of the process that asks; a worker's has to be the same.
        run_id: identifies the test run: what a worker has made is of use to this one alone.
    """

    simulator: Callable[[], Simulator]
    policy: Callable[[str], PolicySpec]
    options: Options
    source: Provenance
    run_id: str


class RayCluster:
    """Runs rollouts on a Ray cluster. Threads may ask side by side.

    Args:
        address: ``auto`` for the cluster that this machine is part of, ``local`` for one on this
            machine alone, or an address.
        recipe: what workers make.
        resources: that a rollout takes: ``num_cpus``, ``num_gpus``, ``memory`` (bytes), and names
            of the cluster's own.

    Raises:
        ConfigError: if Ray is not installed, or there is no cluster with these resources.
    """

    def __init__(self, address: str, recipe: Recipe, resources: Mapping[str, float] = CPU) -> None:
        self._ray = ray = _ray()
        self._ours = not ray.is_initialized()
        if self._ours:
            try:
                _check_listens(address)
                ray.init(
                    address=address, log_to_driver=False, configure_logging=False, **_quiet(address)
                )
            except Exception as error:
                remedy = (
                    "Ray could not begin one here: run it again, or use --safemanip-jobs"
                    if address == "local"
                    else "start one with 'ray start --head', or use --safemanip-ray=local"
                )
                raise ConfigError(
                    f"--safemanip-ray: no cluster at {address!r} ({first_line(error)}); {remedy}"
                ) from error
        self.slots = _slots(ray.cluster_resources(), resources)
        """Rollouts that the cluster has room for at a time."""
        named = {k: resources[k] for k in ("num_cpus", "num_gpus", "memory") if k in resources}
        own = {k: v for k, v in resources.items() if k not in named}
        self._task = ray.remote(_run).options(
            **named, resources=own, max_retries=LOST, retry_exceptions=False
        )
        try:
            self._recipe = ray.put(recipe)
        except Exception as error:
            raise ConfigError(
                "--safemanip-ray: a policy or backend of a hook cannot be sent to workers "
                f"({first_line(error)}); let the hook give it as text, 'MODULE:ATTRIBUTE'"
            ) from error
        self._room: dict[str, threading.Semaphore] = {}
        self._making = threading.Lock()

    def run(self, job: loop.Job, policy: PolicySpec, show: loop.OnStep) -> Recording:
        """Run a rollout on some worker.

        Args:
            job: what to run.
            policy: of it; its servers' capacity bounds how many are under way.
            show: called again and again; may raise to leave the rollout.

        Raises:
            RolloutError: if it does not complete.
            ConfigError: if workers are not like this machine.
        """
        with self._room_for(policy):
            task = self._task.remote(self._recipe, job)
            try:
                while not self._ray.wait([task], timeout=PERIOD)[0]:
                    show(0, 0)
                found = self._ray.get(task)
            except self._ray.exceptions.RayTaskError as error:
                cause = printable(first_line(error.cause or error))
                raise ConfigError(
                    f"--safemanip-ray: a worker cannot make what it is to run ({cause}); {_REMEDY}"
                ) from error
            except self._ray.exceptions.RayError as error:
                raise SimulatorFailed(
                    f"the cluster lost this rollout, for the {LOST + 1}th time: "
                    f"{printable(first_line(error))}"
                ) from error
            except BaseException:
                self._ray.cancel(task, force=True)
                raise
        if isinstance(found, SafemanipError):
            raise found
        return files.from_bytes(found)

    def close(self) -> None:
        """Leave the cluster; end it if it was begun for this run."""
        if self._ours:
            self._ray.shutdown()

    def _room_for(self, policy: PolicySpec) -> threading.Semaphore:
        with self._making:
            room = policy.slots * PER_SLOT or self.slots
            return self._room.setdefault(policy.name, threading.BoundedSemaphore(room))


class _Worker:
    """What a worker process keeps from one rollout to the next."""

    def __init__(self, recipe: Recipe) -> None:
        logs = Path(tempfile.gettempdir()) / "pytest-safemanip-logs"
        self.recipe = recipe
        options = replace(recipe.options, logs=logs)
        self._backend: Backend = recipe.simulator().create(options)
        self._policies: dict[str, PolicySpec] = {}
        _check_alike(self._backend.provenance, recipe.source)

    def close(self) -> None:
        """End the simulator."""
        self._backend.close()

    def run(self, job: loop.Job) -> Recording:
        """Run a rollout."""
        if job.policy not in self._policies:
            self._policies[job.policy] = self.recipe.policy(job.policy)
        policy = self._policies[job.policy]
        if (policy.fingerprint_in(job.request.task, job.sets) or "") != job.hashes["policy"]:
            raise ConfigError(f"policy {job.policy!r} is another one {_here()}; {_REMEDY}")
        return retry.run(job, self._backend, policy, lambda *_: None)


_REMEDY = (
    "give all machines the same environment and folder, as "
    "'ray job submit --working-dir . -- pytest ...' does"
)
_worker: _Worker | None = None


def _run(recipe: Recipe, job: loop.Job) -> bytes | SafemanipError:
    """Run a rollout in this process, which is a worker's.

    Returns:
        The file of the recording, or why there is none.
    """
    global _worker  # noqa: PLW0603  (a worker process runs many tasks, of one driver)
    try:
        if _worker is None or _worker.recipe.run_id != recipe.run_id:
            if _worker is not None:
                _worker.close()
            _worker = _Worker(recipe)
        return files.to_bytes(_worker.run(job))
    except SafemanipError as error:
        return _told(error, error.__cause__)
    except Exception as error:
        return _told(RolloutError(f"{type(error).__name__}: {error}"), error)


def _told(error: SafemanipError, cause: BaseException | None) -> SafemanipError:
    """An error with what cannot be pickled of it as text."""
    told = type(error)(f"{error} ({_here()})")
    vars(told).update(vars(error))
    if cause is not None:
        told.add_note("".join(traceback.format_exception(cause)))
    return told


def _check_alike(there: Provenance, asked: Provenance) -> None:
    """A recording has to be what its key says, wherever it is made.

    Raises:
        ConfigError: naming what differs.
    """
    for name in ("backend", "assets", "versions", "hashes"):
        own, expected = getattr(there, name), getattr(asked, name)
        if own != expected:
            raise ConfigError(
                f"the simulator's {name} are {own} {_here()}, and {expected} where pytest runs; "
                f"{_REMEDY}"
            )


def _here() -> str:
    return f"on {platform.node()}"


def _slots(there: Mapping[str, float], wanted: Mapping[str, float]) -> int:
    """How many rollouts fit into a cluster."""
    names = {"num_cpus": "CPU", "num_gpus": "GPU"}
    rooms = [there.get(names.get(k, k), 0.0) / v for k, v in wanted.items() if v > 0.0]
    slots = int(min(rooms, default=1.0))
    if slots < 1:
        found = {k: v for k, v in there.items() if not k.startswith(("node:", "object_store"))}
        raise ConfigError(
            f"--safemanip-ray: the cluster has {found}, and a rollout takes {dict(wanted)}; "
            "change safemanip_ray_resources in the ini file"
        )
    return slots


def _check_listens(address: str) -> None:
    """Ray looks for a quarter of an hour for a cluster that is not there.

    Raises:
        OSError: if nothing listens at an address with a port.
    """
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon and port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), timeout=REACH).close()


def _quiet(address: str) -> dict[str, Any]:
    """Options of a cluster that is begun for this run."""
    return {"include_dashboard": False} if address == "local" else {}


def _ray() -> Any:
    try:
        import ray
    except ModuleNotFoundError:
        raise ConfigError(f"--safemanip-ray needs Ray: {install_command('ray')}") from None
    return ray
