"""Temporal safety tests for robot manipulation policies, as pytest items."""

__version__ = "0.1.0"
