"""The plans, and what one task alone needs."""
