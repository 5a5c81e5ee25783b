"""An expert on the real arm."""
