"""Ways to violate ``object_containment``, and their safe twins."""
