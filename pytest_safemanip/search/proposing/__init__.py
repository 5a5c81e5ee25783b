"""What to try next: a maintained optimiser, and plain samplings to hold it against."""
