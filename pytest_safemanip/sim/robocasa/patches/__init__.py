"""Patches of other people's code; :mod:`.table` lists them with their reasons."""
