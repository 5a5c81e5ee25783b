"""An order that RoboCasa takes from where in memory things happen to lie."""

from __future__ import annotations


def keep() -> None:
    """Let a counter's free places, to the left and to the right of a fixture, stay in this order.

    RoboCasa removes doubles among them by a set of XML elements, which are hashed by their address:
    with the same seed, things stood on another side of a sink in another process.
    """
    from robocasa.models.fixtures import counter

    counter.__dict__["set"] = dict.fromkeys
