"""Metrics of a run, from rollout records."""
