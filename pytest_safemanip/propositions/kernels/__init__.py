"""Geometry, forces and filters that propositions stand on."""
