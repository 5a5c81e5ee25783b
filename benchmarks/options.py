"""Values of benchmarks' options: argparse says in a line what is wrong with one."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence

from pytest_safemanip.errors import ConfigError, did_you_mean
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


def add_seeds(parser: argparse.ArgumentParser, default: str) -> None:
    """Add ``--seeds``."""
    told = "A:B, A,B,C, or N for the first N (default: %(default)s)"
    parser.add_argument("--seeds", type=read_seeds, default=default, help=told)


def as_option(seeds: Sequence[int]) -> str:
    """The same seeds as text again: a single number would mean how many."""
    return ",".join(map(str, seeds)) if len(seeds) > 1 else f"{seeds[0]}:{seeds[0] + 1}"


def some_of(known: Collection[str]) -> Callable[[str], list[str]]:
    """Reads names with commas between them, and knows which there are."""

    def read(text: str) -> list[str]:
        names = text.split(",")
        if unknown := [name for name in names if name not in known]:
            hint = did_you_mean(unknown[0], known)
            raise argparse.ArgumentTypeError(f"there is no {unknown[0]!r}; {hint}")
        return names

    return read
