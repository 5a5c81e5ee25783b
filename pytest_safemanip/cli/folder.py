"""What the working folder adds: its ini file, and the hooks of its conftest.py."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import io
import os
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.plugin.extensions import read_extensions
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.run.invocation import relative_path
from pytest_safemanip.run.plan import Extensions
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.task import Task


@dataclass(frozen=True)
class Folder:
    """The working folder, as a bare ``pytest`` in it would see it.

    Attributes:
        settings: what the ini file says.
        extensions: what the hooks of conftest.py and of installed plugins add.
    """

    settings: Settings
    extensions: Extensions

    @cached_property
    def definitions(self) -> Definitions:
        """Tasks, properties and propositions, the shipped and the user's.

        Raises:
            ConfigError: naming the file that is wrong.
        """
        paths = self.settings.task_paths, self.settings.property_paths
        defined = load_definitions(*paths, self.extensions.propositions, self.settings.backend)
        simulator = find_simulator(self.settings.backend, self.extensions.backends)
        return defined.of_backend(simulator, self.settings.simulator_options)

    def with_backend(self, name: str | None) -> Folder:
        """The same folder with another backend; None for this one."""
        if name is None:
            return self
        return dataclasses.replace(self, settings=dataclasses.replace(self.settings, backend=name))

    def task(self, name: str) -> Task:
        """A task by its name.

        Raises:
            ConfigError: if there is none.
        """
        tasks: Mapping[str, Task] = self.definitions.tasks
        if name not in tasks:
            hint = did_you_mean(name, self.definitions.runnable, "safemanip tasks")
            raise ConfigError(f"unknown task {name!r}; {hint}")
        return tasks[name]


def add_backend(parser: argparse.ArgumentParser) -> None:
    """Declare the option ``--backend``."""
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="as --safemanip-backend; by default that of the ini file, or robocasa",
    )


def read_folder(backend: str | None = None) -> Folder:
    """Read the ini file and load conftest.py, as pytest does; nothing is collected or run.

    Args:
        backend: the one that is meant, if not the ini file's.

    Raises:
        ConfigError: if pytest cannot be configured here, in one line.
    """
    reader = _Reader()
    said = io.StringIO()
    # Assertions are rewritten in modules that are not imported yet, and this package's are.
    arguments = ["-p", "safemanip", "--assert=plain", "--capture=no"]
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            pytest.main(arguments, plugins=[reader])
        except ConfigError as error:
            raise ConfigError(_with_place(error)) from error
        except SystemExit as error:  # of a conftest.py
            said.write(f"a conftest.py ends the process, with {error.code!r}")
    if not reader.found:
        raise ConfigError(_one_line(said.getvalue()))
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    return reader.found[0].with_backend(backend)


def own_file(path: Path) -> str:
    """Where a task or property of the user's is defined; empty for a shipped one."""
    folders = [resources.folder(name) for name in ("tasks", "properties")]
    shipped = any(folder in path.parents for folder in folders)
    return "" if shipped else str(relative_path(path, Path.cwd()))


class _Reader:
    """A plugin that takes what it needs from pytest's configuration, and ends it there."""

    def __init__(self) -> None:
        self.found: list[Folder] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_cmdline_main(self, config: pytest.Config) -> int:
        """Instead of a test run."""
        self.found.append(Folder(read_settings(config), read_extensions(config)))
        return 0


def _with_place(error: ConfigError) -> str:
    """The first line of an error, behind the line of the user's code that raised its cause."""
    line, *traceback_lines = str(error).splitlines()
    frames = traceback.extract_tb(error.__cause__.__traceback__ if error.__cause__ else None)
    if not traceback_lines or not frames:
        return line
    return f"{frames[-1].filename}:{frames[-1].lineno}: {line}"


def _one_line(text: str) -> str:
    """What pytest says about an error: what it is about, and the exception of the user's code."""
    lines = [line.strip().removeprefix("ERROR: ") for line in text.splitlines() if line.strip()]
    raised = [line.removeprefix("E").strip() for line in lines if line.startswith("E ")]
    refused = [line.partition(": error: ")[2] for line in lines if ": error: " in line]
    if lines[0].startswith("ImportError while loading"):
        return f"{lines[0].rstrip('.')}: {' '.join(raised) or lines[-1]}"
    return refused[0] if refused else " ".join(lines)
