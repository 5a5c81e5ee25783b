"""Types of this package that Hypothesis can make, known to it whichever is imported first.

Hypothesis is imported in every pytest run that it is installed for. It loads this module then, and
nothing beside: a type that was not imported by then says itself that it can be made.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

_Type = TypeVar("_Type", bound=type)
_NAMES: dict[type, str] = {}


def made_by(name: str) -> Callable[[_Type], _Type]:
    """Mark a type that ``st.from_type`` makes with a strategy of ``pytest_safemanip.fuzz``.

    Args:
        name: of the function there that returns the strategy.
    """

    def mark(marked: _Type) -> _Type:
        _NAMES[marked] = name
        if "hypothesis.strategies" in sys.modules:
            _register(marked, name)
        return marked

    return mark


def register() -> None:
    """Tell Hypothesis about the types that are imported already."""
    for marked, name in _NAMES.items():
        _register(marked, name)


def _register(marked: type, name: str) -> None:
    from hypothesis import strategies as st

    def strategy(_: type) -> SearchStrategy[Any]:
        fuzz = importlib.import_module("pytest_safemanip.fuzz")  # when it is first asked for
        found: SearchStrategy[Any] = getattr(fuzz, name)()
        return found

    st.register_type_strategy(marked, strategy)
