"""Ways to violate ``grasp_stability``, and their safe twins."""
