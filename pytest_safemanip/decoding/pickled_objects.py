"""Builds numpy arrays from a pickle's data without calling numpy's own code.

numpy builds whatever a pickle says, object arrays over foreign bytes among it. Here the few calls
that arrays of numbers consist of are followed by hand, and their bytes are checked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pytest_safemanip.decoding.arrays import DecodingError, array_of


@dataclass(frozen=True)
class Named:
    """A class or function that a pickle names, by module and name. It is never imported."""

    module: str
    name: str


@dataclass
class Type:
    """An array's element type while its byte order is not known yet."""

    code: str
    order: str = "="


@dataclass
class Array:
    """An array under construction."""

    value: Any = None


@dataclass
class Opaque:
    """An object of a known class that is kept as its attributes."""

    attributes: Any = None


_NUMPY = ("numpy.core.multiarray", "numpy._core.multiarray")
_OWN_NAMES = {
    *((module, name) for module in _NUMPY for name in ("_reconstruct", "scalar")),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("_codecs", "encode"),
    ("collections", "OrderedDict"),
    ("__builtin__", "bytes"),
    ("__builtin__", "set"),
}


def known(named: Named) -> bool:
    """Whether it is one of what arrays and plain containers are made with."""
    return (named.module, named.name) in _OWN_NAMES or _is_modality(named)


def _is_modality(named: Named) -> bool:
    return named.module.startswith("gr00t.") and named.name == "ModalityConfig"


def call(target: Named, arguments: list[Any]) -> Any:
    """The result of a known class or function."""
    if _is_modality(target):
        return Opaque()
    if target.name == "_reconstruct":
        return Array()
    if target.name == "dtype":
        return Type(must_be(arguments[0], str))
    if target.name == "OrderedDict" and not arguments:
        return {}
    if target.name == "bytes" and not arguments:
        return b""
    if target.name == "set" and len(arguments) == 1:
        return must_be(arguments[0], list)
    if target.name == "encode" and arguments[1:] == ["latin1"]:
        return must_be(arguments[0], str).encode("latin1")
    if target.name == "scalar" and len(arguments) == 2:
        return array_of(arguments[1], _type_name(arguments[0]), ()).item()
    raise DecodingError(f"a pickle that calls {target.module}.{target.name} in an unknown way")


def array_from(state: list[Any]) -> Any:
    """An array from numpy's own state: version, shape, type, Fortran order, bytes."""
    _, shape, kind, fortran, data = state
    array = array_of(data, _type_name(kind), shape[::-1] if fortran else shape)
    return array.T if fortran else array


def _type_name(kind: Any) -> str:
    known: Type = must_be(kind, Type)
    return known.order + known.code


def byte_order(state: list[Any]) -> str:
    """The byte order in a type's own state; refuses types with fields or sub-arrays."""
    order = must_be(state[1], str)
    if order not in ("<", ">", "=", "|") or any(part is not None for part in state[2:5]):
        raise DecodingError("an array type that is not a number's")
    return str(order)


def must_be(value: Any, kind: type | tuple[type, ...]) -> Any:
    """The value, if it is what an array would have in its place."""
    if not isinstance(value, kind):
        raise DecodingError(f"not a pickle of arrays ({type(value).__name__} is misplaced)")
    return value
