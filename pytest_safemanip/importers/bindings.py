"""What a user says of a source whose names do not say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pytest_safemanip.sim.mujoco.layout import Layout


@dataclass(frozen=True)
class Bindings:
    """What a user says.

    Attributes:
        categories: of objects, by name.
    """

    categories: Mapping[str, str] = field(default_factory=dict)

    def apply(self, layout: Layout, task: str) -> Layout:
        return layout


def read_bindings(path: Path | None) -> Bindings:
    return Bindings()
