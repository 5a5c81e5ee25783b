"""What rollouts are run with in this process, shared by the suite and the fixture."""

from __future__ import annotations

import sys
import threading
from functools import cached_property

import pytest

from pytest_safemanip.errors import ConfigError, SafemanipError
from pytest_safemanip.plugin.extensions import read_extensions
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.plugin.run_id import run_id_of
from pytest_safemanip.report.failure import user_traceback
from pytest_safemanip.rollouts.shared_store import SharedStore
from pytest_safemanip.rollouts.store import Store, prepare_output
from pytest_safemanip.run.plan import Extensions
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.sim.backend import Backend
from pytest_safemanip.sim.process import ProcessBackend
from pytest_safemanip.sim.registry import find_simulator


class Simulation:
    """Settings, extensions, simulator and recordings; each is made when it is first asked for.

    Attributes:
        settings: what the user asked for.
        run_id: identifies the test run, the same in all of its processes.
    """

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self.settings: Settings = read_settings(config)
        self.run_id = run_id_of(config)
        self._made: list[Backend] = []
        self._making = threading.Lock()

    @cached_property
    def extensions(self) -> Extensions:
        """What the user's hooks add; the working directory can be imported from, as with
        ``python -m pytest``.
        """
        folder = str(self._config.invocation_params.dir)
        if folder not in sys.path:
            sys.path.append(folder)
        return read_extensions(self._config)

    @cached_property
    def backend(self) -> Backend:
        """The simulator.

        Raises:
            ConfigError: if it cannot be made.
        """
        return self.another_backend()

    @cached_property
    def own_backend(self) -> Backend:
        """The simulator of rollouts that tests ask for: none that runs rollouts ahead of cases.

        Raises:
            ConfigError: if it cannot be made.
        """
        return self.backend if self.settings.jobs == 1 else self.another_backend()

    def another_backend(self) -> Backend:
        """One more simulator like it, for a rollout beside others. Threads may ask.

        Raises:
            ConfigError: if it cannot be made.
        """
        with self._making:
            self._made.append(self._new_backend())
            return self._made[-1]

    def _new_backend(self) -> Backend:
        make = find_simulator(self.settings.backend, self.extensions.backends).create
        try:
            return make(self.settings.simulator_options)
        except SafemanipError:
            raise
        except Exception as error:
            what = f"the backend {self.settings.backend!r} cannot be made"
            failed = ConfigError(f"{what} ({type(error).__name__}: {error})")
            failed.add_note(user_traceback(error))
            raise failed from error

    @cached_property
    def store(self) -> Store:
        """The recordings.

        Raises:
            ConfigError: if the output folder cannot be written.
        """
        prepare_output(self.settings.out)
        shared = SharedStore(self.settings.store) if self.settings.store else None
        return Store(self.settings.out / "recordings", self.run_id, self.settings.fresh, shared)

    def kill(self) -> None:
        """End the simulators by force, those that are busy, too: the run is interrupted."""
        with self._making:
            for backend in self._made:
                if isinstance(backend, ProcessBackend):
                    backend.kill()

    def close(self) -> None:
        """End all simulators, at the same time: each may take some seconds."""
        with self._making:
            ending = [threading.Thread(target=backend.close) for backend in self._made]
        for thread in ending:
            thread.start()
        for thread in ending:
            thread.join()


_SIMULATION: pytest.StashKey[Simulation] = pytest.StashKey()


def simulation_of(config: pytest.Config) -> Simulation:
    """The simulation of this process; it ends with pytest, also after Ctrl-C.

    Raises:
        ConfigError: naming the option and what is wrong with its value.
    """
    if _SIMULATION not in config.stash:
        simulation = config.stash[_SIMULATION] = Simulation(config)
        config.add_cleanup(simulation.close)
    return config.stash[_SIMULATION]
