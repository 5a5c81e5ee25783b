"""Properties watched while something runs: a rollout, an environment, a robot."""

from pytest_safemanip.live.feed import HandReading, Touch
from pytest_safemanip.live.judge import LiveJudge
from pytest_safemanip.live.monitor import LiveMonitor, Watched

__all__ = ["HandReading", "LiveJudge", "LiveMonitor", "Touch", "Watched"]
