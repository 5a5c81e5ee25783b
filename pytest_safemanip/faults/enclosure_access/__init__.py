"""Ways to violate ``enclosure_access``, and their safe twins."""
