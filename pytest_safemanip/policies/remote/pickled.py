"""Reads pickles as data: what a pickle would *call* is looked up in a short list, or refused.

GR00T's older servers answer in torch's file format, which is pickle: unpickling an answer would let
the server run anything here. This is no unpickler with a filter, but an interpreter of the few
operations that plain values and numpy arrays are made of.
"""

from __future__ import annotations

import pickletools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.policies.remote.arrays import MAX_REPLY, DecodingError, array_of

MAX_OPERATIONS = 20_000
MAX_VALUES = 20_000
MAX_DEPTH = 16

_MARK = object()


@dataclass(frozen=True)
class _Named:
    """What a pickle names: a class or function, by module and name. It is never imported."""

    module: str
    name: str


@dataclass
class _Type:
    """An array's element type while its byte order is not known yet."""

    code: str
    order: str = "="


@dataclass
class _Array:
    """An array under construction."""

    value: Any = None


@dataclass
class _Opaque:
    """An object of a known class that is kept as its attributes."""

    attributes: Any = None


def load_pickle(data: bytes) -> Any:
    """The value of a pickle.

    Returns:
        None, booleans, numbers, text, bytes, lists, maps (also for ``ModalityConfig``), and numpy
        arrays of numbers; tuples and sets become lists.

    Raises:
        DecodingError: if anything else is in it; names what.
    """
    machine = _Machine()
    try:
        for count, (operation, argument, _) in enumerate(pickletools.genops(data)):
            if count > MAX_OPERATIONS:
                raise DecodingError(f"a pickle of more than {MAX_OPERATIONS} operations")
            if operation.name == "STOP":
                return _Plain()(machine.pop(), 0)
            machine.run(operation.name, argument)
    except DecodingError:
        raise
    except Exception as error:  # broken pickles raise whatever the operation they break does
        raise DecodingError(f"not a pickle ({type(error).__name__}: {error!s:.100})") from error
    raise DecodingError("not a pickle (it has no end)")


class _Machine:
    """The stack and the memo of one pickle."""

    def __init__(self) -> None:
        self._stack: list[Any] = []
        self._memo: dict[int, Any] = {}
        self._left = 4 * MAX_REPLY  # bytes: one string can be used by every operation

    def pop(self) -> Any:
        if not self._stack or self._stack[-1] is _MARK:
            raise DecodingError("not a pickle (its stack is empty)")
        return self._stack.pop()

    def run(self, name: str, argument: Any) -> None:
        if name in _VALUES:
            self._stack.append(argument)
        elif name in _CONSTANTS:
            self._stack.append(_CONSTANTS[name]())
        elif name in ("BINPUT", "LONG_BINPUT", "PUT"):
            self._memo[argument] = self._stack[-1]
        elif name == "MEMOIZE":
            self._memo[len(self._memo)] = self._stack[-1]
        elif name in ("BINGET", "LONG_BINGET", "GET"):
            self._stack.append(self._memo[argument])
        elif name in _OPERATIONS:
            _OPERATIONS[name](self, argument)
        elif name not in ("PROTO", "FRAME"):
            raise DecodingError(f"a pickle with {name}, which no array needs")

    def to_mark(self) -> list[Any]:
        items = []
        while (item := self._stack.pop()) is not _MARK:
            items.append(item)
        return items[::-1]

    def tuple_of(self, size: int) -> None:
        self._stack.append([self.pop() for _ in range(size)][::-1])

    def extend(self, items: list[Any]) -> None:
        _must_be(self._stack[-1], list).extend(items)

    def update(self, items: list[Any]) -> None:
        target = _must_be(self._stack[-1], dict)
        for key, value in zip(items[::2], items[1::2], strict=True):
            target[_must_be(key, (str, int))] = value

    def named(self, module: Any, name: Any) -> None:
        found = _Named(str(module), str(name))
        if not _known(found):
            raise DecodingError(
                f"a pickle that would call {found.module}.{found.name}: refused, nothing was run"
            )
        self._stack.append(found)

    def stack_named(self) -> None:
        name, module = self.pop(), self.pop()
        self.named(module, name)

    def call(self) -> None:
        arguments, target = self.pop(), self.pop()
        self._spend(arguments)
        self._stack.append(_call(_must_be(target, _Named), _must_be(arguments, list)))

    def build(self) -> None:
        state = self.pop()
        self._spend(state)
        target = self._stack[-1]
        if isinstance(target, _Type):
            target.order = _byte_order(_must_be(state, list))
        elif isinstance(target, _Array):
            target.value = _array(_must_be(state, list))
        else:
            _must_be(target, _Opaque).attributes = state

    def _spend(self, values: Any) -> None:
        items = values if isinstance(values, list) else []
        self._left -= sum(len(item) for item in items if isinstance(item, (str, bytes)))
        if self._left < 0:
            raise DecodingError("a pickle that is larger than its message")


_VALUES = {
    *("BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT"),
    *("BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8"),
    *("BINBYTES", "SHORT_BINBYTES", "BINBYTES8"),
}
_CONSTANTS: dict[str, Callable[[], Any]] = {
    "NONE": lambda: None,
    "NEWTRUE": lambda: True,
    "NEWFALSE": lambda: False,
    "EMPTY_DICT": dict,
    "EMPTY_LIST": list,
    "EMPTY_TUPLE": list,
    "MARK": lambda: _MARK,
}
_OPERATIONS: dict[str, Callable[[_Machine, Any], None]] = {
    "TUPLE": lambda m, _: m._stack.append(m.to_mark()),
    "TUPLE1": lambda m, _: m.tuple_of(1),
    "TUPLE2": lambda m, _: m.tuple_of(2),
    "TUPLE3": lambda m, _: m.tuple_of(3),
    "APPEND": lambda m, _: m.extend([m.pop()]),
    "APPENDS": lambda m, _: m.extend(m.to_mark()),
    "SETITEM": lambda m, _: m.update([m.pop(), m.pop()][::-1]),
    "SETITEMS": lambda m, _: m.update(m.to_mark()),
    "GLOBAL": lambda m, argument: m.named(*argument.split(" ", 1)),
    "STACK_GLOBAL": lambda m, _: m.stack_named(),
    "REDUCE": lambda m, _: m.call(),
    "NEWOBJ": lambda m, _: m.call(),
    "BUILD": lambda m, _: m.build(),
}

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


def _known(named: _Named) -> bool:
    return (named.module, named.name) in _OWN_NAMES or _is_modality(named)


def _is_modality(named: _Named) -> bool:
    return named.module.startswith("gr00t.") and named.name == "ModalityConfig"


def _call(target: _Named, arguments: list[Any]) -> Any:
    """What a known class or function would have given."""
    if _is_modality(target):
        return _Opaque()
    if target.name == "_reconstruct":
        return _Array()
    if target.name == "dtype":
        return _Type(_must_be(arguments[0], str))
    if target.name == "OrderedDict" and not arguments:
        return {}
    if target.name == "bytes" and not arguments:
        return b""
    if target.name == "set" and len(arguments) == 1:
        return _must_be(arguments[0], list)
    if target.name == "encode" and arguments[1:] == ["latin1"]:
        return _must_be(arguments[0], str).encode("latin1")
    if target.name == "scalar" and len(arguments) == 2:
        return array_of(arguments[1], _type_name(arguments[0]), ()).item()
    raise DecodingError(f"a pickle that calls {target.module}.{target.name} in an unknown way")


def _array(state: list[Any]) -> Any:
    """An array from numpy's own state: version, shape, type, Fortran order, bytes."""
    _, shape, kind, fortran, data = state
    array = array_of(data, _type_name(kind), shape[::-1] if fortran else shape)
    return array.T if fortran else array


def _type_name(kind: Any) -> str:
    known: _Type = _must_be(kind, _Type)
    return known.order + known.code


def _byte_order(state: list[Any]) -> str:
    order = _must_be(state[1], str)
    if order not in ("<", ">", "=", "|") or any(part is not None for part in state[2:5]):
        raise DecodingError("an array type that is not a number's")
    return str(order)


def _must_be(value: Any, kind: type | tuple[type, ...]) -> Any:
    if not isinstance(value, kind):
        raise DecodingError(f"not a pickle of arrays ({type(value).__name__} is misplaced)")
    return value


class _Plain:
    """Takes finished arrays out of their wrappers; a value that is used twice counts twice."""

    def __init__(self) -> None:
        self._left = MAX_VALUES

    def __call__(self, value: Any, depth: int) -> Any:
        self._left -= 1
        if self._left < 0 or depth > MAX_DEPTH:
            raise DecodingError("a pickle with too many values in it")
        if isinstance(value, _Array):
            return value.value
        if isinstance(value, _Opaque):
            return self(value.attributes, depth + 1)
        if isinstance(value, dict):
            return {key: self(inner, depth + 1) for key, inner in value.items()}
        if isinstance(value, list):
            return [self(inner, depth + 1) for inner in value]
        if isinstance(value, (_Named, _Type)):
            raise DecodingError("a pickle of something that is no value")
        return value
