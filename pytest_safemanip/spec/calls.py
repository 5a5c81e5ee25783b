"""Propositions as they are written in YAML, and the variables that they are about."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.spec.yamlfile import Section

# What `for_each` can range over, with the number of variables: the relations of a task's binding.
RELATIONS: Mapping[str, int] = MappingProxyType(
    {
        "objects": 1,
        "enclosures": 1,
        "exclusive_enclosures": 1,
        "mechanisms": 1,
        "tools": 1,
        "skills": 2,
        "placements": 2,
        "transfers": 2,
    }
)

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_FOR_EACH = re.compile(r"\s*(.+?)\s+in\s+(\S+)\s*")
_CALL = re.compile(r"([A-Za-z_]\w*)(?:\(([^()]+)\))?")


@dataclass(frozen=True, slots=True)
class PropositionCall:
    """A proposition with its arguments: `obj_inside(o, f)`."""

    name: str
    arguments: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.arguments)})" if self.arguments else self.name


def read_for_each(section: Section) -> tuple[tuple[str, ...], str | None]:
    """The variables of the key `for_each` and the relation they range over.

    Returns:
        No variables and None if there is no such key.

    Raises:
        ConfigError: the value is not `VARIABLE, ... in RELATION`, or the relation is unknown or
            has another number of variables.
    """
    if "for_each" not in section:
        return (), None
    text = section.string("for_each")
    match = _FOR_EACH.fullmatch(text)
    if not match:
        raise section.error("for_each", f"expected 'VARIABLE, ... in RELATION', found {text!r}")
    variables = tuple(part.strip() for part in match[1].split(","))
    relation = match[2]
    if relation not in RELATIONS:
        hint = did_you_mean(relation, RELATIONS)
        raise section.error("for_each", f"unknown relation {relation!r}; {hint}")
    for variable in variables:
        if not _NAME.fullmatch(variable) or variables.count(variable) > 1:
            raise section.error("for_each", f"{variable!r} cannot be a variable here")
    if len(variables) != RELATIONS[relation]:
        wanted = RELATIONS[relation]
        raise section.error(
            "for_each", f"{relation!r} needs {_count(wanted, 'variable')}, found {len(variables)}"
        )
    return variables, relation


def read_call(
    section: Section, key: str, names: Collection[str], known: Mapping[str, int] | None
) -> PropositionCall:
    """The proposition that a key stands for.

    Args:
        section: where the key is.
        key: the key.
        names: what may be an argument.
        known: number of arguments of every proposition there is; None leaves the names unchecked.

    Raises:
        ConfigError: the value is no proposition, an argument or the proposition is unknown, or
            the number of arguments is another one.
    """
    text = section.string(key).strip()
    match = _CALL.fullmatch(text)
    if not match:
        raise section.error(key, f"expected a proposition such as 'settled(o)', found {text!r}")
    name, listed = match[1], match[2]
    arguments = tuple(part.strip() for part in listed.split(",")) if listed is not None else ()
    for argument in arguments:
        if argument not in names:
            hint = did_you_mean(argument, names) if names else "'for_each' binds no variable"
            raise section.error(key, f"unknown argument {argument!r} in {text!r}; {hint}")
    if known is not None and name not in known:
        alike = {f"{k}{text[len(name) :]}" for k, arity in known.items() if arity == len(arguments)}
        hint = did_you_mean(text, alike, "safemanip propositions")
        raise ConfigError(f"{section.place(key)}: unknown proposition {text!r}; {hint}")
    if known is not None and known[name] != len(arguments):
        wanted = _count(known[name], "argument")
        raise section.error(key, f"{name!r} takes {wanted}, found {len(arguments)} in {text!r}")
    return PropositionCall(name, arguments)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
