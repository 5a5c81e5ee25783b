"""Values of benchmarks' options: argparse says in a line what is wrong with one."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.option_values import parse_seeds


def read_seeds(text: str) -> tuple[int, ...]:
    """Seeds, as ``--safemanip-seeds`` takes them: ``A:B``, ``A,B,C`` or how many.

    Raises:
        argparse.ArgumentTypeError: if they are none.
    """
    try:
        return parse_seeds(text, "seeds")
    except ConfigError as error:
        # argparse names the option itself.
        raise argparse.ArgumentTypeError(str(error).removeprefix("seeds: ")) from error


def as_option(seeds: Sequence[int]) -> str:
    """The same seeds as text again: a single number would mean how many."""
    return ",".join(map(str, seeds)) if len(seeds) > 1 else f"{seeds[0]}:{seeds[0] + 1}"


def some_of(known: Collection[str]) -> Callable[[str], list[str]]:
    """Reads names with commas between them, and knows which there are."""

    def read(text: str) -> list[str]:
        names = text.split(",")
        if unknown := [name for name in names if name not in known]:
            raise argparse.ArgumentTypeError(
                f"there is no {unknown[0]!r}; there are {', '.join(known)}"
            )
        return names

    return read
