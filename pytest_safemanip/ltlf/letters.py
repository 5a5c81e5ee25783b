"""Values of the atoms at a step, packed into a letter: bit i is the value of atom i.

Everything that comes from outside is checked here: a monitor never guesses a value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.ltlf.formula import And, Atom, Constant, Formula, Iff, Implies, Not, Or

BoolArray = npt.NDArray[np.bool_]
Letters = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]

_MANY_COMPARISONS = 16  # small integers compare tens of times faster than they index


def letter_of(step: Mapping[str, bool] | int, atoms: tuple[str, ...]) -> int:
    """The letter of one step, given as values by atom or as a letter already.

    Raises:
        TraceError: an atom is unknown or missing, a value is not a boolean, or a letter has bits
            that no atom owns.
    """
    if isinstance(step, Mapping):
        return _letter_of_mapping(step, atoms)
    if isinstance(step, bool | np.bool_) or not isinstance(step, int | np.integer):
        raise TraceError(
            f"a step is a mapping from atom to bool, or a bitmask; found {type(step).__name__}"
        )
    if not 0 <= step < 1 << len(atoms):
        raise TraceError(f"bitmask {step} does not fit {len(atoms)} atoms: {', '.join(atoms)}")
    return int(step)


def _letter_of_mapping(step: Mapping[str, bool], atoms: tuple[str, ...]) -> int:
    letter = 0
    for bit, name in enumerate(atoms):
        if name not in step:
            raise TraceError(f"no value for atom {name!r}; given: {', '.join(map(str, step))}")
        value = step[name]
        if not isinstance(value, bool | np.bool_):
            raise TraceError(f"atom {name!r}: expected a boolean, found {value!r}")
        letter |= bool(value) << bit
    if len(step) > len(atoms):
        unknown = next(str(name) for name in step if name not in atoms)
        raise TraceError(f"unknown atom {unknown!r}; {did_you_mean(unknown, atoms)}")
    return letter


def letters_of(
    trace: Sequence[Mapping[str, bool] | int] | BoolArray, atoms: tuple[str, ...]
) -> list[int]:
    """The letters of a trace.

    Args:
        trace: a sequence of steps, or an array bool[T, atoms].
        atoms: names of the atoms, bit 0 first.

    Raises:
        TraceError: the trace is empty, or a step is not as `letter_of` wants it.
    """
    if isinstance(trace, np.ndarray):
        check_values(trace, (None, len(atoms)), atoms)
        letters: list[int] = pack(trace).tolist()
        return letters
    if len(trace) == 0:
        raise TraceError("empty trace: LTLf speaks about traces with at least one step")
    found = []
    for number, step in enumerate(trace):
        try:
            found.append(letter_of(step, atoms))
        except TraceError as error:
            raise TraceError(f"step {number}: {error}") from None
    return found


def check_values(values: object, shape: tuple[int | None, ...], atoms: tuple[str, ...]) -> None:
    """Refuse an array that is no trace.

    Args:
        values: what should be a boolean array, steps first, atoms last.
        shape: the length of each axis; None where any will do.
        atoms: names of the atoms, for the message.

    Raises:
        TraceError: not an array, not boolean, another shape, or no step.
    """
    if not isinstance(values, np.ndarray) or values.dtype != np.bool_:
        found = f"an array of {values.dtype}" if isinstance(values, np.ndarray) else repr(values)
        raise TraceError(f"expected a boolean array of proposition values, found {found}")
    fits = values.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, values.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("any" if want is None else str(want) for want in shape)
        raise TraceError(
            f"expected values of shape ({wanted}), found {values.shape}; "
            f"the last axis is the atoms: {', '.join(atoms) or 'none'}"
        )
    if shape[0] is None and len(values) == 0:
        raise TraceError("empty trace: LTLf speaks about traces with at least one step")


def packed(values: BoolArray | Letters, instances: int, atoms: tuple[str, ...]) -> Letters:
    """Letters of a trace's instances, which may be letters already: uint[T, I].

    Args:
        values: bool[T, I, atoms] or uint[T, I].
        instances: I.
        atoms: names of the atoms, bit 0 first.

    Raises:
        TraceError: not of that form, or no step; or a letter has bits that no atom owns.
    """
    found: Any = values
    if not isinstance(found, np.ndarray) or found.dtype.kind != "u":
        check_values(found, (None, instances, len(atoms)), atoms)
        return pack(found)
    fits = found.ndim == 2 and found.shape[1] == instances and len(found) > 0
    if not fits or int(found.max()) >> len(atoms):
        raise TraceError(
            f"letters of shape {found.shape}: expected one for each of {instances} instances at "
            f"every step, of {len(atoms)} bits: {', '.join(atoms)}"
        )
    letters: Letters = found
    return letters


def pack(values: BoolArray) -> Letters:
    """Letters of an array whose last axis is the atoms: bool[..., atoms] to uint[...]."""
    letters = no_letters(values.shape[:-1], values.shape[-1])
    for bit in reversed(range(values.shape[-1])):  # highest first: one doubling per atom
        letters += letters
        letters |= values[..., bit].view(np.uint8)
    return letters


def no_letters(shape: tuple[int, ...], atoms: int) -> Letters:
    """Letters of which every atom is False."""
    return np.zeros(shape, np.uint16) if atoms > 8 else np.zeros(shape, np.uint8)


def lifted(values: BoolArray, atom: int, letters: Letters) -> Letters:
    """Values of an atom (K,) where it has its bit in letters."""
    found: Letters = values * letters.dtype.type(1 << atom)
    return found


class NumberSet:
    """A set of numbers from 0 up, with a vectorised membership test.

    Args:
        wanted: bool[numbers], whether each is in the set.
    """

    def __init__(self, wanted: BoolArray) -> None:
        self._wanted = wanted
        self._inverted = bool(2 * np.count_nonzero(wanted) > len(wanted))
        self._chosen: list[int] = np.flatnonzero(wanted != self._inverted).tolist()

    def among(self, numbers: npt.NDArray[np.unsignedinteger[Any]]) -> BoolArray:
        """Which numbers are in the set: bool like `numbers`."""
        if not self._chosen:
            return np.full(numbers.shape, self._inverted)
        if len(self._chosen) > _MANY_COMPARISONS:
            found: BoolArray = self._wanted[numbers]
            return found
        found = numbers == self._chosen[0]
        for number in self._chosen[1:]:
            found |= numbers == number
        return np.logical_not(found, out=found) if self._inverted else found


def truth_table(formula: Formula, atoms: tuple[str, ...]) -> BoolArray:
    """Value of a propositional formula for every letter: bool[2 ** atoms]."""
    letters = np.arange(1 << len(atoms))

    def value(part: Formula) -> BoolArray:
        match part:
            case Constant(constant):
                return np.full(letters.shape, constant)
            case Atom(name):
                return (letters >> atoms.index(name) & 1).astype(np.bool_)
            case Not(p):
                return ~value(p)
            case And(p, q):
                return value(p) & value(q)
            case Or(p, q):
                return value(p) | value(q)
            case Implies(p, q):
                return ~value(p) | value(q)
            case Iff(p, q):
                return ~(value(p) ^ value(q))
        raise AssertionError(f"{type(part).__name__} is not propositional")

    return value(formula)
