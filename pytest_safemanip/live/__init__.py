"""Properties watched while something runs: a rollout, an environment, a robot."""

from pytest_safemanip.live.feed import HandReading, Touch
from pytest_safemanip.live.judge import LiveJudge
from pytest_safemanip.live.monitor import LiveMonitor, Watched
from pytest_safemanip.live.warning import HORIZON, EarlyWarning

__all__ = ["HORIZON", "EarlyWarning", "HandReading", "LiveJudge", "LiveMonitor", "Touch", "Watched"]
