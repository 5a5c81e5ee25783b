"""Policies behind one interface."""
