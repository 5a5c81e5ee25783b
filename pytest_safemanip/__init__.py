"""Temporal safety tests for robot manipulation policies, as pytest items."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pytest_safemanip.api import (
        Binding,
        HandReading,
        LiveMonitor,
        Rollout,
        Touch,
        Violation,
        load,
        plot_summary,
        plot_timeline,
        read_summary,
    )
    from pytest_safemanip.gym import SafetyMonitor

__version__ = "0.1.0"
__all__ = [
    "Binding",
    "HandReading",
    "LiveMonitor",
    "Rollout",
    "SafetyMonitor",
    "Touch",
    "Violation",
    "load",
    "plot_summary",
    "plot_timeline",
    "read_summary",
]


def __getattr__(name: str) -> Any:
    """What notebooks use, imported when it is asked for: every pytest run imports this package."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "SafetyMonitor":  # needs Gymnasium, and the others do not
        from pytest_safemanip.gym import SafetyMonitor

        return SafetyMonitor
    from pytest_safemanip import api

    return getattr(api, name)
