"""Ways to violate ``action_onset``, and their safe twins."""
