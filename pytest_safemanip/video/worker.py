"""The process that draws videos: RoboCasa and GL libraries stay out of the one that asks.

A line of JSON is a message. The first one given says what to draw with, every other is a recording;
see :class:`~pytest_safemanip.video.process.Drawer`, the other side.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError, SafemanipError, first_line
from pytest_safemanip.trace import files
from pytest_safemanip.video.film import request_of, shoot
from pytest_safemanip.video.imaging import open_studio
from pytest_safemanip.video.storyboard import Storyboard


def main() -> None:
    """Draw what is asked for until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for pytest, which then ends this
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what simulators print is no reply

    def reply(**message: Any) -> None:
        replies.write(json.dumps(message) + "\n")
        replies.flush()

    _import_early()
    asked = (json.loads(line) for line in sys.stdin)
    about = next(asked, None)
    if about is None:
        return
    try:
        studio = open_studio(about["assets"], about["size"], draft=True)
    except SafemanipError as error:
        reply(unavailable=str(error))
        return
    reply(ready=True)
    for job in asked:
        try:
            _draw(studio, about["cameras"], job, lambda n, of: reply(drawn=n, of=of))
        except SafemanipError as error:
            reply(failed=str(error), asked=isinstance(error, ConfigError))
        except Exception as error:  # a simulator's code may raise anything
            reply(failed=first_line(error))
        else:
            reply(written=job["target"])
    studio.close()


def _import_early() -> None:
    """Import while the other side still judges; what is not there is said later."""
    wanted = os.environ.pop("MUJOCO_GL", None)  # see open_studio
    with contextlib.suppress(ImportError):
        importlib.import_module("pytest_safemanip.sim.robocasa.rendering.studio")
    if wanted is not None:
        os.environ["MUJOCO_GL"] = wanted


def _draw(studio: Any, cameras: list[str], job: dict[str, Any], progress: Any) -> None:
    source, target = Path(job["recording"]), Path(job["target"])
    recording = files.load(source)
    with studio.visit(request_of(recording, source)) as shot:
        shoot(recording, Storyboard.from_json(job["board"]), shot, cameras, target, progress)
