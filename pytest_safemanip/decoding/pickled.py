"""Reads pickles as data: calls in them are looked up in a short list, or refused.

GR00T's older servers answer in torch's file format, which is pickle: unpickling an answer would let
the server run anything here. This is no unpickler with a filter, but an interpreter of the few
operations that plain values and numpy arrays are made of.
"""

from __future__ import annotations

import pickletools
from collections.abc import Callable
from typing import Any

from pytest_safemanip.decoding.arrays import MAX_REPLY, DecodingError
from pytest_safemanip.decoding.pickled_objects import (
    Array,
    Named,
    Opaque,
    Type,
    array_from,
    byte_order,
    call,
    known,
    must_be,
)
from pytest_safemanip.errors import printable

MAX_OPERATIONS = 20_000
MAX_VALUES = 20_000
MAX_DEPTH = 16

_MARK = object()


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
        raise DecodingError(
            f"not a pickle ({type(error).__name__}: {printable(str(error), 100)})"
        ) from error
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
        must_be(self._stack[-1], list).extend(items)

    def update(self, items: list[Any]) -> None:
        target = must_be(self._stack[-1], dict)
        for key, value in zip(items[::2], items[1::2], strict=True):
            target[must_be(key, (str, int))] = value

    def named(self, module: Any, name: Any) -> None:
        found = Named(str(module), str(name))
        if not known(found):
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
        self._stack.append(call(must_be(target, Named), must_be(arguments, list)))

    def build(self) -> None:
        state = self.pop()
        self._spend(state)
        target = self._stack[-1]
        if isinstance(target, Type):
            target.order = byte_order(must_be(state, list))
        elif isinstance(target, Array):
            target.value = array_from(must_be(state, list))
        else:
            must_be(target, Opaque).attributes = state

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


class _Plain:
    """Unwraps finished arrays; a value that is used twice counts twice."""

    def __init__(self) -> None:
        self._left = MAX_VALUES

    def __call__(self, value: Any, depth: int) -> Any:
        self._left -= 1
        if self._left < 0 or depth > MAX_DEPTH:
            raise DecodingError("a pickle with too many values in it")
        if isinstance(value, Array):
            return value.value
        if isinstance(value, Opaque):
            return self(value.attributes, depth + 1)
        if isinstance(value, dict):
            return {key: self(inner, depth + 1) for key, inner in value.items()}
        if isinstance(value, list):
            return [self(inner, depth + 1) for inner in value]
        if isinstance(value, (Named, Type)):
            raise DecodingError("a pickle of something that is no value")
        return value
