"""Elements of a scene out of JSON that anybody may have written, and the types of their fields."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cache
from numbers import Real
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import SHAPES

Element = TypeVar("Element")


def from_json(kind: type[Element], items: Any, field: str) -> tuple[Element, ...]:
    """The elements of one kind; their types are for :func:`mistyped` to check.

    Raises:
        TraceError: naming the element that is none.
    """
    if not isinstance(items, list | tuple):
        raise TraceError(f"scene: {field} must be a list, found {shown(items)}")
    return tuple(_element(kind, item, f"{field}[{index}]") for index, item in enumerate(items))


def _element(kind: type[Element], item: Any, place: str) -> Element:
    if not isinstance(item, Mapping):
        raise TraceError(f"scene: {place} must be a mapping, found {shown(item)}")
    try:
        return kind(**{name: _tuple(value) for name, value in item.items()})
    except TypeError as error:
        raise TraceError(f"scene: {place}: malformed description ({error})") from error


def _tuple(value: Any) -> Any:
    """Lists, and the lists in them, as tuples; no field has deeper ones."""
    if not isinstance(value, list):
        return value
    return tuple(tuple(item) if isinstance(item, list) else item for item in value)


def mistyped(items: Sequence[Any]) -> str:
    """What is wrong with the first field of another type than declared; empty if nothing is.

    Vectors, masses and the like are left to :func:`~.elements.impossible_number`.

    Args:
        items: elements of one kind.
    """
    if not items:
        return ""
    kind: Any = type(items[0])
    for name, (hint, words) in _declared(kind).items():
        for index, item in enumerate(items):
            value = getattr(item, name)
            if not _fits(value, hint):
                return f"[{index}]: {name} must be {words}, found {shown(value)}"
    return ""


def shown(value: Any) -> str:
    """A value in an error, cut to a readable length."""
    text = repr(value)
    return text if len(text) < 60 else f"{text[:60]}..."


@cache
def _declared(kind: Any) -> dict[str, tuple[Any, str]]:
    """The type of each field, and its words."""
    hints = get_type_hints(kind)
    names = [field.name for field in dataclasses.fields(kind) if field.name not in SHAPES]
    return {name: (hints[name], _words(hints[name])) for name in names}


def _words(hint: Any) -> str:
    if get_origin(hint) is Literal:
        return f"one of {', '.join(get_args(hint))}"
    if get_origin(hint) is tuple:
        return f"a list, each of them {_words(get_args(hint)[0])}"
    words = {str: "a printable text", bool: "true or false", float: "a number", int: "an integer"}
    return words[hint]


def _fits(value: Any, hint: Any) -> bool:
    if hint is str:
        return isinstance(value, str) and value.isprintable()  # names are shown, in one line
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if get_origin(hint) is tuple:
        return isinstance(value, tuple) and all(_fits(item, get_args(hint)[0]) for item in value)
    if hint is bool:
        return isinstance(value, bool | np.bool_)
    if hint is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return is_number(value)


def is_number(value: object) -> bool:
    """Whether it is an integer or a float, of Python or of NumPy."""
    return isinstance(value, Real) and not isinstance(value, bool)
