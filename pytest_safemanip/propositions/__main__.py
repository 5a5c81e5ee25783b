"""``python -m pytest_safemanip.propositions`` prints every shipped proposition, as Markdown."""

from __future__ import annotations

import inspect
import math
import sys
from collections.abc import Iterator

from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import Proposition

_HEAD = """# Propositions

What the atoms of a property mean. A value at a step depends on the steps before it within the
window, never on later ones. An *act* is of the robot, and false in the settle tail. Every number
can be changed: `--safemanip-params=settled.speed=0.05` judges recordings again with another one.
Printed by `python -m pytest_safemanip.propositions`."""


def document() -> str:
    """The page, as Markdown."""
    defaults = Catalogue().parameters({})
    lines = (line for p in SHIPPED for line in _section(p, p.window(defaults)))
    return "\n".join((_HEAD, *lines)) + "\n"


def _section(proposition: Proposition, window: float) -> Iterator[str]:
    arguments = f"({', '.join(proposition.arguments)})" if proposition.arguments else ""
    memory = "remembers all" if math.isinf(window) else f"window {window:g} s"
    yield f"\n## `{proposition.name}{arguments}`\n"
    yield inspect.cleandoc(proposition.doc).replace("``", "`")
    yield f"\n*{memory}{', an act' if proposition.act else ''}*"
    for law, reason in proposition.exempt.items():
        yield f"\nNot subject to the law `{law}`: {reason}."
    if proposition.parameters:
        yield "\n| parameter | default | why |\n|---|---|---|"
        for p in proposition.parameters:
            yield f"| `{p.name}` | {p.default:.4g} {p.unit} | {p.reason} |".replace("  ", " ")


if __name__ == "__main__":
    sys.stdout.write(document())
