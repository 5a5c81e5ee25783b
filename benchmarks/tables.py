"""Tables that are printed, and put into the documents that show them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table with aligned columns."""
    widths = [max(len(row[k]) for row in (head, *lines)) for k in range(len(head))]

    def line(row: Sequence[str]) -> str:
        return "| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |"

    rule = "|" + "|".join("-" * (width + 2) for width in widths) + "|"
    return "\n".join((line(head), rule, *map(line, lines)))


def put(document: Path, name: str, text: str) -> None:
    """Replace what stands between ``<!-- NAME -->`` and ``<!-- end -->``.

    Raises:
        SystemExit: if the document has no such place.
    """
    whole, mark, end = document.read_text(), f"<!-- {name} -->\n", "\n<!-- end -->"
    before, found, rest = whole.partition(mark)
    _, ended, after = rest.partition(end)
    if not found or not ended:
        raise SystemExit(
            f"{document}: no place for it between '{mark.strip()}' and '{end.strip()}'"
        )
    document.write_text(f"{before}{mark}{text}{end}{after}")
