"""Searches as part of a run: which there are, what is known of them on disk, and running them."""
