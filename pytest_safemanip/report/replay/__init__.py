"""Replays of rollouts in 3D: in a browser and in Rerun."""

from pytest_safemanip.report.replay.packing import pack
from pytest_safemanip.report.replay.standalone import page

__all__ = ["pack", "page"]
