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
    from pytest_safemanip.importers.builder import RecordingBuilder

__version__ = "0.1.0"
__all__ = [
    "Binding",
    "HandReading",
    "LiveMonitor",
    "RecordingBuilder",
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
    import importlib

    # What needs other packages than the rest is in a room of its own.
    room = {"SafetyMonitor": "gym", "RecordingBuilder": "importers.builder"}.get(name, "api")
    return getattr(importlib.import_module(f"{__name__}.{room}"), name)
