"""Python that starts warm: commands are forks of one process, which has imported what most need.

A start of pytest with the suite, or of ``safemanip``, is a second of imports and little else, and
the pages of the documentation start nearly a hundred. What forks cannot show, that a command
starts where nothing is imported yet and imports no more than it needs, is shown in processes of
their own by `tests/cli/test_main.py`, `tests/cli/test_lists.py` and `tests/plugin`.

`Warm` is the side of tests. The rest of this module is what runs in the process that is forked,
which has this file as its script; `_CALL` is the file that takes the place of a command.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import tempfile
import types
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

BEGUN = ("--collect-only", "--safemanip-policy=scripted", "--safemanip-tasks=OpenDrawer")
"""A run that imports what all runs import, by pytest's own way of importing plugins."""
IMPORTED = (
    "pytest_safemanip.cli.main",
    "pytest_safemanip.plugin.gate_reports",
)
"""What is imported in it besides."""
_CALL = """\
#!{python} -ISE
import json, os, socket, sys
with socket.socket(socket.AF_UNIX) as warm:
    warm.connect({address!r})
    told = json.dumps([{arguments!r} + sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(warm, [len(told).to_bytes(4, "little")], [0, 1, 2])
    warm.sendall(told)
    (status,) = warm.recv(1)
sys.exit(status)
"""


class Warm:
    """The process that is forked.

    Args:
        folder: for its socket; short, since sockets have no long paths.
    """

    def __init__(self, folder: Path) -> None:
        self._address = str(folder / "warm")
        self._process = subprocess.Popen(
            [sys.executable, __file__, self._address],
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # threads are not forked
            stdout=subprocess.PIPE,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"

    def install(self, folder: Path, commands: Mapping[str, Sequence[str]]) -> None:
        """Write commands into a folder: by name, with which arguments of Python they begin."""
        for name, arguments in commands.items():
            call = {"address": self._address, "arguments": list(arguments)}
            (folder / name).write_text(_CALL.format(python=sys.executable, **call))
            (folder / name).chmod(0o755)

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


class _Imports:
    """A plugin of the run that is begun."""

    def pytest_sessionstart(self) -> None:
        for name in IMPORTED:
            importlib.import_module(name)


def _begin() -> None:
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder, open(os.devnull, "w") as nowhere:
        os.chdir(folder)
        with contextlib.redirect_stdout(nowhere):
            status = pytest.main([*BEGUN, "-p", "no:cacheprovider"], plugins=[_Imports()])
        os.chdir(here)
    assert status == 0, status


def _serve(address: str) -> list[str]:
    """Fork for each command; in what becomes one, return its arguments."""
    _begin()
    gc.collect()
    gc.freeze()
    signal.signal(signal.SIGCHLD, _forget_ended)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen()
        os.write(1, b"ready\n")
        while True:
            caller, _ = listening.accept()
            if os.fork() == 0:
                break
            caller.close()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    size, streams, _, _ = socket.recv_fds(caller, 4, 3)
    told = caller.makefile("rb").read(int.from_bytes(size, "little"))
    command = os.fork()
    if command:
        status = os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])
        caller.sendall(bytes([status if status >= 0 else 128 - status]))
        os._exit(0)
    caller.close()
    arguments, folder, environment = json.loads(told)
    _become(folder, environment, streams)
    return list(arguments)


def _forget_ended(*_: object) -> None:
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def _become(folder: str, environment: dict[str, str], streams: Sequence[int]) -> None:
    """Make this process what Python is when it begins."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin, sys.stdout, sys.stderr = (
        io.TextIOWrapper(open(number, mode, closefd=False), "utf-8", errors, line_buffering=direct)
        for number, mode, errors, direct in (
            (0, "rb", "strict", False),
            (1, "wb", "strict", False),
            (2, "wb", "backslashreplace", True),
        )
    )
    added = filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))
    sys.path[:1] = ["", *map(os.path.abspath, added)]


def _run(arguments: list[str]) -> None:
    """Run ``python ARGUMENTS``."""
    if arguments[0] == "-c":
        sys.argv = ["-c", *arguments[2:]]
        main = sys.modules["__main__"] = types.ModuleType("__main__")
        exec(compile(arguments[1], "<string>", "exec"), main.__dict__)  # noqa: S102
    elif arguments[0] == "-m":
        sys.argv, sys.path[0] = arguments[1:], os.getcwd()
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
    else:
        sys.argv, sys.path[0] = arguments, os.path.dirname(os.path.abspath(arguments[0]))
        runpy.run_path(arguments[0], run_name="__main__")


if __name__ == "__main__":
    _run(_serve(sys.argv[1]))
