"""Ways to violate ``mechanism_recovery``, and their safe twins."""
