"""Ways to violate ``release_stability``, and their safe twins."""
