"""Policies behind a server: openpi, GR00T and vla-eval, over the network.

None of their packages is needed, and nothing that a server sends is ever executed.
"""
