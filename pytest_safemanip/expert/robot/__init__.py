"""The robot: its base, its arm, its hand."""
