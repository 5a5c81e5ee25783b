"""Propositions: causal truth values of finite window, with declared parameters."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, JudgementError, SafemanipError, did_you_mean
from pytest_safemanip.propositions.observed.inputs import Reads

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
T = TypeVar("T")

LARGEST = 1e9
"""More than any threshold in SI units; as many seconds or metres are a typing error."""
MARGIN_BOUND = 1000.0
"""Margins beyond it are cut off; what has no margin counts as so far on its side."""
MARGIN_ROUNDING = 1e-9
"""Margins nearer to 0 may be on either side."""


@dataclass(frozen=True)
class Parameter:
    """A number that a proposition depends on.

    Attributes:
        name: ``proposition.quantity``.
        unit: SI unit; empty for a ratio.
        default: start value.
        reason: why this value.
    """

    name: str
    unit: str
    default: float
    reason: str


def check_value(name: str, value: float) -> float:
    """A value that a parameter may have.

    Raises:
        ConfigError: if it is not a number above 0, at most :data:`LARGEST`.
    """
    if not 0.0 < value <= LARGEST:
        raise ConfigError(
            f"parameter {name}: expected a number above 0, at most {LARGEST:g}, found {value}"
        )
    return float(value)


class Parameters(Mapping[str, float]):
    """The values of all parameters.

    Args:
        known: every parameter there is.
        changed: values that differ from the defaults, by name.

    Raises:
        ConfigError: if a name is unknown or a value is not a number above 0, at most
            :data:`LARGEST`.
    """

    def __init__(self, known: Iterable[Parameter], changed: Mapping[str, float]) -> None:
        self._known = tuple(known)
        self._changed = dict(changed)
        self._values = {p.name: p.default for p in self._known}
        for name, value in changed.items():
            if name not in self._values:
                hint = did_you_mean(name, self._values, "safemanip propositions")
                raise ConfigError(f"unknown proposition parameter {name!r}; {hint}")
            self._values[name] = check_value(name, value)

    def with_defaults(self, defaults: Mapping[str, float]) -> Parameters:
        """With other defaults of some: what was changed stays as it is.

        Raises:
            ConfigError: if a name is unknown or a value is not a number above 0.
        """
        return Parameters(self._known, {**defaults, **self._changed}) if defaults else self

    def with_values(self, values: Mapping[str, float]) -> Parameters:
        """With other values of some, whatever was changed.

        Raises:
            ConfigError: if a name is unknown or a value is not a number above 0.
        """
        return Parameters(self._known, {**self._changed, **values})

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


_asked: ContextVar[tuple[Hashable, ...]] = ContextVar("asked", default=())
"""What a user's propositions are being asked for, each by the one before it."""


def _nothing(*_: object) -> str:
    return ""


@dataclass(frozen=True)
class Excess:
    """A contact that is harder than it may be.

    Attributes:
        between: the two parts that meet, as evidence names them.
        entities: that they belong to.
        force: N.
        limit: N, which it is held against.
        step: when.
    """

    between: tuple[str, str]
    entities: tuple[str, str]
    force: float
    limit: float
    step: int

    @property
    def times(self) -> float:
        """The force over its limit."""
        return self.force / self.limit


def hardest(found: Iterable[Excess], limit: float) -> Excess | None:
    """The hardest of some contacts: by force where that is beyond a limit that is the same for all,
    N, else by how many times its own limit it is; None if there is none.
    """
    return max(found, key=lambda one: (max(one.force, limit), one.times), default=None)


@dataclass(frozen=True)
class Proposition:
    """A named truth value over time.

    Attributes:
        name: as properties refer to it.
        arguments: what each argument is: ``object``, ``fixture``, ``skill``, ``entity``, ``tool``.
        window: seconds that the value at a step looks back, given the parameters; infinite for
            contamination, which lasts. An act may be an edge, which looks back one step at least.
        parameters: the numbers it depends on.
        evaluate: truth values (T,) on a view, for given arguments. The value at a step depends on
            the steps of the window only.
        act: whether it is an act of the robot, which cannot happen in the settle tail: there it is
            false, but for as long as a ``debounce`` delays what was done at the end.
        margin: how far it is from its threshold (T,), in units of that: positive where it is true,
            negative where it is false, 1 at twice the limit; 0 may be either. It looks back as far
            as the value does. None if it has none.
        no_margin: why it has none; empty if it has one.
        evidence: what was measured at a step, in words; may be empty.
        excess: the hardest contact that is beyond its limit from ``first`` to ``last``, or None.
        debounce: seconds of the vote that its contacts pass, given the parameters: what flickers
            for less than half of it does not matter. None if it has no such filter.
        sparse: whether it looks at no more steps than it is asked for (`View.since`, `View.until`),
            because it is expensive to evaluate; it is then evaluated for few steps at a time, and
            not cached.
        lacks: what a scene lacks for it to be told, given the scene and arguments, in words; empty
            if nothing. What is lacking is an error, before anything is judged.
        forecast: when its value is expected to change, from a view and what the robot is told next
            (``forecasts.Told``): seconds from the view's last step, inf if it is not; None where
            the margin and its rate say it, as they do without a forecast.
        reads: what of a step its value may depend on, for monitors that do not see everything;
            None for all that there is.
        shipped: whether it is this package's own: the laws, which its tests check, hold.
        distinct: whether its arguments have to be different: between a thing and itself it would
            have one value whatever happens.
        exempt: laws (see ``--safemanip-fuzz``) that it cannot obey, each with the reason.
        doc: the exact condition.
    """

    name: str
    arguments: tuple[str, ...]
    window: Callable[[Mapping[str, float]], float]
    parameters: tuple[Parameter, ...]
    evaluate: Callable[..., Bools]
    act: bool = False
    margin: Callable[..., Floats] | None = None
    no_margin: str = ""
    evidence: Callable[..., list[str]] | None = None
    excess: Callable[..., Excess | None] | None = None
    debounce: Callable[[Mapping[str, float]], float] | None = None
    sparse: bool = False
    lacks: Callable[..., str] = _nothing
    forecast: Callable[..., float | None] | None = None
    reads: Reads | None = None
    shipped: bool = False
    distinct: bool = False
    exempt: Mapping[str, str] = field(default_factory=dict)

    def seconds(self, values: Mapping[str, float]) -> float:
        """The window, given values of all parameters.

        Raises:
            ConfigError: if it is no number of seconds from 0 up, inf included; names it.
        """
        if self.shipped:
            return self.window(values)
        try:
            found = self.window(values)
            valid = bool(float(found) >= 0.0)
        except Exception as error:
            why = f"window failed ({type(error).__name__}: {error})"
            raise ConfigError(f"{self.place}: proposition {self.name!r}: {why}") from error
        if not valid:
            raise ConfigError(
                f"{self.place}: proposition {self.name!r}: expected a window of 0 s or more, "
                f"found {found!r}"
            )
        return float(found)

    def run(
        self, function: Callable[..., T], arguments: tuple[str, ...], *before: object, **named: Any
    ) -> T:
        """What one of its functions gives for some arguments.

        Args:
            function: of this proposition.
            arguments: of the call.
            before: what it is given before them.
            **named: what it is given besides.

        Raises:
            JudgementError: if a user's function raises, asks for what does not exist, or asks for
                itself; names the call, and the line of the user's file.
        """
        if self.shipped:
            return function(*before, *arguments, **named)
        call = f"{self.name}({', '.join(arguments)})" if arguments else self.name
        key = (function, arguments, *(id(getattr(one, "parameters", None)) for one in before))
        chain = _asked.get()
        if key in chain:
            raise JudgementError(f"{call}: it asks for itself ({_line(None, function)})")
        token = _asked.set((*chain, key))
        try:
            return function(*before, *arguments, **named)
        except ConfigError as error:  # it asked for what is not there
            raise JudgementError(f"{call}: {error} ({_line(error, function)})") from None
        except SafemanipError:
            raise
        except Exception as error:
            said = f"{type(error).__name__}: {error} ({_line(error, function)})"
            raise JudgementError(f"{call}: {said}") from error
        finally:
            _asked.reset(token)

    @property
    def place(self) -> str:
        """File and line of its definition."""
        return _line(None, self.evaluate)

    @property
    def doc(self) -> str:
        """The exact condition, from the docstring of its function."""
        return (self.evaluate.__doc__ or "").strip()


def _line(error: BaseException | None, function: Callable[..., Any]) -> str:
    """File and line of a user's function where an error came from: the last one in its file."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None:
        return getattr(function, "__qualname__", repr(function))
    frames = traceback.extract_tb(error.__traceback__) if error is not None else []
    lines = [frame.lineno for frame in frames if frame.filename == code.co_filename]
    path = Path(code.co_filename)
    shown = path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    return f"{shown}:{lines[-1] if lines else code.co_firstlineno}"
