"""Ways to violate ``cross_contamination``, and their safe twins."""
