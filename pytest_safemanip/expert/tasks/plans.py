"""The expert's plans, from ``plans.yaml`` or a file of the user's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed
from pytest_safemanip.expert.tasks.calls import Call, either
from pytest_safemanip.expert.tasks.search import Search
from pytest_safemanip.expert.tasks.skills import HELD, SKILLS, parse
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.spec.yamlfile import Section, Texts
from pytest_safemanip.spec.yamlfile import load as load_yaml
from pytest_safemanip.spec.yamlfile import parse as parse_yaml

MOST_SKILLS = 60
"""Skills of a plan: a search holds as many copies of the simulator."""
LONGEST = 300
"""Characters of a skill with its roles."""
Errands = Mapping[str, tuple[Call, ...]]
"""Skills by the role of the object that they begin with; what stands nearest comes first."""
Alternatives = tuple[tuple[Call, ...], ...]
"""Skills, or other ones that do instead."""
Entry = Call | Errands | Alternatives


def load(path: Path) -> dict[str, tuple[Entry, ...]]:
    """Plans by task, from a file.

    Raises:
        ConfigError: if it cannot be read, or says something that is no plan.
    """
    return _plans(load_yaml(path))


def read(text: str, path: Path = Path("plans.yaml")) -> dict[str, tuple[Entry, ...]]:
    """Plans by task, from the content of a file.

    Raises:
        ConfigError: if it is not YAML, or says something that is no plan.
    """
    return _plans(parse_yaml(text.encode(), path))


def _plans(section: Section) -> dict[str, tuple[Entry, ...]]:
    found = {}
    for task in section:
        try:
            found[task] = _plan(section.texts(task), section.place(task))
        except _NoPlan as error:
            raise section.error(task, str(error)) from error
    return found


class _NoPlan(ValueError):
    """What is no plan."""


def _plan(texts: Texts, place: str) -> tuple[Entry, ...]:
    if not isinstance(texts, list):
        raise _NoPlan("expected a list of skills, such as [grasp obj, place obj in cab]")
    entries = tuple(_entry(entry, place) for entry in texts)
    if (number := len(calls_of(entries))) > MOST_SKILLS:
        raise _NoPlan(f"{number} skills; a search for a way to do them takes {MOST_SKILLS} at most")
    _check_held(entries)
    return entries


def _check_held(entries: Iterable[Entry]) -> None:
    """Refuse calls with a role twice, and those about what is in the hand that no call before them
    has grasped.

    Raises:
        _NoPlan: if there is one.
    """
    grasped = set[str]()
    for call in calls_of(entries):
        if call.skill.startswith("grasp"):
            grasped.update(call.roles)
        if len({*call.roles}) < len(call.roles):
            raise _NoPlan(f"{call.text!r}: its roles are to differ")
        held = call.roles[HELD[call.skill]] if call.skill in HELD else ""
        if held and held not in grasped:
            raise _NoPlan(f"{call.text!r}: {held} is not in the hand; 'grasp {held}' comes before")


def _entry(entry: Texts, place: str) -> Entry:
    if isinstance(entry, str):
        return _call(entry, place)
    if isinstance(entry, list):
        return tuple(_skills(skills, place) for skills in entry)
    return {role: _skills(skills, place) for role, skills in entry.items()}


def _skills(texts: Texts, place: str) -> tuple[Call, ...]:
    if not isinstance(texts, list):
        raise _NoPlan(f"expected a list of skills, found {texts!r}")
    return tuple(_call(text, place) for text in texts)


def _call(text: Texts, place: str) -> Call:
    if not isinstance(text, str):
        raise _NoPlan(f"expected a skill, found {text!r}; skills are nested once")
    if len(text) > LONGEST:
        raise _NoPlan(f"expected a skill, found {len(text)} characters")
    try:
        return replace(parse(text), place=place)
    except ConfigError as error:
        raise _NoPlan(str(error)) from error


def calls_of(entries: Iterable[Entry]) -> tuple[Call, ...]:
    """All skills of a plan."""
    found = list[Call]()
    for entry in entries:
        if isinstance(entry, Call):
            found.append(entry)
            continue
        groups = entry.values() if isinstance(entry, Mapping) else entry
        found += [call for skills in groups for call in skills]
    return tuple(found)


def plan_of(entries: tuple[Entry, ...]) -> Plan:
    """What does the skills of a plan, in order; where steps can be rehearsed, after a search."""

    def plan(arm: Arm) -> Motion:
        _check_roles(arm, entries)
        if arm.rehearsal is not None:
            yield from Search(
                arm,
                arm.rehearsal,
                lambda entry: ways_on(arm, entry),
                lambda call: _perform(arm, call),
            ).plan(entries)
            return
        left = entries
        while left:
            if not isinstance(left[0], Call):
                left = (*ways_on(arm, left[0])[0], *left[1:])
                continue
            call, left = left[0], left[1:]
            try:
                yield from _perform(arm, call)
            except SkillFailed as error:
                raise SkillFailed(f"{call.text}: {error}") from error

    return plan


def _perform(arm: Arm, call: Call) -> Motion:
    """The motion of a call.

    Raises:
        RolloutError: if a role is a fixture where an object is wanted, or the other way round.
    """
    try:
        yield from SKILLS[call.skill](arm, *call.roles)
    except ConfigError as error:
        raise RolloutError(f"{call.place}: {call.text!r}: {error}") from None


def _check_roles(arm: Arm, entries: tuple[Entry, ...]) -> None:
    """Refuse calls with roles that the task does not have. Of roles with ``or`` between them one is
    enough; so it is of several objects that something is done with, for episodes leave some out.

    Raises:
        RolloutError: if there is one. Other tasks of the file go on.
    """
    roles = arm.scene.roles
    for entry in entries:
        if isinstance(entry, Mapping) and not roles.keys() & entry.keys():
            named, hint = ", ".join(entry), did_you_mean(next(iter(entry)), roles)
            place = calls_of([entry])[0].place
            raise RolloutError(f"{place}: the task has none of the roles {named}; {hint}")
        there = entry
        if isinstance(entry, Mapping):
            there = {role: calls for role, calls in entry.items() if role in roles}
        for call in calls_of([there]):
            for some in either(call):
                if not roles.keys() & {*some}:
                    named, hint = " or ".join(map(repr, some)), did_you_mean(some[0], roles)
                    raise RolloutError(
                        f"{call.place}: {call.text!r}: the task has no role {named}; {hint}"
                    )


def ways_on(arm: Arm, entry: Errands | Alternatives) -> list[tuple[Entry, ...]]:
    """What a part of a plan comes to in the present state, the likeliest first.

    Of things that something is done with, what stands nearer is in the way to what stands behind
    it; some are not there at all.
    """
    if not isinstance(entry, Mapping):
        return list(entry)
    there = [role for role in entry if role in arm.scene.roles]
    roles = sorted(there, key=lambda role: arm.ahead(Thing(arm, role).centre))
    found: list[tuple[Entry, ...]] = []
    for role in roles:
        others = {other: entry[other] for other in roles if other != role}
        found.append((*entry[role], others) if others else entry[role])
    return found or [()]


ENTRIES = read((files("pytest_safemanip.expert.tasks") / "plans.yaml").read_text("utf-8"))
"""By task, as ``plans.yaml`` has them."""

CALLS: Mapping[str, tuple[Call, ...]] = {
    task: calls_of(entries) for task, entries in ENTRIES.items()
}
"""All skills of a plan, by task."""

EXPERT: Mapping[str, Plan] = {task: plan_of(entries) for task, entries in ENTRIES.items()}
"""By task."""
