"""Propositions: what is true at a step, from a recording."""
