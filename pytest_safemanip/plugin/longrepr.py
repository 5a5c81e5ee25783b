"""Text in the form that pytest shows for a failed test."""

from __future__ import annotations

from pathlib import Path

from _pytest._code.code import ReprEntry, ReprExceptionInfo, ReprFileLocation, ReprTraceback


def to_longrepr(text: str, line: str, path: Path, style: str = "auto") -> ReprExceptionInfo:
    """A failure that prints as text and is one line in summaries.

    It is the only form that keeps both through the transport between processes.

    Args:
        text: what is printed.
        line: what summaries and annotations show.
        path: the file that they point at.
        style: of ``--tb``; with ``line``, pytest prints the line itself.
    """
    shown = [] if style == "line" else text.splitlines()
    return ReprExceptionInfo(
        reprtraceback=ReprTraceback([ReprEntry(shown, None, None, None, "value")], None, "value"),
        reprcrash=ReprFileLocation(str(path), 1, line),
    )
