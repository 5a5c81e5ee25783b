"""Propositions as they are written in YAML."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.propositions.definition import Proposition, check_value
from pytest_safemanip.spec.objects import ATTRIBUTES
from pytest_safemanip.spec.yamlfile import Section

_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e-?\d+)?")
_CALL = re.compile(r"([A-Za-z_]\w*)(?:\(([^()]+)\))?")


@dataclass(frozen=True, slots=True)
class PropositionCall:
    """A proposition with its arguments, and parameters that it sets: `near(o, f, distance=0.3)`."""

    name: str
    arguments: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()

    def __str__(self) -> str:
        said = ", ".join((*self.arguments, *self.settings))
        return f"{self.name}({said})" if said else self.name


def read_call(
    section: Section,
    key: str,
    names: Collection[str],
    known: Mapping[str, Proposition] | None,
    parameters: Collection[str] | None = None,
) -> PropositionCall:
    """The proposition that a key stands for.

    Args:
        section: where the key is.
        key: the key.
        names: what may be an argument.
        known: every proposition there is; None leaves the names unchecked.
        parameters: names of all their parameters; None leaves those unchecked.

    Raises:
        ConfigError: the value is no proposition, an argument or the proposition is unknown, or
            the number of arguments is another one, or they have to be different.
    """
    text = section.string(key).strip()
    match = _CALL.fullmatch(text)
    if not match:
        raise section.error(key, f"expected a proposition such as 'settled(o)', found {text!r}")
    name, listed = match[1], match[2]
    parts = tuple(part.strip() for part in listed.split(",")) if listed is not None else ()
    arguments = tuple(part for part in parts if "=" not in part)
    settings = tuple(_setting(section, key, name, part) for part in parts[len(arguments) :])
    for argument in arguments:
        if argument not in names:
            hint = did_you_mean(argument, names) if names else "'for_each' binds no variable"
            raise section.error(key, f"unknown argument {argument!r} in {text!r}; {hint}")
    if known is not None and name not in known:
        count = len(arguments)
        alike = {f"{k}{text[len(name) :]}" for k, p in known.items() if len(p.arguments) == count}
        hint = did_you_mean(text, alike, "safemanip propositions")
        if name in ATTRIBUTES:
            hint += f" {name!r} is an attribute, as in 'o in things with {name}'"
        raise ConfigError(f"{section.place(key)}: unknown proposition {text!r}; {hint}")
    if known is not None and len(known[name].arguments) != len(arguments):
        wanted = _count(len(known[name].arguments), "argument")
        raise section.error(key, f"{name!r} takes {wanted}, found {len(arguments)} in {text!r}")
    if known is not None and known[name].distinct and len(set(arguments)) < len(arguments):
        message = f"{text!r} is about {arguments[0]!r} and itself, and always the same; name two"
        raise section.error(key, message)
    given = [setting.partition("=")[0] for setting in settings]
    for own in given:
        if given.count(own) > 1:
            raise section.error(key, f"parameter {own!r} of {name!r} is given twice in {text!r}")
        if parameters is not None and f"{name}.{own}" not in parameters:
            there = [p.partition(".")[2] for p in parameters if p.startswith(f"{name}.")]
            hint = did_you_mean(own, there) if there else "it has none of its own"
            raise section.error(key, f"unknown parameter {own!r} of {name!r}; {hint}")
    return PropositionCall(name, arguments, settings)


def _setting(section: Section, key: str, name: str, text: str) -> str:
    """`KEY=VALUE`, as calls have it."""
    own, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise section.error(key, f"argument {text!r} comes after a parameter that is set")
    if not _NUMBER.fullmatch(value):
        raise section.error(key, f"{own!r} of {name!r}: expected a number above 0, found {value!r}")
    try:
        check_value(f"{name}.{own}", float(value))
    except ConfigError as error:
        raise section.error(key, str(error)) from error
    return f"{own}={float(value):.12g}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
