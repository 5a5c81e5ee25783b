"""What RoboCasa asks at every control step, answered the same and sooner.

Its fixtures parse the same attributes of their XML, build the same rotations and compare the names
of all geoms in contact, step after step: a quarter of a step once the controllers are cheap.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_KEPT = 4096
"""Answers kept of each function; the fixtures of RoboCasa's largest kitchens ask for some 500."""


def install() -> None:
    """Let the imported modules of robosuite and RoboCasa share what pure functions answered."""
    from robosuite.utils import mjcf_utils, transform_utils

    string_to_array, euler2mat = mjcf_utils.string_to_array, transform_utils.euler2mat
    _replace({string_to_array: _texts(string_to_array), euler2mat: _angles(euler2mat)})


def _replace(functions: dict[Any, Any]) -> None:
    """Replace functions wherever a module has them, by whatever name."""
    for name, module in list(sys.modules.items()):
        if name.startswith(("robosuite.", "robocasa.")):
            for attribute, value in list(vars(module).items()):
                if callable(value) and getattr(value, "__hash__", None) and value in functions:
                    setattr(module, attribute, functions[value])


def _texts(function: Callable[[str], NDArray[Any]]) -> Callable[[str], NDArray[Any]]:
    known = functools.lru_cache(_KEPT)(function)

    @functools.wraps(function)
    def answer(string: str) -> NDArray[Any]:
        return known(string).copy()  # RoboCasa changes some of them

    return answer


def _angles(function: Callable[[Any], NDArray[Any]]) -> Callable[[Any], NDArray[Any]]:
    # By their bytes: 0.0 and -0.0 are equal and lead to different bits.
    known = functools.lru_cache(_KEPT)(lambda raw: function(np.frombuffer(raw)))

    @functools.wraps(function)
    def answer(euler: Any) -> NDArray[Any]:
        angles = np.asarray(euler, dtype=np.float64)
        return known(angles.tobytes()).copy() if angles.shape == (3,) else function(euler)

    return answer


class ContactCheck:
    """Answers as an environment's ``check_contact``, comparing numbers instead of names.

    Args:
        sim: robosuite's simulation, whose geoms do not change any more.
    """

    def __init__(self, sim: Any) -> None:
        self._data = sim.data._data
        self._number = sim.model._geom_name2id
        self._models: dict[int, tuple[Any, frozenset[int]]] = {}

    def __call__(self, geoms_1: Any, geoms_2: Any = None) -> bool:
        """Whether a geom of the first group touches one of the second, or any at all if None.

        Args:
            geoms_1: a geom's name, several names, or a robosuite model, for its contact geoms.
            geoms_2: likewise.
        """
        pairs = self._data.contact.geom.tolist()
        first = self._group(geoms_1)
        if geoms_2 is None:
            return any(a in first or b in first for a, b in pairs)
        second = self._group(geoms_2)
        return any((a in first and b in second) or (a in second and b in first) for a, b in pairs)

    def _group(self, geoms: Any) -> frozenset[int]:
        if isinstance(geoms, str):
            return self._numbers((geoms,))
        if not hasattr(geoms, "contact_geoms"):
            return self._numbers(geoms)
        # The model is kept too: its identity must not be given to another one.
        if id(geoms) not in self._models:
            self._models[id(geoms)] = geoms, self._numbers(geoms.contact_geoms)
        return self._models[id(geoms)][1]

    def _numbers(self, names: Iterable[str]) -> frozenset[int]:
        known = self._number
        return frozenset(known[name] for name in names if name in known)
