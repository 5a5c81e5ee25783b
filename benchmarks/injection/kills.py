"""Kills processes of runs at random moments, and looks at what running again makes of it.

    python -m benchmarks.injection.kills --kills 100 --seed 0

A trial begins in an empty folder. One process of its first run is killed with SIGKILL, of each
further run with a probability; it is run again until every case has a verdict. Then the recordings
are compared with those of an undisturbed run, byte by byte. Between runs it is looked for processes
that are left, and for files that are no recordings though they have the name of one.

With ``--toy``, the simulator is a toy in a process of its own: many kills in little time.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import dataclasses
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.tables import table
from pytest_safemanip.errors import TraceError
from pytest_safemanip.metrics.summaries import NAME
from pytest_safemanip.trace import files

SET_CHILD_SUBREAPER = 36
"""Of prctl(2): who loses its parent becomes our child, so that nobody gets out of sight."""
AGAIN = 1 / 3
"""Probability that a run which is to make up for a kill is disturbed, too."""
MOST = 8
"""Runs of a trial, at most."""
LIMIT = 400.0
"""Seconds after which a run counts as blocked."""
GRACE = 90.0
"""Seconds after the end of a run in which its processes have to end, too; Ray's own look for their
cluster for a minute."""
WITHIN = 0.7
"""Share of an undisturbed run's time in which the moment is: later, there is little to kill."""
PERIOD = 0.02

COMMON = (
    *("-p", "no:cacheprovider", "-p", "no:hypothesispytest"),
    *("--safemanip-violations=xfail", "--safemanip-assets=primitive"),
)
REAL = (
    "--safemanip-tasks=OpenDrawer,OpenCabinet",
    "--safemanip-horizon-scale=0.05",
    "--safemanip-seeds=2",
)
TOY = ("--safemanip-backend=toy", "--safemanip-tasks=Reach", "--safemanip-seeds=6")
OWN = ("-p", "no:xdist", "--safemanip-policy=random")
SERVED = "--safemanip-policy=openpi@kills=ws://127.0.0.1:{port}"
MODES = {
    "plain": OWN,
    "jobs": (*OWN, "--safemanip-jobs=2"),
    "workers": ("-n", "2", "--safemanip-policy=random"),
    "ray": (*OWN, "--safemanip-ray=local"),
    "served": ("-p", "no:xdist", SERVED, "--safemanip-jobs=2"),
}
SIGNS = {
    "simulator": ("pytest_safemanip.sim.host",),
    "worker": ("exec(eval(sys.stdin.readline()))",),
    "ray worker": ("ray::IDLE", "ray::_run"),
}
"""What the command line of a process says of it."""
VICTIMS = {
    "plain": ("main", "simulator"),
    "jobs": ("main", "simulator"),
    "workers": ("main", "simulator", "worker"),
    "ray": ("main", "simulator", "ray worker"),
    "served": ("main", "simulator", "server"),
}
INI = "[pytest]\nsafemanip_task_paths = mine\nsafemanip_deadlines = restart = 60\n"
TASK = "task: Reach\nsets: [mine]\nsuite: mine\nhorizon: atomic\nobjects: [obj]\n"
PROPERTIES = "properties: [grasp_stability, release_stability]\n"
MODEL = """
import numpy as np

class Model:
    '''Moves at random; an episode that is begun again has to be begun from its seed.'''
    def reset(self, seed):
        self.noise = np.random.default_rng(seed)
    def infer(self, request):
        return {"actions": self.noise.uniform(-1.0, 1.0, (50, 12))}
"""
SIMULATOR = f"""
import sys
import time
sys.path.append({str(Path(__file__).parents[2])!r})
from pytest_safemanip.sim.backend import Provenance, Simulator
from pytest_safemanip.sim.process import ProcessBackend
from tests import toy

class Slow(toy.World):
    def __init__(self):
        super().__init__(horizon=40)
    def reset(self, request):
        time.sleep(0.2)
        return super().reset(request)
    def step(self, action):
        time.sleep(0.01)
        return super().step(action)

def create(options):
    about = Provenance("toy", "primitive")
    return ProcessBackend("slow:Slow", {{}}, toy.SPEC, about, options.logs)

SLOW = Simulator(toy.SPEC, create)
"""
CONFTEST = """
from slow import SLOW
def pytest_safemanip_backends():
    return {"toy": SLOW}
"""


@dataclass
class Score:
    """What came of the kills of one kind of process in one mode."""

    kills: int = 0
    runs: list[int] = field(default_factory=list)
    lost: int = 0
    twice: int = 0
    differ: int = 0
    halves: int = 0
    left: int = 0
    blocked: int = 0
    statuses: int = 0
    gone: float = 0.0

    def row(self) -> list[str]:
        """Of the table."""
        mean = sum(self.runs) / max(1, len(self.runs))
        runs = f"{mean:.1f} (most {max(self.runs, default=0)})"
        faults = (self.lost, self.twice, self.differ, self.halves)
        others = (self.left, self.blocked, self.statuses)
        return [str(self.kills), runs, *map(str, (*faults, *others)), f"{self.gone:.1f}"]

    @property
    def clean(self) -> bool:
        """Whether nothing went wrong."""
        faults = (self.lost, self.twice, self.differ, self.halves)
        return not any((*faults, self.left, self.blocked, self.statuses))


HEAD = [
    *("mode", "killed", "times", "runs until whole", "lost", "twice", "differ"),
    *("half files", "left over", "blocked", "other status", "s until all are gone"),
]


class Server:
    """A policy's server that is started again at once, at the same address."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        with socket.create_server(("127.0.0.1", 0)) as listening:
            self.port: int = listening.getsockname()[1]
        self._start()

    def kill(self) -> None:
        """Kill it, and start another one."""
        self.close()
        self._start()

    def close(self) -> None:
        """Kill it."""
        self._process.kill()
        self._process.wait()

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    def _start(self) -> None:
        command = [sys.executable, "-m", "pytest_safemanip", "serve", "model:Model"]
        self._process = subprocess.Popen(
            [*command, "--port", str(self.port)], cwd=self._folder, stdout=subprocess.DEVNULL
        )


class Field:
    """A folder in which runs are started and disturbed."""

    def __init__(self, folder: Path, toy: bool, noise: random.Random) -> None:
        self.folder, self.noise = folder, noise
        self._chosen = TOY if toy else REAL
        self.out = folder / ".safemanip"
        (folder / "mine").mkdir()
        (folder / "mine" / "reach.yaml").write_text(TASK + PROPERTIES)
        (folder / "model.py").write_text(MODEL)
        (folder / "pytest.ini").write_text(INI)
        if toy:
            (folder / "slow.py").write_text(SIMULATOR)
            (folder / "conftest.py").write_text(CONFTEST)
        self.server = Server(folder)

    def begin(self, mode: str) -> subprocess.Popen[bytes]:
        """Start a run."""
        given = [word.format(port=self.server.port) for word in MODES[mode]]
        with (self.folder / "output").open("wb") as output:
            return subprocess.Popen(
                [sys.executable, "-m", "pytest", *COMMON, *self._chosen, *given],
                cwd=self.folder,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def recordings(self) -> dict[str, Path]:
        """By name."""
        return {p.name: p for p in sorted((self.out / "recordings").glob(f"*{files.SUFFIX}"))}

    def others(self) -> list[int]:
        """The processes that are still there, but for the server."""
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass  # an orphan that has ended
        return [pid for pid in descendants(os.getpid()) if pid != self.server.pid]

    def wait_for_others(self) -> float | None:
        """Seconds until all processes of a run have ended; None if some stay, which are killed."""
        began = time.monotonic()
        while left := self.others():
            if time.monotonic() - began > GRACE:
                for pid in left:
                    print("left over:", pid, command_line(pid)[:200], flush=True)
                    kill(pid)
                return None
            time.sleep(PERIOD)
        return time.monotonic() - began

    def disturb(self, run: subprocess.Popen[bytes], victim: str, after: float) -> bool:
        """Kill a process of a run; whether there was one before the run ended."""
        end = time.monotonic() + after
        while run.poll() is None:
            found = self._find(run, victim) if time.monotonic() >= end else []
            if victim == "server" and found:
                self.server.kill()
                return True
            if found and kill(self.noise.choice(found)):
                return True
            time.sleep(PERIOD)
        return False

    def _find(self, run: subprocess.Popen[bytes], victim: str) -> list[int]:
        if victim == "main":
            return [run.pid]
        if victim == "server":
            return [self.server.pid]
        lines = {pid: command_line(pid) for pid in descendants(run.pid)}
        return [p for p, line in lines.items() if any(sign in line for sign in SIGNS[victim])]


def descendants(pid: int) -> list[int]:
    """The living processes below one."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = entry.read_text().rpartition(")")[2].split()[:2]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if state not in "ZX":
            children.setdefault(int(parent), []).append(int(entry.parent.name))
    found, ahead = [], [pid]
    while ahead:
        below = children.get(ahead.pop(), [])
        found += below
        ahead += below
    return found


def command_line(pid: int) -> str:
    """Of a process; empty if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except (FileNotFoundError, ProcessLookupError):
        return ""


def kill(pid: int) -> bool:
    """Whether there was anything to kill."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def wait(run: subprocess.Popen[bytes]) -> int | None:
    """The exit status of a run; None if it is blocked, and ended by force."""
    try:
        return run.wait(LIMIT)
    except subprocess.TimeoutExpired:
        run.kill()
        run.wait()
        return None


def content(path: Path) -> bytes:
    """Of a recording, but for how often its episode was begun again.

    Raises:
        TraceError: if it is none.
    """
    recording = files.load(path)
    served = {k: v for k, v in recording.episode.served.items() if k != "restarts"}
    episode = dataclasses.replace(recording.episode, served=served)
    return files.to_bytes(dataclasses.replace(recording, episode=episode))


def is_whole(place: Field, status: int | None) -> bool:
    """Whether a run has a verdict for every case."""
    return status == 0 and (place.out / NAME).exists()


def trial(
    place: Field, mode: str, victim: str, seconds: float, wanted: Mapping[str, bytes], score: Score
) -> None:
    """Run, kill, and run again until nothing is missing."""
    shutil.rmtree(place.out, ignore_errors=True)
    for runs in range(1, MOST + 1):
        before = {name: path.stat().st_ino for name, path in place.recordings().items()}
        run = place.begin(mode)
        hit = False
        if runs == 1 or place.noise.random() < AGAIN:
            hit = place.disturb(run, victim, place.noise.uniform(0.0, WITHIN * seconds))
            score.kills += hit
        status = wait(run)
        expected = (0, 10, -signal.SIGKILL) if hit else (0,)
        score.blocked += status is None
        if status not in expected:
            score.statuses += 1
            print((place.folder / "output").read_text()[-3000:], flush=True)
        gone = place.wait_for_others()
        score.left += gone is None
        score.gone = max(score.gone, gone or 0.0)
        now = place.recordings()
        again = {n for n, inode in before.items() if n in now and now[n].stat().st_ino != inode}
        score.twice += len(again)
        score.halves += sum(not is_recording(path) for path in now.values())
        if is_whole(place, status):
            score.runs.append(runs)
            break
    found = {name: content(path) for name, path in place.recordings().items()}
    score.lost += len(set(wanted) - set(found))
    score.twice += len(set(found) - set(wanted))
    score.differ += sum(found[name] != wanted[name] for name in set(found) & set(wanted))


def is_recording(path: Path) -> bool:
    """Whether a file is one, and whole."""
    try:
        files.load(path)
    except TraceError as error:
        print("half file:", error, flush=True)
        return False
    return True


def undisturbed(place: Field, mode: str) -> tuple[float, dict[str, bytes]]:
    """Seconds of a run, and its recordings."""
    shutil.rmtree(place.out, ignore_errors=True)
    began = time.monotonic()
    status = wait(place.begin(mode))
    seconds = time.monotonic() - began
    if not is_whole(place, status) or place.wait_for_others() is None:
        sys.exit(f"{mode}: exit status {status}\n{(place.folder / 'output').read_text()[-3000:]}")
    return seconds, {name: content(path) for name, path in place.recordings().items()}


def rounds(modes: Sequence[str], victims: Sequence[str], noise: random.Random) -> Iterator[str]:
    """Pairs of mode and victim without end, each as often as the others."""
    pairs = [f"{mode}/{v}" for mode in modes for v in VICTIMS[mode] if v in victims]
    if not pairs:
        sys.exit("no mode has such a process")
    while True:
        noise.shuffle(pairs)
        yield from pairs


def main() -> None:
    """Kill, and print what came of it."""
    every = sorted({victim for found in VICTIMS.values() for victim in found})
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=100, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of moments and victims")
    parser.add_argument("--modes", nargs="+", choices=list(MODES), default=list(MODES))
    parser.add_argument("--victims", nargs="+", choices=every, default=every)
    parser.add_argument("--toy", action="store_true", help="instead of RoboCasa")
    options = parser.parse_args()
    ctypes.CDLL(None).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    noise = random.Random(options.seed)  # noqa: S311  (no secrets)
    place = Field(Path(tempfile.mkdtemp()), options.toy, noise)
    scores: dict[str, Score] = {}
    try:
        known = {mode: undisturbed(place, mode) for mode in options.modes}
        for pair in rounds(options.modes, options.victims, noise):
            mode, victim = pair.split("/")
            score = scores.setdefault(pair, Score())
            trial(place, mode, victim, *known[mode], score)
            print(pair, *score.row(), flush=True)
            if sum(score.kills for score in scores.values()) >= options.kills:
                break
    finally:
        for pid in descendants(os.getpid()):
            kill(pid)
        shutil.rmtree(place.folder)
    print(table(HEAD, [[*pair.split("/"), *s.row()] for pair, s in sorted(scores.items())]))
    sys.exit(not all(score.clean for score in scores.values()))


if __name__ == "__main__":
    main()
