"""Files about a violation, for the reports of others: JUnit, pytest-html, Allure.

None of these plugins is imported: what they read is plain data on the test report, or a function
that is there when they are.
"""

from __future__ import annotations

import base64
import os
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from pytest_safemanip.plugin.items import SafetyItem
from pytest_safemanip.report.pictures import film_of, picture_of
from pytest_safemanip.report.timeline import timeline_svg
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.run.cases import Case

FOLDER = "timelines"
"""Of the output folder: a picture of the propositions around each violation."""
MIME_TYPES = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".gif": "image/gif",
    ".svg": "image/svg+xml",
}
MAX_INLINE = 2_000_000
"""Bytes of a picture that pytest-html is given."""
KEY = "safemanip_attachments"
"""Attribute of a report with the files, the best to look at first."""


class Attachments:
    """Finds and draws the files of a violated case, in the process that ran it.

    Args:
        config: pytest's; says which reports are written.
        out: the output folder.
    """

    def __init__(self, config: pytest.Config, out: Path) -> None:
        self._page = Path(config.getoption("htmlpath", None) or "")
        self._allure = bool(config.getoption("allure_report_dir", None))
        self._junit = bool(config.getoption("xmlpath", None))
        self._out = out

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Attach them, if the case is violated and somebody is going to read them."""
        report = yield
        if not (self._page.name or self._allure or self._junit) or call.when != "call":
            return report
        data = getattr(report, "safemanip", None)
        if not isinstance(item, SafetyItem) or not data or data.get("outcome") != "VIOLATED":
            return report
        files = self._files(item.case, data)
        vars(report)[KEY] = [str(file) for file in files]
        if self._page.name:
            extras = [_html_extra(file, self._page) for file in files]
            vars(report)["extras"] = [*getattr(report, "extras", []), *extras]
        if self._allure:
            _attach_to_allure(files)
        return report

    def _files(self, case: Case, data: dict[str, Any]) -> list[Path]:
        recording = Path(data["recording"])
        found = [picture_of(recording), self._drawn(case, data), film_of(recording), recording]
        return list(dict.fromkeys(file for file in found if file is not None and file.is_file()))

    def _drawn(self, case: Case, data: dict[str, Any]) -> Path | None:
        """The timeline of the first violation, as a file; None where it cannot be written."""
        first = data["violations"][0]
        if not first.get("timeline"):
            return None
        path = self._out / FOLDER / f"{Path(data['recording']).stem}-{case.property_id}.svg"
        text = timeline_svg(first["timeline"], first["first"], f"{case.property_id} violated")
        try:
            write_whole(path, (text,))
        except OSError:
            return None
        return path


def _html_extra(file: Path, page: Path) -> dict[str, str | None]:
    """What pytest-html shows: a picture, or a link that stays true where both are moved."""
    kind = MIME_TYPES.get(file.suffix)
    if kind is None or file.stat().st_size > MAX_INLINE:
        link = quote(Path(os.path.relpath(file, page.parent)).as_posix())
        return {
            "name": file.name,
            "format_type": "url",
            "content": link,
            "mime_type": None,
            "extension": None,
        }
    return {
        "name": file.name,
        "format_type": "image",
        "content": base64.b64encode(file.read_bytes()).decode(),
        "mime_type": kind,
        "extension": file.suffix[1:],
    }


def _attach_to_allure(files: list[Path]) -> None:
    allure: Any = sys.modules.get("allure")
    if allure is None:
        return
    for file in files:
        kind = MIME_TYPES.get(file.suffix, "video/mp4" if file.suffix == ".mp4" else None)
        allure.attach.file(str(file), file.name, kind, file.suffix[1:])
