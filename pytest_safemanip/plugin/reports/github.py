"""What GitHub Actions is told when a session ends: a job summary and annotations."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError, SafemanipError, printable, raised_as
from pytest_safemanip.report.ci.annotations import annotations_of
from pytest_safemanip.report.ci.markdown import markdown
from pytest_safemanip.report.ci.places import source_root
from pytest_safemanip.report.ci.reading import read_run

MAX_BYTES = 1_000_000
"""Of a step's summary: GitHub drops one of 1 MiB, and those just below it, too."""
OFF = ("", "0", "false")


class GitHub:
    """Writes what the environment asks for, if it is that of GitHub's runner or of one like it.

    Args:
        environ: the environment.
        skip_open: whether gates that too few rollouts were run for do not fail the run.
    """

    def __init__(self, environ: Mapping[str, str] = os.environ, skip_open: bool = False) -> None:
        on_ci = environ.get("CI", "").lower() not in OFF
        self._summary = environ.get("GITHUB_STEP_SUMMARY", "") if on_ci else ""
        self._annotates = on_ci and environ.get("GITHUB_ACTIONS", "").lower() == "true"
        self._skip_open = skip_open
        self._commands: list[str] = []

    def tell(self, summary: Path) -> list[str]:
        """Append the job summary, and prepare the annotations.

        Args:
            summary: the summary of the run.

        Returns:
            What could not be written, in lines.
        """
        if not self._summary and not self._annotates:
            return []
        try:
            with raised_as(SafemanipError, "cannot be written"):
                run = read_run(summary)
                if self._annotates:
                    found = annotations_of(run, source_root(), self._skip_open)
                    self._commands = [annotation.command() for annotation in found]
                if self._summary:
                    _append(Path(self._summary), markdown(run))
        except SafemanipError as error:  # whatever it is, verdicts stand
            why = printable(str(error).partition("\n")[0], 300)
            return [f"job summary: {why}"]
        return []

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> Generator[None, None, None]:
        """Write the annotations when everything else has been said."""
        yield
        reporter = session.config.pluginmanager.getplugin("terminalreporter")
        if reporter is not None and self._commands:
            reporter.ensure_newline()
            for command in self._commands:
                reporter.write_line(command)


def _append(path: Path, text: str) -> None:
    """Add to what other commands of the step have written; as much as GitHub takes.

    Raises:
        ConfigError: if it is no file, or there is no room.
    """
    if path.exists() and not path.is_file():
        raise ConfigError(f"{path}: is not a file")
    written = path.stat().st_size if path.exists() else 0
    room = MAX_BYTES - written - 1
    content = text.encode()
    if len(content) > room:
        # Between violations: in one, a block of code would stay open.
        content = content[: max(room, 0)].decode(errors="ignore").rpartition("\n\n#")[0].encode()
    if not content:
        raise ConfigError(f"{path}: is full; GitHub takes {MAX_BYTES} bytes of a step")
    else:
        with path.open("ab") as file:
            file.write(b"\n" + content.rstrip() + b"\n" if written else content)
