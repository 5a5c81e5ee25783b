"""A backend in a process of its own.

A segmentation fault, a deadlock or a killed simulator ends one rollout, not the test run; and what
simulators do to the environment, the screen and the standard streams stays over there.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import (
    CannotStage,
    ConfigError,
    RolloutError,
    SimulatorFailed,
    TaskError,
)
from pytest_safemanip.sim import clearance, codec, pushing, wire
from pytest_safemanip.sim.backend import BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.interpreter import IMPORTABLE, clean_environment
from pytest_safemanip.sim.rehearsal import Trials
from pytest_safemanip.trace.steps import Step

OWN_CODE = ("sim", "trace", "rollouts/disturbances", "rollouts/loop.py", "policies/adapter.py")
"""Of this package, what decides the content of recordings: all backends' digests are of it."""
START_DEADLINE = 120.0
RESET_DEADLINE = 600.0
"""Seconds for a reset: failed placements rebuild the whole scene, up to 50 times."""
STEP_DEADLINE = 60.0
OBSERVE_DEADLINE = 120.0
"""Seconds for an observation: the first one uploads the scene and compiles shaders."""
CLEARANCE_DEADLINE = 60.0
CLOSE_DEADLINE = 5.0

_RUN = (
    "import json, sys; job = json.loads(sys.argv[1]); sys.path[:] = job.get('path', sys.path); "
    "from pytest_safemanip.sim.host import main; main(job['factory'], job['arguments'])"
)
_ENVIRONMENT = {
    # Simulated bits must not depend on the number of threads or on the hash seed.
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
}
_UNSET = ("MUJOCO_GL", "PYOPENGL_PLATFORM")
"""With a GL backend named that is not installed, ``import mujoco`` fails, drawing or not."""
_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM)
"""Signals that no simulator gets from its own faults: the kernel, short of memory, or somebody."""


_RAISED = {"config": ConfigError, "task": TaskError, "staging": CannotStage}
"""Errors of the child that this process raises as they are, by their names in a message."""


class _Killed(SimulatorFailed):
    """Somebody ended the simulator's process."""


class ProcessBackend:
    """Runs a backend in a child process, which is started on first use and after it died.

    Args:
        factory: ``module:function`` that makes the backend in the child.
        arguments: its keyword arguments, plain values.
        spec: what it declares.
        provenance: what decides the content of the recordings.
        logs: folder for what the child prints.
        python: interpreter of the child; empty for this one. Another one finds this package, and
            otherwise what is installed there.
    """

    def __init__(
        self,
        factory: str,
        arguments: Mapping[str, Any],
        spec: BackendSpec,
        provenance: Provenance,
        logs: Path,
        python: str = "",
    ) -> None:
        self._job = {"factory": factory, "arguments": dict(arguments)}
        self._python = python
        self._spec = spec
        self._provenance = provenance
        self._logs = logs
        self._process: subprocess.Popen[bytes] | None = None
        self._log: Path | None = None
        self._steps = 0
        self._asked = self._unwanted = self._named = False
        self._aside: list[int] = []
        self._pushes: list[list[Any]] = []
        self._trials = Trials(self._simulate, self._put_aside, self._go_back)

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._spec

    @property
    def provenance(self) -> Provenance:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._provenance

    @property
    def pid(self) -> int | None:
        """Process id of the child while it runs."""
        return self._process.pid if self._process else None

    def reset(self, request: Request) -> Start:
        """See :class:`~pytest_safemanip.sim.backend.Backend`.

        Raises:
            ConfigError: if the child cannot set up what is asked for.
            TaskError: if the episode cannot begin as its task asks.
            RolloutError: if the child fails, dies or does not answer in time.
        """
        if self._process is not None and self._process.poll() is not None:
            self.close()  # it died between two rollouts and harmed none
        if self._process is None:
            self._start()
        self._trials.forget()
        self._steps, self._pushes = 0, []
        message = wire.Message({"op": "reset", "request": codec.encode_request(request)})
        return codec.decode_start(self._call(message, RESET_DEADLINE, "reset"))

    def step(self, action: NDArray[np.float64]) -> Step:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        if self._process is None:
            raise RolloutError("step before reset")
        return self._trials.step(np.asarray(action, np.float64))

    def begin_trial(self) -> None:
        """See :class:`~pytest_safemanip.sim.rehearsal.Rehearses`."""
        if self._process is None:
            raise RolloutError("a trial before reset")
        self._trials.begin()

    def undo_trial(self) -> None:
        """See :class:`~pytest_safemanip.sim.rehearsal.Rehearses`."""
        self._trials.undo()

    def keep_trial(self) -> None:
        """See :class:`~pytest_safemanip.sim.rehearsal.Rehearses`."""
        self._trials.keep()

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        if self._process is None:
            raise RolloutError("observe before reset")
        self._trials.catch_up()
        doing = f"the observation of step {self._steps}"
        message = wire.Message({"op": "observe"})
        return codec.decode_observation(self._call(message, OBSERVE_DEADLINE, doing))

    def clearance(self, paths: Sequence[clearance.Path]) -> list[clearance.Clearance]:
        """See :class:`~pytest_safemanip.sim.clearance.Foresees`."""
        if self._process is None:
            raise RolloutError("clearance before reset")
        self._trials.catch_up()
        plain, arrays = clearance.encode_paths(paths)
        message = wire.Message({"op": "clearance", "paths": plain}, arrays)
        doing = f"the clearance of step {self._steps}"
        answer = self._call(message, CLEARANCE_DEADLINE, doing)
        return clearance.decode_clearances(answer.values["answers"], answer.arrays)

    def push(self, entity: str, force: NDArray[np.float64]) -> None:
        """See :class:`~pytest_safemanip.sim.pushing.Pushes`; what was rehearsed of the next step
        was without it, and is forgotten.
        """
        if self._process is None:
            raise RolloutError("push before reset")
        self._trials.catch_up()
        self._pushes.append([entity, *pushing.checked(force).tolist()])

    def close(self) -> None:
        """End the child: by closing its input, then by force; at once if it is being waited for, as
        by a thread, or before an interruption: nobody wants the answer any more.
        """
        process, self._process = self._process, None
        if process is None:
            return
        left, self._asked = self._asked, False
        if left:
            process.kill()
        with contextlib.suppress(OSError):
            _pipe(process.stdin).close()
        try:
            process.wait(timeout=CLOSE_DEADLINE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        _pipe(process.stdout).close()
        if self._log is not None and (process.returncode == 0 or left) and not self._named:
            self._log.unlink(missing_ok=True)

    def kill(self) -> None:
        """End the child by force, whatever another thread waits for; to be closed nevertheless."""
        process = self._process
        if process is not None:
            self._asked = self._unwanted = True
            process.kill()

    def _simulate(self, action: NDArray[np.float64]) -> Step:
        self._steps += 1
        pushes, self._pushes = self._pushes, []
        message = wire.Message({"op": "step", "pushes": pushes}, {"action": action})
        return codec.decode_step(self._call(message, STEP_DEADLINE, f"step {self._steps}"))

    def _put_aside(self) -> None:
        message = wire.Message({"op": "put aside"})
        self._call(message, STEP_DEADLINE, f"a trial after step {self._steps}")
        self._aside.append(self._steps)

    def _go_back(self, depth: int) -> None:
        message = wire.Message({"op": "go back", "levels": len(self._aside) - depth})
        self._call(message, STEP_DEADLINE, f"the end of a trial after step {self._steps}")
        self._steps = self._aside[depth]
        del self._aside[depth:]

    def _start(self) -> None:
        self._aside = []
        self._trials = Trials(self._simulate, self._put_aside, self._go_back)
        self._logs.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix="simulator-", suffix=".log", dir=self._logs)
        self._log, self._named = Path(name), False
        environment = {k: v for k, v in os.environ.items() if k not in _UNSET} | _ENVIRONMENT
        if self._python:
            environment = clean_environment(environment)
            command = [self._python, "-P", "-c", f"{IMPORTABLE}; {_RUN}", json.dumps(self._job)]
        else:
            job = json.dumps({**self._job, "path": sys.path})
            command = [sys.executable, "-P", "-c", _RUN, job]
        with os.fdopen(handle, "wb") as log:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=environment,
            )
        try:
            self._receive(START_DEADLINE, "start-up")
        except _Killed:
            raise
        except RolloutError as error:
            # What is wrong now is wrong for every rollout.
            self.close()
            raise ConfigError(str(error)) from None
        except ConfigError:
            self.close()
            raise

    def _call(self, message: wire.Message, deadline: float, doing: str) -> wire.Message:
        try:
            wire.send(_pipe(self._running().stdin), message)
        except wire.WireError:
            raise self._died(doing) from None
        return self._receive(deadline, doing)

    def _receive(self, deadline: float, doing: str) -> wire.Message:
        process = self._running()
        self._asked = True
        stream = _pipe(process.stdout)
        ready, _, _ = select.select([stream], [], [], deadline)
        if not ready:
            process.kill()
            self._died(doing)
            raise SimulatorFailed(
                f"the simulator did not answer within {deadline:g} s at {doing}{self._tail()}"
            )
        try:
            reply = wire.receive(stream)
        except wire.WireError:
            raise self._died(doing) from None
        self._asked = False
        if "error" in reply.values:
            text = str(reply.values["error"])
            if kind := _RAISED.get(reply.values.get("kind", "")):
                raise kind(text)
            self._named = True
            raise SimulatorFailed(f"the simulator failed at {doing}: {text}; log: {self._log}")
        return reply

    def _died(self, doing: str) -> SimulatorFailed:
        """Clean up after a dead child and say how it died."""
        process, self._process = self._running(), None
        process.kill()
        code = process.wait()
        for stream in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                _pipe(stream).close()
        if self._unwanted and self._log is not None:
            self._log.unlink(missing_ok=True)
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        kind = _Killed if -code in _FROM_OUTSIDE else SimulatorFailed
        return kind(f"the simulator process died at {doing} ({how}){self._tail()}")

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            raise RolloutError("the simulator process is not running")
        return self._process

    def _tail(self) -> str:
        if self._log is None or self._unwanted:
            return ""
        lines = self._log.read_text(errors="replace").strip().splitlines()[-5:]
        ending = "; its last words:\n  " + "\n  ".join(lines) if lines else ""
        return f"; log: {self._log}{ending}"


def _pipe(stream: IO[bytes] | None) -> IO[bytes]:
    if stream is None:
        raise RuntimeError("the child was started without pipes")
    return stream
