"""Lines of pytest's short summary that show the reason however narrow the terminal is."""

from __future__ import annotations

import pytest
from _pytest.compat import running_on_ci


def first_words(word: str, report: pytest.TestReport, config: pytest.Config) -> str:
    """What a failed case's line begins with: the reason, too, where pytest would leave it out.

    pytest writes ``WORD NODE_ID - REASON`` and cuts the reason to the terminal; node ids of cases
    are as long as a line.
    """
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is None or running_on_ci() or config.get_verbosity() >= 2:
        return word
    writer = config.get_terminal_writer()
    if writer.hasmarkup:  # it takes a line with colours for an empty one, and adds the reason
        return word
    width: int = writer.fullwidth
    if len(f"{word} {report.nodeid} - {crash.message}") <= width:
        return word
    return f"{word} {crash.message} -"
