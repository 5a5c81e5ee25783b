"""Recordings as moving pictures: the scene, and below it what was true when."""
