"""Generated recordings, and laws that every proposition obeys on them; needs Hypothesis."""

from pytest_safemanip.fuzz.formulas import formulas, traces
from pytest_safemanip.fuzz.recordings import contacts, recordings
from pytest_safemanip.fuzz.scenes import scenes

__all__ = ["contacts", "formulas", "recordings", "scenes", "traces"]
