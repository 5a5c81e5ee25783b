"""Errors as text, with the traceback of the user's code."""

from __future__ import annotations

import traceback
from pathlib import Path
from types import TracebackType

from pytest_safemanip.errors import PolicyServerError, printable

MAX_LINES, MAX_CHARACTERS = 40, 3000
"""Of a traceback, its end is shown."""
_PACKAGE = str(Path(__file__).parents[1])
_MACHINERY = ("/_pytest/", "/pluggy/", "/hypothesis/", "/xdist/", "/execnet/", "/filelock/")


def user_traceback(error: BaseException) -> str:
    """The traceback of an exception without the frames of this package, of pytest and the like.

    If no other frame is left, the failure is this package's, and its frames are shown.
    """
    whole = traceback.TracebackException.from_exception(error)
    _prune(whole, any(_is_users(frame.filename) for frame in whole.stack))
    text = "\n".join("".join(whole.format()).splitlines()[-MAX_LINES:])[-MAX_CHARACTERS:]
    return printable(text, 4 * MAX_CHARACTERS, lines=True)


def without_package_frames(found: TracebackType | None) -> TracebackType | None:
    """A traceback from its first frame of user code on; whole if there is none."""
    frame = found
    while frame is not None:
        if _is_users(frame.tb_frame.f_code.co_filename):
            return frame
        frame = frame.tb_next
    return found


class ErrorTexts:
    """Error messages for reports; each traceback is shown once."""

    def __init__(self) -> None:
        self._shown: set[str] = set()

    def text(self, error: BaseException) -> str:
        """What went wrong, with the traceback of the user's code that it went wrong in, if it did.

        Of a server nothing but what it said is of use: the traceback is that of a socket.
        """
        if error.__cause__ is None or isinstance(error, PolicyServerError):
            return self._once(str(error))
        cause = user_traceback(error.__cause__)
        if cause in self._shown:
            return f"{error}\n\n(same traceback as before)"
        self._shown.add(cause)
        return f"{error}\n\n{cause}"

    def _once(self, text: str) -> str:
        """Whole the first time; later without what a server or a simulator said at length."""
        line, _, more = text.partition("\n")
        if not more or more in self._shown:
            return line
        self._shown.add(more)
        return text


def _prune(part: traceback.TracebackException, users_only: bool) -> None:
    part.__notes__ = None  # Hypothesis prints the recording, whole
    kept = [
        frame
        for frame in part.stack
        if _is_users(frame.filename)
        or not (users_only or any(name in frame.filename for name in _MACHINERY))
    ]
    part.stack = traceback.StackSummary.from_list(kept)
    for linked in (part.__cause__, part.__context__):
        if linked is not None:
            _prune(linked, users_only)


def _is_users(filename: str) -> bool:
    return not (
        filename.startswith((_PACKAGE, "<frozen")) or any(name in filename for name in _MACHINERY)
    )
