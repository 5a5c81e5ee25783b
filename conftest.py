"""Pytest wants this declared at the top level."""

pytest_plugins = ["pytester"]
