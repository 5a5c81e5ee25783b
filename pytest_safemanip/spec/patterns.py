"""Specification patterns: temporal rules by name instead of by formula.

A pattern is a function from the text of propositional formulas to the text of an LTLf formula. Its
positional parameters are the pattern's arguments, its keyword parameters further keys of the YAML
file. Sources: Dwyer, Avrunin and Corbett (ICSE 1999), Konrad and Cheng (ICSE 2005) for those with
durations, Menghi et al. (IEEE TSE 2021) for robots. Over finite traces "again and again" needs a
bound, and what a rollout is too short for is not broken: there bounds end with the trace.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from pytest_safemanip.errors import did_you_mean
from pytest_safemanip.ltlf import FormulaError, parse
from pytest_safemanip.ltlf.formula import Atom, Bound, Constant, Formula, is_propositional
from pytest_safemanip.spec.scopes import SCOPES

MOST_TIMES = 8
"""Occurrences that are counted: each is two states of the automaton."""
MOST_ARGUMENTS = 6
_CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\((.*)\))?\s*", re.DOTALL)

DWYER = "Dwyer et al. 1999"
DURATIONS = "Konrad and Cheng 2005"
ROBOTS = "Menghi et al. 2021"


@dataclass(frozen=True)
class Pattern:
    """A pattern.

    Attributes:
        name: as in YAML.
        source: where it comes from.
        text: the formula's text, from the text of the arguments and the keys.
        every: whether it holds from every step on if it holds from the first.
        trigger: which argument puts it to the test; None: it is always tested.
        examples: three traces of steps of a second, the first of which keeps to it and the second
            does not; steps are separated by spaces, letters hold, `-` is none.
        keys: further keys of the examples.
    """

    name: str
    source: str
    text: Callable[..., str]
    every: bool
    trigger: int | None
    examples: tuple[str, str, str]
    keys: Mapping[str, float]

    @property
    def says(self) -> str:
        """What it asks."""
        return str(inspect.getdoc(self.text))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Names of the arguments that there have to be."""
        kinds = inspect.signature(self.text).parameters.values()
        return tuple(p.name for p in kinds if p.kind is p.POSITIONAL_OR_KEYWORD)

    @cached_property
    def any_number(self) -> bool:
        """Whether there may be more arguments than parameters."""
        kinds = inspect.signature(self.text).parameters.values()
        return any(p.kind is p.VAR_POSITIONAL for p in kinds)

    @cached_property
    def options(self) -> dict[str, bool]:
        """Its further keys, and whether each is required."""
        kinds = inspect.signature(self.text).parameters.values()
        return {p.name: p.default is p.empty for p in kinds if p.kind is p.KEYWORD_ONLY}

    def formula(self, arguments: Sequence[Formula], keys: Mapping[str, float]) -> Formula:
        """The formula over the whole trace.

        Args:
            arguments: propositional formulas, as many as there are parameters.
            keys: seconds and counts by key.
        """
        written = [str(a) if isinstance(a, Atom | Constant) else f"({a})" for a in arguments]
        return parse(self.text(*written, **keys))


PATTERNS: dict[str, Pattern] = {}
"""All patterns, by name."""


def _pattern(
    source: str,
    *examples: str,
    every: bool = False,
    trigger: int | None = None,
    **keys: float,
) -> Callable[[Callable[..., str]], Callable[..., str]]:
    def register(text: Callable[..., str]) -> Callable[..., str]:
        kept, broken, third = examples
        name = text.__name__
        PATTERNS[name] = Pattern(name, source, text, every, trigger, (kept, broken, third), keys)
        return text

    return register


def _bound(seconds: float | None) -> str:
    return "" if seconds is None else str(Bound(0.0, seconds))


@_pattern(DWYER, "- - -", "- p -", "p p -", every=True)
def absence(p: str) -> str:
    """`p` never holds."""
    return f"G !{p}"


@_pattern(DWYER, "p p p", "p - p", "- - -", every=True)
def universality(p: str) -> str:
    """`p` always holds."""
    return f"G {p}"


@_pattern(DWYER, "- - p -", "- - - - p", "- -", within_s=3)
def existence(p: str, *, within_s: float | None = None) -> str:
    """`p` holds at some step (within `within_s` seconds)."""
    return f"F{_bound(within_s)} {p}"


@_pattern(DWYER, "- p p - p", "p - p - p", "- - -", at_most=2)
def bounded_existence(p: str, *, at_most: float) -> str:
    """`p` begins to hold at most `at_most` times."""
    text = f"G !{p}"
    for _ in range(int(at_most)):
        text = f"(!{p} W ({p} W ({text})))"
    return text


@_pattern(DWYER, "p - p", "p p -", "p -", at_least=2)
def repeated_existence(p: str, *, at_least: float) -> str:
    """`p` begins to hold at least `at_least` times."""
    text = f"F {p}"
    for _ in range(int(at_least) - 1):
        text = f"F ({p} & F (!{p} & {text}))"
    return text


@_pattern(DWYER, "- s - p", "- p s", "- s -", trigger=1)
def precedence(s: str, p: str) -> str:
    """Before `p`, or with it, there was `s`."""
    return f"!{p} W {s}"


@_pattern(DWYER, "s t - p", "t s - p", "s - -", trigger=2)
def precedence_chain_2_1(s: str, t: str, p: str) -> str:
    """Before `p` there was `s`, and after that, at the latest with `p`, `t`."""
    return f"!{p} W ({s} & !{p} & WX (!{p} W {t}))"


@_pattern(DWYER, "p s t", "s t p", "s - -", trigger=1)
def precedence_chain_1_2(p: str, s: str, t: str) -> str:
    """Before an `s` that a `t` follows, or with it, there was `p`."""
    return f"F ({s} & X F {t}) -> (!{s} U {p})"


@_pattern(DWYER, "p - s p s", "p - - - s", "p -", every=True, trigger=0, within_s=2)
def response(p: str, s: str, *, within_s: float | None = None) -> str:
    """After every `p`, or with it, comes `s` (within `within_s` seconds)."""
    return f"G ({p} -> F{_bound(within_s)} {s})"


@_pattern(DWYER, "p s - t", "p t s -", "- -", every=True, trigger=0)
def response_chain_1_2(p: str, s: str, t: str) -> str:
    """After every `p` comes `s`, and after that `t`."""
    return f"G ({p} -> F ({s} & X F {t}))"


@_pattern(DWYER, "s t - p", "s t - -", "s - p", every=True, trigger=0)
def response_chain_2_1(s: str, t: str, p: str) -> str:
    """After every `s` that a `t` follows comes, after or with that `t`, a `p`."""
    return f"G (({s} & X F {t}) -> X F ({t} & F {p}))"


@_pattern(DURATIONS, "- p p p -", "- p p - -", "- p p", trigger=0, for_s=2)
def minimum_duration(p: str, *, for_s: float) -> str:
    """Once `p` begins to hold it holds for `for_s` seconds at least."""
    stays = f"({p} -> G{_bound(for_s)} {p})"
    return f"{stays} & G (!{p} -> WX {stays})"


@_pattern(DURATIONS, "- p p - p", "p p p p", "- p p", every=True, trigger=0, within_s=2)
def maximum_duration(p: str, *, within_s: float) -> str:
    """Whenever `p` holds it ends within `within_s` seconds."""
    return f"G ({p} -> F{_bound(within_s)} (!{p} | last))"


@_pattern(DURATIONS, "- p - p -", "p - - - p", "- -", every=True, within_s=2)
def recurrence(p: str, *, within_s: float) -> str:
    """From every step on `p` comes within `within_s` seconds."""
    return f"G F{_bound(within_s)} ({p} | last)"


@_pattern(ROBOTS, "b - a", "a - -", "- -")
def visit(a: str, b: str, *more: str) -> str:
    """Each of `a`, `b`, ... holds at some step."""
    return " & ".join(f"F {place}" for place in (a, b, *more))


@_pattern(ROBOTS, "b a - b", "b a - -", "- -")
def sequenced_visit(a: str, b: str, *more: str) -> str:
    """`a` comes, then (or with it) `b`, ...; they may have come before, too."""
    places = (a, b, *more)
    text = places[-1]
    for place in reversed(places[:-1]):
        text = f"({place} & F {text})"
    return f"F {text}"


@_pattern(ROBOTS, "a - b", "b a b", "a -")
def ordered_visit(a: str, b: str, *more: str) -> str:
    """`a`, `b`, ... come in this order, none before the one in front of it."""
    places = (a, b, *more)
    order = [f"(!{then} U {first})" for first, then in pairwise(places)]
    return " & ".join([sequenced_visit(*places), *order])


@_pattern(ROBOTS, "a b a b", "a b b b b b", "a -", every=True, within_s=3)
def patrolling(a: str, b: str, *more: str, within_s: float) -> str:
    """From every step on each of `a`, `b`, ... comes within `within_s` seconds."""
    return " & ".join(f"({recurrence(place, within_s=within_s)})" for place in (a, b, *more))


@_pattern(ROBOTS, "- a p p", "p - a", "- a -", every=True, trigger=0)
def future_avoidance(p: str, a: str) -> str:
    """From `p` on `a` never holds."""
    return f"G ({p} -> G !{a})"


@_pattern(ROBOTS, "- p a", "a - p", "- -", trigger=1)
def past_avoidance(p: str, a: str) -> str:
    """`a` does not hold before `p` has come."""
    return f"!{a} W {p}"


@_pattern(ROBOTS, "- ps -", "p s -", "- s -", every=True, trigger=0)
def instantaneous_reaction(p: str, s: str) -> str:
    """Whenever `p` holds so does `s`."""
    return f"G ({p} -> {s})"


@_pattern(ROBOTS, "- p s", "p - s", "- p", every=True, trigger=0)
def prompt_reaction(p: str, s: str) -> str:
    """At the step after `p`, if there is one, `s` holds."""
    return f"G ({p} -> WX {s})"


@_pattern(ROBOTS, "- ps -", "p s -", "- s -", every=True)
def bound_reaction(p: str, s: str) -> str:
    """`s` holds exactly when `p` holds."""
    return f"G ({p} <-> {s})"


@_pattern(ROBOTS, "s s p", "s - p", "s s", every=False)
def wait(s: str, p: str) -> str:
    """`s` holds until `p` comes, and `p` comes."""
    return f"{s} U {p}"


@dataclass(frozen=True, slots=True)
class Asked:
    """What a pattern asks of a stretch of a trace.

    Attributes:
        formula: over the whole trace.
        every: whether it holds from every step on if it holds from the first.
        trigger: the propositional formula that puts it to the test; None: it is always tested.
    """

    formula: Formula
    every: bool
    trigger: Formula | None

    def within(self, scope: str) -> Asked:
        """The same, asked of the stretches of a scope only.

        Args:
            scope: such as ``globally`` or ``between(opened, shut)``.

        Raises:
            FormulaError: the scope is unknown, or has other arguments.
        """
        name, events = _called(scope)
        if name not in SCOPES:
            raise FormulaError(f"unknown scope {name!r}; {did_you_mean(name, SCOPES)}")
        chosen = SCOPES[name]
        needed = chosen.events.split()
        _check_count(name, events, needed, len(needed))
        if chosen.opens is None:
            return self
        formula = chosen.build(self.formula, self.every, events)
        return Asked(formula, self.every, chosen.opens(events))


def read_pattern(text: str, keys: Mapping[str, float]) -> Asked:
    """What a pattern asks.

    Args:
        text: such as ``response(obj_released, settled)``.
        keys: the pattern's further keys: seconds and counts.

    Raises:
        FormulaError: the pattern is unknown, or has other arguments or keys.
    """
    name, arguments = _called(text)
    if name not in PATTERNS:
        raise FormulaError(f"unknown pattern {name!r}; {did_you_mean(name, PATTERNS)}")
    chosen = PATTERNS[name]
    most = MOST_ARGUMENTS if chosen.any_number else len(chosen.parameters)
    _check_count(name, arguments, chosen.parameters, most)
    _check_keys(chosen, keys)
    trigger = None if chosen.trigger is None else arguments[chosen.trigger]
    return Asked(chosen.formula(arguments, keys), chosen.every, trigger)


def _called(text: str) -> tuple[str, list[Formula]]:
    """The name and the arguments of `NAME(FORMULA, ...)`, or of `NAME`."""
    match = _CALL.fullmatch(text)
    if not match:
        raise FormulaError(f"expected NAME(FORMULA, ...), found {text!r}")
    if match[2] is None:
        return match[1], []
    arguments, offset = [], match.start(2)
    for part in match[2].split(","):
        argument = parse(" " * offset + part)  # so that errors name the column of the whole text
        if not is_propositional(argument):
            raise FormulaError(
                f"column {offset + 1}: {part.strip()!r} has a temporal operator; a pattern's "
                "arguments say what holds at a step"
            )
        arguments.append(argument)
        offset += len(part) + 1
    return match[1], arguments


def _check_count(name: str, found: Sequence[Formula], needed: Sequence[str], most: int) -> None:
    if not len(needed) <= len(found) <= most:
        wanted = ", ".join((*needed, "...")[: most + (most > len(needed))])
        shape = f"{name}({wanted})" if wanted else name
        raise FormulaError(f"expected {shape}, found {len(found)} between the parentheses")


def _check_keys(pattern: Pattern, keys: Mapping[str, float]) -> None:
    for key, required in pattern.options.items():
        if required and key not in keys:
            raise FormulaError(f"pattern {pattern.name!r} needs {key!r}")
    for key in keys:
        if key in COUNTS and keys[key] not in range(1, MOST_TIMES + 1):
            raise FormulaError(f"{key!r}: expected 1 to {MOST_TIMES}, found {keys[key]:g}")
        if key not in pattern.options:
            takes = ", ".join(pattern.options) or "none of these keys"
            raise FormulaError(f"pattern {pattern.name!r} takes no {key!r}; it takes {takes}")


COUNTS = frozenset({"at_least", "at_most"})
KEYS = tuple(dict.fromkeys(key for pattern in PATTERNS.values() for key in pattern.options))
"""Keys that some pattern takes."""
