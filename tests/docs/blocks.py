"""Markdown pages as scripts: their fenced blocks, run in order in a folder of their own.

=============================  ==================================================================
block                          what is done with it
=============================  ==================================================================
``sh``                         run by bash; must end with 0, or what ``<!-- exit: N -->`` says
``python``                     run as a script; as a doctest if it has prompts
``python``, ``yaml``, ...      written to a file if the first line is a comment with its path
``output``                     compared with what the last block printed
=============================  ==================================================================

Comments on the line before a fence: ``<!-- not run: REASON -->``, ``<!-- exit: N -->``, and for an
``output`` block ``<!-- lines: FIRST ... LAST -->`` (two regular expressions; several ranges are
separated by `` ; ``): the block shows these lines alone, with ``...`` between ranges.
"""

from __future__ import annotations

import difflib
import doctest
import os
import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip import resources
from tests.warm import Warm

_FENCE = re.compile(
    r"^(?:<!-- (?P<note>[^\n]*?) -->\n)?```(?P<language>\w*)\n(?P<code>.*?)^```$", re.M | re.S
)
_PATH = re.compile(r"^# (\.?[\w./-]+\.(?:py|ya?ml|ini|toml))\n")
_REUSED = re.compile(r"^.*\d+ of \d+ rollouts? reused from .*\n", re.M)
_VOLATILE = re.compile(r"\b[0-9a-f]{12}\b|\d+\.\d+ ?s\b|\d+:\d\d(:\d\d)?")
_LIMIT_S = 300.0
COMMANDS = {"pytest": ["-m", "pytest"], "safemanip": ["-m", "pytest_safemanip"], "python": []}
"""What pages call, with which arguments of Python it begins."""


@dataclass(frozen=True)
class Block:
    """One fenced block.

    Attributes:
        line: of the page at which its code begins.
        language: behind the fence.
        code: what stands between the fences.
        notes: the comment on the line before, by key.
        start, end: where the code stands in the page.
    """

    line: int
    language: str
    code: str
    notes: dict[str, str]
    start: int
    end: int

    @property
    def path(self) -> str | None:
        """The file that the block is, by its first line."""
        found = _PATH.match(self.code)
        return found[1] if found else None

    @property
    def is_session(self) -> bool:
        """Whether the block is Python with prompts."""
        return self.language == "python" and self.code.startswith(">>>")

    @property
    def is_run(self) -> bool:
        """Whether the block is a command or a script."""
        runs = self.language == "sh" or (self.language == "python" and not self.path)
        return runs and not self.is_session and "not run" not in self.notes


def parse(text: str) -> list[Block]:
    """The fenced blocks of a page."""
    found = []
    for match in _FENCE.finditer(text):
        start = match.start("code")
        key, _, value = (part.strip() for part in (match["note"] or "").partition(":"))
        notes = {key: value} if key else {}
        line = text.count("\n", 0, start) + 1
        code, end = match["code"], match.end("code")
        found.append(Block(line, match["language"], code, notes, start, end))
    return found


def printed(output: str, folder: Path) -> str:
    """What a command prints when it is run for the first time, in the reader's folder."""
    for place in (folder, resources.folder("tasks").parent):
        output = output.replace(f"{place}/", "").replace(str(place), ".")
    text = _REUSED.sub("", output)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def select(output: str, lines: str) -> str:
    """The lines of an output that a block shows.

    Raises:
        LookupError: if a range has no first or no last line.
    """
    rows = output.splitlines()
    chunks, position = [], 0
    for part in lines.split(" ; "):
        first, _, last = (expression.strip() for expression in part.partition(" ... "))
        start = _find(rows, first, position)
        position = _find(rows, last or first, start) + 1
        chunks.append("".join(f"{row}\n" for row in rows[start:position]))
    return "...\n".join(chunks)


def _find(rows: list[str], expression: str, start: int) -> int:
    if expression == "END":
        return len(rows) - 1
    for index in range(start, len(rows)):
        if re.search(expression, rows[index]):
            return index
    raise LookupError(f"no line matches {expression!r} in\n" + "\n".join(rows[start:]))


def masked(text: str) -> str:
    """A text without its figures, widths of columns and lengths of rules."""
    text = re.sub(r"\d+(\.\d+)?", "#", _VOLATILE.sub("#", text))
    text = re.sub(r"([-=_])\1{2,}", r"\1\1\1", text)
    return re.sub(r"[ \t]+", " ", text)


def refreshed(old: str, new: str) -> str:
    """The new output, with the old one's lines where only durations and digests differ."""
    before, after = old.splitlines(), new.splitlines()
    kept = [_VOLATILE.sub("#", line) for line in before]
    found = [_VOLATILE.sub("#", line) for line in after]
    for a, b, size in difflib.SequenceMatcher(None, kept, found, False).get_matching_blocks():
        after[b : b + size] = before[a : a + size]
    return "".join(f"{line}\n" for line in after)


class Page:
    """Runs the blocks of a page.

    Args:
        text: the page.
        folder: where commands run and files are written; empty.
        warm: runs Python, pytest and safemanip.
        prepare: called with each command before it is run.
    """

    def __init__(self, text: str, folder: Path, warm: Warm, prepare: Callable[[str], None]) -> None:
        self._text, self._folder, self._warm, self._prepare = text, folder, warm, prepare
        self._commands = folder.parent / f"{folder.name}-bin"
        self._session: dict[str, object] = {}

    def run(self) -> Iterator[tuple[Block, str]]:
        """Run the page; each block that ``output`` is compared with, and what it should say.

        Raises:
            AssertionError: if a block ends otherwise than it should.
        """
        self._warm.install(self._commands, COMMANDS)
        output = None
        for block in parse(self._text):
            if block.language == "output" and output is not None:
                wanted = block.notes.get("lines")
                yield block, select(output, wanted) if wanted else output
            elif block.path and "not run" not in block.notes:
                target = self._folder / block.path
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(block.code)
            elif block.is_session:
                self._try(block)
            elif block.is_run:
                output = self._execute(block)
            elif "not run" in block.notes:
                output = None

    def _execute(self, block: Block) -> str:
        self._prepare(block.code)
        command = ["python", "-c"] if block.language == "python" else ["bash", "-ec"]
        ours = ("PYTEST_", "CI", "BUILD_")
        kept = {name: v for name, v in os.environ.items() if not name.startswith(ours)}
        added = {
            "PATH": f"{self._commands}{os.pathsep}{os.environ['PATH']}",
            "COLUMNS": "80",
            "PYTHONPATH": ".",
            "PYTEST_ADDOPTS": "-p no:cacheprovider -p no:hypothesispytest "
            "--override-ini=safemanip_assets=primitive",
        }
        done = subprocess.run(
            [*command, block.code],
            cwd=self._folder,
            env={**kept, **added},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_LIMIT_S,
            check=False,
        )
        wanted = int(block.notes.get("exit", "0"))
        assert done.returncode == wanted, (
            f"line {block.line}: exit status {done.returncode}, not {wanted}\n{done.stdout}"
        )
        return printed(done.stdout, self._folder)

    def _try(self, block: Block) -> None:
        example = doctest.DocTestParser().get_doctest(
            block.code, {}, f"line {block.line}", None, block.line
        )
        example.globs = self._session
        failures: list[str] = []
        doctest.DocTestRunner().run(example, out=failures.append, clear_globs=False)
        assert not failures, "".join(failures)
