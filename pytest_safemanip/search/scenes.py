"""Scenes to train on: episodes around a failure that is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from pytest_safemanip.search.kinds.definition import Setting
from pytest_safemanip.search.regression import Change, Regression
from pytest_safemanip.search.units import rounded
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.codec import encode_request

LEAST, MOST = 0.5, 1.5
"""How much of each size of a failure its scenes have: from what is survived to more than fails."""


def scenes(
    kept: Regression, plain: Callable[[int], Request], count: int, seed: int
) -> Iterator[dict[str, Any]]:
    """Episodes around a failure: its sizes are drawn anew for each, its choices stay.

    Args:
        kept: the failure.
        plain: the episode of its task as it is, by a seed; the failure's own comes first, those
            after it follow.
        count: how many.
        seed: of the sizes.

    Yields:
        Plain values: ``regression``, ``task``, ``seed``, ``request`` (as in a recording), and what
        else is otherwise: ``prompt`` and ``disturbances``.
    """
    random = np.random.default_rng(seed)
    for number in range(count):
        changes = tuple(_drawn(change, random) for change in kept.changes)
        own = replace(kept, changes=changes, seed=kept.seed + number)
        situation = own.situation
        plainly = situation.to_plain()
        yield {
            "regression": kept.name,
            "task": kept.task,
            "seed": own.seed,
            "request": encode_request(situation.request(plain(own.seed))),
            "prompt": situation.prompt,
            "disturbances": plainly["disturbances"],
        }


def _drawn(change: Change, random: np.random.Generator) -> Change:
    size = change.setting.size
    if isinstance(size, str):
        return change
    drawn = rounded(size * random.uniform(LEAST, MOST))
    return replace(change, setting=Setting(drawn, change.setting.details))
