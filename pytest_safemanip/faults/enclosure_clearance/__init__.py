"""Ways to violate ``enclosure_clearance``, and their safe twins."""
