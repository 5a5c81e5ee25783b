"""Intervals and tests, on numbers alone."""
