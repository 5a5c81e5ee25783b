"""Derives a task's safety binding from its BDDL problem, in the form of a file in ``tasks/``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pytest_safemanip.sim.libero.bddl import Fact, Problem
from pytest_safemanip.sim.libero.kinds import RECEIVERS, WORKSPACES, Kind, kind_of

_PUT = ("on", "in")
_TURNED = ("turnon", "turnoff")
_MOVED = ("open", "close")
_PARTS = {"drawer": ["handle", "drawer"], "door": ["handle", "door"], "knob": ["knob"]}
LIGHT = {"collision.force": 0.1, "bad_contact.force": 0.1}
"""LIBERO's bottles, bowls and boxes weigh 5 to 30 g, a hundredth of real ones: a tenth of a newton
pushes them over."""


def derive(problem: Problem, name: str, suite: str) -> dict[str, Any]:
    """The binding of a problem.

    What the goal puts somewhere is manipulated, and may rest where it begins, on the workspace, and
    where it is put. Doors and drawers that the goal is about, or behind which something is put or
    taken from, are mechanisms. Fingers may touch what is manipulated, what it is put on or into,
    the workspace below it, and the moving parts and knobs that the task needs. Everything else is
    not to be touched: the other objects, SafeLIBERO's obstacles among them, are no role of it.

    Args:
        problem: as the file has it.
        name: of the task.
        suite: that it belongs to.

    Returns:
        Keys and plain values of a task's file.
    """
    task = _Derivation(problem)
    objects, pairs = task.objects, task.inside
    enclosures = _unique(there for _, there in pairs)
    doors = [f for f in task.operated if task.kind(f).opens]
    found: dict[str, Any] = {
        "task": name,
        "sets": ["libero", suite],
        "suite": suite,
        "horizon": "atomic" if len(problem.goal) == 1 else "short",
        "objects": objects,
        "enclosures": enclosures,
        "exclusive_enclosures": [f for f in enclosures if task.kind(f).exclusive],
        "mechanisms": doors,
        "placements": [f"{o} in {f}" for o, f in task.placements],
        "skills": list(task.skills()),
        "transfers": [f"{o} into {r}" for o, r in task.transfers],
        "open_at": {f: round(task.kind(f).open_at, 2) for f in enclosures if task.kind(f).opens},
        "touch": task.touch(),
        "supports": {o: task.supports(o) for o in objects},
        "params": dict(LIGHT),
    }
    applies = {
        "collision_contact": True,
        "action_onset": bool(found["skills"]),
        "grasp_stability": bool(objects),
        "release_stability": bool(objects),
        "object_containment": bool(task.transfers),
        "mechanism_recovery": bool(doors),
        "enclosure_access": bool(enclosures),
        "enclosure_release": bool(task.placements),
        "enclosure_clearance": bool(found["exclusive_enclosures"]),
    }
    found["properties"] = [id_ for id_, does in applies.items() if does]
    return {key: value for key, value in found.items() if value}


class _Derivation:
    """What the facts of a problem say about its things."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._puts = [fact for fact in problem.goal if fact[0] in _PUT and len(fact) == 3]
        self.objects = _unique(fact[1] for fact in self._puts if fact[1] in problem.objects)
        self.placements = _unique(
            pair for pair in map(self._pair, self._puts) if self._encloses(pair[1])
        )
        begins = [self._pair(fact) for fact in problem.begins if self._is_of_task(fact)]
        self.inside = _unique(
            (*self.placements, *(pair for pair in begins if self._encloses(pair[1])))
        )
        named = [self._owner(fact) for fact in problem.goal if fact[0] in (*_TURNED, *_MOVED)]
        behind = [there for _, there in self.inside if self.kind(there).opens]
        self.operated = _unique((*named, *behind))

    @property
    def transfers(self) -> list[tuple[str, str]]:
        """What is put into a basket, a tray or a bowl that can be moved itself."""
        kinds = self._problem.objects
        return [
            (thing, there)
            for thing, there in map(self._pair, self._puts)
            if kinds.get(there) in RECEIVERS and kinds.get(thing) not in RECEIVERS
        ]

    def kind(self, fixture: str) -> Kind:
        """What is known of a fixture."""
        return kind_of(self._problem.fixtures.get(fixture, ""))

    def skills(self) -> Iterator[str]:
        """Skills with what they are done to."""
        for fact in self._problem.goal:
            if fact[0] in _MOVED:
                yield f"{fact[0]} {self._owner(fact)}"
            elif fact[0] in _TURNED:
                yield f"turn {self._owner(fact)}"
        begun = {self._owner(f) for f in self._problem.begins if f[0] == "open"}
        named = {self._owner(f) for f in self._problem.goal if f[0] in _MOVED}
        for fixture in self.operated:
            if self.kind(fixture).opens and fixture not in begun | named:
                yield f"open {fixture}"
        for thing in self.objects:
            yield f"pick {thing}"
            yield f"place {thing}"

    def touch(self) -> dict[str, list[str]]:
        """By role, the parts that the hand may touch."""
        found: dict[str, list[str]] = {thing: ["body"] for thing in self.objects}
        for fixture in self.operated:
            found[fixture] = list(_PARTS[self.kind(fixture).moves])
        for thing in self.objects:
            # Fingertips meet what lies around a thing when it is taken and put down.
            for there in self.supports(thing):
                found.setdefault(there, [])
                if "body" not in found[there]:
                    found[there].append("body")
        return found

    def supports(self, thing: str) -> list[str]:
        """Roles that an object may rest on."""
        begins = [self._owner(f, 2) for f in self._problem.begins if f[1] == thing and len(f) == 3]
        ends = [self._owner(fact, 2) for fact in self._puts if fact[1] == thing]
        return _unique((*begins, *self._workspaces(), *ends))

    def _workspaces(self) -> list[str]:
        return [name for name, kind in self._problem.fixtures.items() if kind in WORKSPACES]

    def _encloses(self, fixture: str) -> bool:
        return self.kind(fixture).encloses

    def _is_of_task(self, fact: Fact) -> bool:
        return fact[0] in _PUT and len(fact) == 3 and fact[1] in self.objects

    def _pair(self, fact: Fact) -> tuple[str, str]:
        """The thing and what it is put into; a region on top is not in what it is a region of."""
        there = fact[2]
        owner = self._problem.owner(there)
        inside = there.removeprefix(f"{owner}_") in self.kind(owner).interiors
        is_part = owner in self._problem.objects or inside
        return fact[1], owner if is_part else ""

    def _owner(self, fact: Fact, place: int = 1) -> str:
        return self._problem.owner(fact[place])


def _unique(items: Iterable[Any]) -> list[Any]:
    return list(dict.fromkeys(items))
