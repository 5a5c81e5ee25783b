"""What a search has found out by now, in the form in which test reports carry it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.report.searching import SearchData, search_data
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.searching.keeping import Keeping
from pytest_safemanip.run.searching.plan import SearchCase
from pytest_safemanip.run.searching.running import Searched, Searches
from pytest_safemanip.trace import files


@dataclass(frozen=True)
class Telling:
    """Tells what searches found.

    Attributes:
        running: runs the searches.
        keeping: keeps failures.
        invocation: what paths refer to.
    """

    running: Searches
    keeping: Keeping
    invocation: Invocation

    def tell(self, case: SearchCase, found: Searched) -> tuple[SearchData, Path | None]:
        """What is known about one property, and the recording of its failure; a failure is kept."""
        failure = found.search.pursuits[case.property_id].failure
        if failure is None:
            return search_data(case, found, None, None), None
        recording = self.running.recording(failure)
        kept = self.keeping.keep(case, found, failure)
        place = self.invocation.relative_path(kept) if kept is not None else None
        return search_data(case, found, files.load_scene(recording), place), recording
