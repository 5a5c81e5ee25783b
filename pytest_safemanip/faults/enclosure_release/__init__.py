"""Ways to violate ``enclosure_release``, and their safe twins."""
