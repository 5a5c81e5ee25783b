"""An expert on the real arm, and its faults."""
