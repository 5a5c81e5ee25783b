"""Ctrl-C: the first ends the run within two seconds, the second at once."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType, TracebackType

import pytest

from pytest_safemanip.plugin.simulation import Simulation
from pytest_safemanip.run.session import SafetySession

STATUS = int(pytest.ExitCode.INTERRUPTED)


class Interrupts:
    """Listens for Ctrl-C in the main process.

    Args:
        config: pytest's; listening ends with it.
        rollouts: are left when the run is interrupted.
        simulation: ends its simulators then.
    """

    def __init__(
        self, config: pytest.Config, rollouts: SafetySession, simulation: Simulation
    ) -> None:
        self._config, self._rollouts, self._simulation = config, rollouts, simulation
        self._pressed = False

    def listen(self) -> None:
        """Listen, unless somebody else does, or this process was started deaf to it."""
        here = threading.current_thread() is threading.main_thread()
        if here and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._hear)
            self._config.add_cleanup(self._stop)

    @pytest.hookimpl(tryfirst=True)
    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """End the simulators before anything else: they would take seconds to end by themselves."""
        if excinfo.type is KeyboardInterrupt:
            self._rollouts.leave()
            self._simulation.kill()
            _forget_what_has_no_line(excinfo.tb)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        __tracebackhide__ = True  # pytest names the line that was interrupted
        if not self._pressed:
            self._pressed = True
            raise KeyboardInterrupt
        # Whatever is under way, its traceback says nothing. Simulators end with their parent.
        os.write(2, b"\nsafemanip: interrupted again, ended at once; recordings are kept\n")
        os._exit(STATUS)

    def _stop(self) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _forget_what_has_no_line(entry: TracebackType) -> None:
    """Leave out the later entries of a traceback that were interrupted where CPython knows of no
    line (PEP 626), at the end of a ``with`` block for instance: pytest does not print those.
    """
    while (later := entry.tb_next) is not None:
        line: int | None = later.tb_lineno
        if line is None:
            entry.tb_next = later.tb_next
        else:
            entry = later
