"""Families of events, from clearly safe through a threshold to clearly unsafe, by one number."""
