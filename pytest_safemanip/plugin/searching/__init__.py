"""Searches, and the failures that they kept, between pytest and `run/searching`."""
