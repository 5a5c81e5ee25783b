"""LIBERO: its own environments, in an interpreter of their own; tasks read from its BDDL files."""
