"""How a plan names a skill and what it is used on: ``turn_on burner of stove under pan``.

A verb comes first. Roles of the task follow, all but the first behind a preposition; a role's place
stands before it, with ``of`` between them. ``by`` is followed by the way of doing it, ``at`` by
where it is done. What is left without the roles is the name of the skill.
"""

from __future__ import annotations

from dataclasses import dataclass, field

PREPOSITIONS = frozenset(
    "and beside between for from in into on or over to under with".split()  # noqa: SIM905
)
LAST = ("by", "at")
"""They come with a word of the skill's own, and last in its name, wherever they stand."""


@dataclass(frozen=True)
class Call:
    """A skill with the roles that it is used on.

    Attributes:
        skill: the skill's name: ``turn_on burner of under``.
        roles: as the call names them, one after the other: ``("stove", "pan")``.
        text: the call itself.
        place: where it is written, ``plans.yaml:7``.
    """

    skill: str
    roles: tuple[str, ...]
    text: str = field(default="", compare=False)
    place: str = field(default="plan", compare=False, repr=False)


def either(call: Call) -> list[tuple[str, ...]]:
    """The roles of a call; those with ``or`` between them, of which one is enough, together."""
    found = [call.roles[:1]]
    words = call.skill.split()[1:]
    if "or" not in words:
        return [(role,) for role in call.roles]
    for word, role in zip(words, call.roles[1:], strict=True):
        found[-1:] = [(*found[-1], role)] if word == "or" else [found[-1], (role,)]
    return found


def read(text: str) -> Call:
    """Take roles and name of the skill apart."""
    words = iter(text.split())
    name, last, roles = [next(words, "")], list[str](), list[str]()
    for word in words:
        if word in LAST:
            last += [word, next(words, "")]
        elif word == "of":
            name += [roles.pop() if roles else "", word]
        elif word in PREPOSITIONS:
            name.append(word)
        else:
            roles.append(word)
    return Call(" ".join(name + last), tuple(roles), text)
