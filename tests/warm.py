"""Python that starts warm: processes are forks of one that has imported what they would import.

A start of pytest with the suite, or of ``safemanip``, is a second of imports and little else, and
so is a start of RoboCasa's simulator; tests and pages of the documentation start hundreds. What
forks cannot show, that a command starts where nothing is imported yet and imports no more than it
needs, is shown by processes of their own in `tests/cli/test_main.py`,
`tests/sim/process/test_process.py`, `tests/plugin/collection/test_unrelated.py` and
`tests/plugin/processes/test_interrupt.py`.

`Warm` is the side of tests. The rest of this module runs in the processes that are forked, which
have this file as their script; `_CALL` is what takes the place of a command.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import types
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

FLAGS = ("-u", "-B", "-P")
"""Of Python, passed over: streams are flushed at each line, and programs set their paths."""
_CALL = """\
#!{python} -ISE
import json, os, signal, socket, sys
known = "pytest_safemanip.video.worker", {assets!r}
simulates = sys.argv[1:3] == ["-P", "-c"] and any(name in " ".join(sys.argv[3:]) for name in known)
told = [{arguments!r} + sys.argv[1:], {called!r}, os.getcwd(), dict(os.environ)]
told = json.dumps(told).encode()
with socket.socket(socket.AF_UNIX) as warm:
    warm.connect({address!r} + ("simulators" if simulates else "runs"))
    socket.send_fds(warm, [len(told).to_bytes(4, "little")], [0, 1, 2])
    warm.sendall(told)
    ended = warm.recv(2)
    assert ended, "the process that is forked is gone"
    status = int.from_bytes(ended, "little", signed=True)
if status < 0:
    if -status != signal.SIGKILL:
        signal.signal(-status, signal.SIG_DFL)
    os.kill(os.getpid(), -status)
os._exit(status)
"""


class Warm:
    """The processes that are forked.

    Args:
        folder: for their sockets, which have no long paths, and for `python`.

    Attributes:
        python: takes the place of `sys.executable`, for commands and for RoboCasa's simulators.
    """

    def __init__(self, folder: Path) -> None:
        from pytest_safemanip.sim.robocasa import loading
        from pytest_safemanip.sim.robocasa.assets import prepare_assets

        self._folder, self._called = folder, folder / "bin" / "python"
        self._assets = str(prepare_assets(loading.package_assets(), "primitive").root)
        # Simulated bits must not depend on the number of threads or on the hash seed.
        single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        environment = {**os.environ, **single, "PYTHONHASHSEED": "0"}
        self._processes = [
            subprocess.Popen(
                [sys.executable, "-P", __file__, f"{folder}/{kind}", kind, self._assets],
                env={k: v for k, v in environment.items() if k not in ("MUJOCO_GL", "CI")},
                stdin=subprocess.PIPE,  # whose end is theirs
                stdout=subprocess.PIPE,
            )
            for kind in BEGINNINGS
        ]
        for process in self._processes:
            assert process.stdout is not None
            assert process.stdout.readline() == b"ready\n"
        self.install(self._called.parent, {"python": ()})
        self.python = str(self._called)

    def install(self, folder: Path, commands: Mapping[str, Sequence[str]]) -> None:
        """Write commands into a new folder: by name, with which arguments of Python they begin."""
        folder.mkdir()
        for name, arguments in commands.items():
            text = _CALL.format(
                python=sys.executable,
                address=f"{self._folder}/",
                arguments=list(arguments),
                assets=self._assets,
                called=str(self._called),
            )
            (folder / name).write_text(text)
            (folder / name).chmod(0o755)

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.communicate()


def _begin_runs(assets: str) -> None:
    """Import what runs import, by pytest's own way of importing plugins."""
    names = ("pytest_safemanip.cli.main", "pytest_safemanip.policies.remote.served", "xdist.remote")

    class Imports:
        def pytest_sessionstart(self) -> None:
            for name in names:
                importlib.import_module(name)

    chosen = ("--collect-only", "--safemanip-policy=scripted", "--safemanip-tasks=OpenDrawer")
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder, open(os.devnull, "w") as nowhere:
        os.chdir(folder)
        with contextlib.redirect_stdout(nowhere):
            status = pytest.main([*chosen, "-p", "no:cacheprovider"], plugins=[Imports()])
        os.chdir(here)
    assert status == 0, status


def _begin_simulators(assets: str) -> None:
    """Import RoboCasa, and have MuJoCo read the meshes of its robot."""
    from pytest_safemanip.sim.backend import Provenance, Request
    from pytest_safemanip.sim.robocasa.backend import RoboCasaBackend

    for name in ("pytest_safemanip.sim.host", "pytest_safemanip.video.worker"):
        importlib.import_module(name)
    backend = RoboCasaBackend(Path(assets), Provenance("robocasa", "primitive", {}, {}), "")
    backend.reset(Request("OpenDrawer", 0, "compact"))
    backend.close()


BEGINNINGS: Mapping[str, Callable[[str], None]] = {
    "runs": _begin_runs,
    "simulators": _begin_simulators,
}


def _serve(address: str, kind: str, assets: str) -> list[str]:
    """Fork for each command; in what becomes one, return its arguments."""
    BEGINNINGS[kind](assets)
    gc.collect()
    gc.freeze()
    signal.signal(signal.SIGCHLD, _forget_ended)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen()
        os.write(1, b"ready\n")
        while listening in select.select([listening, 0], [], [])[0]:
            caller, _ = listening.accept()
            if os.fork() == 0:
                break
            caller.close()
        else:
            os._exit(0)  # the tests are over, or were killed
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    size, streams, _, _ = socket.recv_fds(caller, 4, 3)
    told = caller.makefile("rb").read(int.from_bytes(size, "little"))
    command = os.fork()
    if command:
        _watch(command, caller, streams)
    caller.close()
    arguments, called, folder, environment = json.loads(told)
    _become(called, folder, environment, streams)
    return list(arguments)


def _watch(command: int, caller: socket.socket, streams: Sequence[int]) -> None:
    """Tell the caller how a command ended, and end the command with the caller."""
    for stream in (0, 1, 2, *streams):
        os.close(stream)
    ended = os.pidfd_open(command)
    if ended not in select.select([ended, caller], [], [])[0]:
        os.kill(command, signal.SIGKILL)
    status = os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])
    with contextlib.suppress(OSError):
        caller.sendall(status.to_bytes(2, "little", signed=True))
    os._exit(0)


def _forget_ended(*_: object) -> None:
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def _become(called: str, folder: str, environment: dict[str, str], streams: Sequence[int]) -> None:
    """Make this process what Python is when it begins."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin, sys.stdout, sys.stderr = (
        io.TextIOWrapper(os.fdopen(number, mode, closefd=False), "utf-8", errors, None, direct)
        for number, mode, errors, direct in (
            (0, "rb", "strict", False),
            (1, "wb", "strict", False),
            (2, "wb", "backslashreplace", True),
        )
    )
    sys.executable = called
    added = filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))
    sys.path[:0] = ["", *map(os.path.abspath, added)]


def _run(arguments: list[str]) -> None:
    """Run ``python ARGUMENTS``."""
    while arguments[0] in FLAGS:
        del arguments[0]
    if arguments[0] == "-c":
        sys.argv = ["-c", *arguments[2:]]
        main = sys.modules["__main__"] = types.ModuleType("__main__")
        exec(compile(arguments[1], "<string>", "exec"), main.__dict__)  # noqa: S102
    elif arguments[0].startswith("-m"):
        sys.argv, sys.path[0] = [arguments[0].removeprefix("-m"), *arguments[1:]], os.getcwd()
        if not sys.argv[0]:
            del sys.argv[0]
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    else:
        sys.argv, sys.path[0] = arguments, os.path.dirname(os.path.abspath(arguments[0]))
        runpy.run_path(arguments[0], run_name="__main__")


if __name__ == "__main__":
    _run(_serve(*sys.argv[1:]))
