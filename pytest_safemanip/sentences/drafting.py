"""Rules as properties: what they range over, and the YAML file."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions.grounding import alternatives
from pytest_safemanip.sentences.grammar import Rule

_KINDS = {
    "object": "objects",
    "fixture": "enclosures, mechanisms",
    "tool": "what can be contaminated: gripper and tools",
    "skill": "skills",
    "entity": "receivers",
}
_VARIABLES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "objects": (("object",), ("o",)),
    "exclusive_enclosures": (("fixture",), ("f",)),
    "enclosures": (("fixture",), ("f",)),
    "mechanisms": (("fixture",), ("f",)),
    "placements": (("object", "fixture"), ("o", "f")),
    "tools": (("tool",), ("r",)),
    "transfers": (("object", "entity"), ("c", "r")),
    "skills": (("skill", "entity"), ("k", "x")),
}
"""Relations of a task: what kinds of entities, and variables for them."""
_MECHANISMS = frozenset({"mech_hit", "retract", "recovered"})
_EXCLUSIVE = frozenset({"item_in_enclosure", "insert_item", "enclosure_cleared"})
_NAMED = frozenset({"objects", "exclusive_enclosures", "enclosures", "mechanisms"})
"""Relations whose members the nouns of a sentence choose among."""
LONGEST_NAME = 48


def draft(sentence: str, rule: Rule, arguments: Mapping[str, Sequence[str]], name: str = "") -> str:
    """The property's YAML text.

    Args:
        sentence: as it was said.
        rule: what it means.
        arguments: kinds of the arguments of each proposition.
        name: the property's id; by default made of the sentence.

    Raises:
        ConfigError: the rule is about entities of which no relation of a task knows which belong
            together, or about different things of one kind.
    """
    relation = _relation(rule.atoms, arguments)
    said = re.sub(r"[\s\\]+", " ", sentence).strip().replace('"', "'")
    lines = [
        f"id: {name or _slug(said)}",
        "category: house_rules",
        f'title: "{said[:1].upper()}{said[1:]}"',
        "source: a sentence",
    ]
    kinds, variables = _VARIABLES[relation] if relation else ((), ())
    if relation:
        among = _among(relation, rule)
        lines.append(f"for_each: {', '.join(variables)} in {among}")
    lines.append(f'pattern: "{rule}"')
    if rule.scope:
        lines.append(f'scope: "{rule.scope}"')
    lines += [f"{key}: {value:g}" for key, value in rule.keys.items()]
    lines.append("atoms:")
    bound = dict(zip(kinds, variables, strict=True))
    for proposition in rule.atoms:
        own = (bound[_kind(kind, kinds)] for kind in arguments[proposition])
        called = ", ".join(own)
        lines.append(f"  {proposition}: {proposition}" + (f"({called})" if called else ""))
    return "\n".join(lines) + "\n"


def _relation(atoms: Iterable[str], arguments: Mapping[str, Sequence[str]]) -> str:
    """The relation that all propositions can range over; empty if none needs one."""
    needed = list(dict.fromkeys(kind for atom in atoms for kind in arguments[atom]))
    if not needed:
        return ""
    # What is said of two of a kind needs variables that no relation has.
    twice = any(len(set(arguments[atom])) < len(arguments[atom]) for atom in atoms)
    for relation, (kinds, _) in _VARIABLES.items():
        found = {_kind(kind, kinds) for kind in needed}
        if set(kinds) == found and not twice and _fits(relation, set(atoms)):
            return relation
    told = " and ".join(_KINDS.get(kind, kind) for kind in needed)
    raise ConfigError(
        f"the sentence is about {told} ({', '.join(atoms)}), and no task says which of them "
        "belong together; say it of one kind of things at a time"
    )


def _among(relation: str, rule: Rule) -> str:
    """What the variable ranges over: members of a relation, those that the sentence names."""
    if relation not in _NAMED:
        return relation
    if relation == "objects" and "touched" in rule.atoms:
        relation = "things"
    clauses = set(rule.nouns.values())
    if len(clauses) > 1:
        named = " and ".join(map(repr, rule.nouns))
        raise ConfigError(
            f"the sentence is about {named}, and a rule has one kind of things; say it of one"
        )
    return " ".join((relation, *filter(None, clauses)))


def _kind(wanted: str, kinds: Sequence[str]) -> str:
    """The one of some kinds of entities that an argument of a kind can be; empty if none can."""
    return next((kind for kind in alternatives(wanted) if kind in kinds), "")


def _fits(relation: str, atoms: Collection[str]) -> bool:
    """Whether a relation of fixtures is the one that these propositions are told for."""
    if relation == "exclusive_enclosures":
        return bool(_EXCLUSIVE & set(atoms))
    if relation == "mechanisms":
        return bool(_MECHANISMS & set(atoms))
    return relation != "enclosures" or not _MECHANISMS & set(atoms)


def _slug(sentence: str) -> str:
    """The words of a sentence; where they are too many the first ones, and its bounds."""
    words = re.findall(r"[a-z0-9]+", sentence.lower().replace("'", ""))
    if len("_".join(words)) <= LONGEST_NAME:
        return _joined(words, LONGEST_NAME)
    bounds = re.findall(r"\d+(?:_\d+)*_[a-z]+", "_".join(words))
    ending = "_".join(bounds)[:LONGEST_NAME]
    head = re.split(r"_(?=\d)", "_".join(words))[0].split("_")
    return "_".join(filter(None, (_joined(head, LONGEST_NAME - len(ending) - 1), ending)))


def _joined(words: Sequence[str], most: int) -> str:
    slug = ""
    for word in words:
        if slug and len(slug) + len(word) >= most:
            break
        slug += ("_" if slug else "") + word
    return slug if slug[:1].isalpha() else f"rule_{slug}"
