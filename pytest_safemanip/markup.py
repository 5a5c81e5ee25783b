"""HTML for notebooks; everything in it is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from pytest_safemanip.errors import printable


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table with a caption.

    Args:
        caption: text above it; may have several lines.
        head: names of the columns.
        rows: their cells.
    """
    titles = "".join(f"<th>{_text(name)}</th>" for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{_text(cell)}</td>' for cell in row)}</tr>" for row in rows)
    above = "<br>".join(_text(line) for line in caption.splitlines())
    return (
        f'<table><caption style="text-align:left">{above}</caption>'
        f"<thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"
    )


def _text(value: object) -> str:
    return escape(printable(str(value), 500))
