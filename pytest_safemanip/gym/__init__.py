"""Gymnasium environments watched while they are stepped."""

from pytest_safemanip.gym.wrapper import SafetyMonitor

__all__ = ["SafetyMonitor"]
