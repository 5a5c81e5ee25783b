"""Statistics of a dataset's features, by which models normalize."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
EVERY = 10
"""One image in so many is looked at: neighbours are alike."""

Array = NDArray[Any]
Statistics = dict[str, Array]


def of_rows(rows: Array) -> Statistics:
    """Statistics of rows (N,) or (N, K): each (1,) or (K,)."""
    values = np.asarray(rows, np.float64).reshape(len(rows), -1)
    found = {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([len(values)]),
    }
    return {**found, **{k: np.quantile(values, q, axis=0) for k, q in QUANTILES.items()}}


class OfImages:
    """Statistics of images, from 0 to 1, by channel: each (3, 1, 1)."""

    def __init__(self) -> None:
        self._seen, self._histogram = 0, np.zeros((3, 256), np.int64)

    def add(self, image: Array) -> None:
        """Take in one (H, W, 3), uint8."""
        if self._seen % EVERY == 0:
            self._histogram += [
                np.bincount(image[..., channel].ravel(), minlength=256) for channel in range(3)
            ]
        self._seen += 1

    def result(self) -> Statistics:
        """What it was, of at least one."""
        levels, counts = np.arange(256) / 255.0, self._histogram
        share = counts / counts.sum(axis=1, keepdims=True)
        below, mean = share.cumsum(axis=1), share @ levels
        found = {
            "min": levels[(counts > 0).argmax(axis=1)],
            "max": levels[255 - (counts[:, ::-1] > 0).argmax(axis=1)],
            "mean": mean,
            "std": np.sqrt(np.maximum(share @ levels**2 - mean**2, 0.0)),
        }
        found |= {k: levels[(below >= q).argmax(axis=1)] for k, q in QUANTILES.items()}
        shaped = {k: values.reshape(3, 1, 1) for k, values in found.items()}
        return {**shaped, "count": np.array([-(-self._seen // EVERY)])}


def pooled(parts: Iterable[Mapping[str, Array]]) -> Statistics:
    """Statistics of several sets of images together; of quantiles, the mean."""
    every = list(parts)
    counts = np.array([part["count"][0] for part in every], np.float64)
    stacked = {name: np.stack([part[name] for part in every]) for name in every[0]}
    mean = np.average(stacked["mean"], axis=0, weights=counts)
    square = stacked["std"] ** 2 + stacked["mean"] ** 2
    found = {k: np.average(stacked[k], axis=0, weights=counts) for k in QUANTILES}
    return {
        **found,
        "min": stacked["min"].min(axis=0),
        "max": stacked["max"].max(axis=0),
        "mean": mean,
        "std": np.sqrt(np.maximum(np.average(square, axis=0, weights=counts) - mean**2, 0.0)),
        "count": np.array([counts.sum()], np.int64),
    }
