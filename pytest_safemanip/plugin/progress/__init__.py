"""A live line about the rollouts that are running, here or in workers of pytest-xdist."""
