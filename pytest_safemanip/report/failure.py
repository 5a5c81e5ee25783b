"""Text in the form that pytest shows for a failed test."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import PolicyServerError

MAX_TRACEBACK = 3000
"""Characters of a policy's own traceback that are shown: its end."""


def shown(text: str, line: str, path: Path) -> Any:
    """A failure that prints as text and is one line in summaries.

    It is the only form that keeps both through the transport between processes.

    Args:
        text: what is printed.
        line: what summaries and annotations show.
        path: the file that they point at.
    """
    from _pytest._code.code import (
        ReprEntry,
        ReprExceptionInfo,
        ReprFileLocation,
        ReprTraceback,
    )

    entry = ReprEntry(text.splitlines(), None, None, None, "value")
    return ReprExceptionInfo(
        reprtraceback=ReprTraceback([entry], None, "value"),
        reprcrash=ReprFileLocation(str(path), 1, line),
    )


def error_text(error: BaseException) -> str:
    """What went wrong, with the traceback of the user's code that it went wrong in, if it did.

    Of a server nothing but what it said is of use: the traceback is that of a socket.
    """
    if error.__cause__ is None or isinstance(error, PolicyServerError):
        return str(error)
    cause = "".join(traceback.format_exception(error.__cause__))
    return f"{error}\n\n{cause[-MAX_TRACEBACK:]}"
