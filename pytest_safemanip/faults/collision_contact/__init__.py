"""Ways to violate ``collision_contact``, and their safe twins."""
