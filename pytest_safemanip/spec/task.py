"""A task with its safety binding, in terms of roles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.propositions.binding import OF_DOORS, Binding, Zone
from pytest_safemanip.trace.elements import ROBOT, Entity
from pytest_safemanip.trace.scene import Scene

OBJECTS_FILE = "objects.yaml"
_RELATIONS = ("objects", "mechanisms", "placements", "skills", "transfers", "tools")
"""Those of which an episode may lack members."""


@dataclass(frozen=True, slots=True)
class Task:
    """A task with its safety binding, in terms of roles.

    Attributes:
        name: the task's name, also the backend's name for it unless there is a ``base``.
        path: the file it was read from.
        sets: selections that it belongs to.
        suite: group of the benchmark.
        horizon: horizon class: ``atomic``, ``short``, ``medium``, ``long``.
        properties: ids of the properties that apply.
        objects: roles of manipulated objects.
        enclosures: roles of fixtures that the robot reaches into.
        exclusive_enclosures: those enclosures that take one item at a time.
        mechanisms: roles of fixtures whose doors or drawers it moves.
        placements: (object role, enclosure role).
        skills: (skill, role).
        transfers: (object role, role of the object or fixture that receives it).
        tools: what may carry contamination: ``robot`` (its hand), roles of objects.
        open_at: role to openness that counts as open.
        touch: role to the parts that fingers and palm may touch.
        supports: object role to the roles it may rest on and touch while held.
        upright: roles of objects that must not tip.
        optional: roles of objects that an episode may lack, and of mechanisms whose doors it may.
        not_grounded: why a property that one would expect cannot be judged here, by its id.
        kitchen: which of the compact kitchens has what the task needs.
        object_groups: role to the object groups to draw from in the compact scene.
        params: defaults of propositions' parameters, where they are not the general ones.
        zones: named regions, each around a role.
        hot: roles of objects that are hot when an episode begins.
        liquids: role of a liquid to the role of the object that it is in when an episode begins.
        base: the backend's task whose scene it changes; empty where it is the backend's own.
        staging: what it changes in its scene, in plain values (`spec/staged.py`).
        drawn: role to the categories or groups that its staging draws the object from.
        derived: what a backend derived of it, as the content of a file; empty if nothing did.
    """

    name: str
    path: Path
    sets: tuple[str, ...]
    suite: str
    horizon: str
    properties: tuple[str, ...]
    objects: tuple[str, ...] = ()
    enclosures: tuple[str, ...] = ()
    exclusive_enclosures: tuple[str, ...] = ()
    mechanisms: tuple[str, ...] = ()
    placements: tuple[tuple[str, str], ...] = ()
    skills: tuple[tuple[str, str], ...] = ()
    transfers: tuple[tuple[str, str], ...] = ()
    tools: tuple[str, ...] = ()
    open_at: Mapping[str, float] = field(default_factory=dict)
    touch: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    supports: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    upright: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    not_grounded: Mapping[str, str] = field(default_factory=dict)
    kitchen: str = "small"
    object_groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    zones: Mapping[str, Zone] = field(default_factory=dict)
    hot: tuple[str, ...] = ()
    liquids: Mapping[str, str] = field(default_factory=dict)
    base: str = ""
    staging: tuple[Mapping[str, Any], ...] = ()
    drawn: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    derived: str = ""

    @property
    def simulated(self) -> str:
        """The backend's name of what is simulated."""
        return self.base or self.name

    @property
    def roles(self) -> Mapping[str, tuple[str, ...]]:
        """The roles that its file names, by key; without the robot."""
        return {
            "objects": self.objects,
            "enclosures": self.enclosures,
            "mechanisms": self.mechanisms,
            "placements": tuple(role for pair in self.placements for role in pair),
            "skills": tuple(role for _, role in self.skills),
            "transfers": tuple(role for pair in self.transfers for role in pair),
            "tools": tuple(role for role in self.tools if role != ROBOT),
            "open_at": tuple(self.open_at),
            "touch": tuple(self.touch),
            "supports": tuple(r for key, below in self.supports.items() for r in (key, *below)),
            "upright": self.upright,
            "hot": self.hot,
            "zones": tuple(zone.around for zone in self.zones.values()),
            "liquids": self.filled,
            "staging": tuple(dict.fromkeys((*self.drawn, *(one["role"] for one in self.staging)))),
        }

    @property
    def filled(self) -> tuple[str, ...]:
        """Roles of the objects that liquids are in when an episode begins."""
        return tuple(dict.fromkeys(self.liquids.values()))

    def bind(self, scene: Scene, attributes: Mapping[str, frozenset[str]]) -> Binding:
        """The binding of one episode.

        Args:
            scene: gives the entities that play the roles.
            attributes: of each object category.

        Raises:
            TraceError: if a role or a category is unknown.
        """

        def entity(role: str) -> str:
            if role not in scene.roles:
                hint = did_you_mean(role, scene.roles)
                raise TraceError(f"{self.path}: the scene has no role {role!r}; {hint}")
            return scene.roles[role]

        may_lack = (*self.optional, *self.liquids)
        lacking = {role for role in may_lack if role not in scene.roles}
        # Of RoboCasa's cabinets some are open shelves: there is nothing to open, nor to push.
        shelves = {
            role
            for role in set(self.optional) & set(self.mechanisms)
            if not scene.doors_of(entity(role))
        }

        def entities(roles: Iterable[str]) -> tuple[str, ...]:
            return tuple(entity(role) for role in roles if role not in lacking)

        def pairs(found: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
            return tuple((entity(a), entity(b)) for a, b in found if not {a, b} & lacking)

        things = tuple(body.entity for body in scene.bodies)
        used = {entity(role) for role in self._roles() if role not in lacking}
        kinds = {e.name: e for e in scene.entities if e.kind in ("object", "fixture")}
        binding = Binding(
            objects=entities(self.objects),
            enclosures=entities(self.enclosures),
            exclusive_enclosures=entities(self.exclusive_enclosures),
            mechanisms=entities(role for role in self.mechanisms if role not in shelves),
            placements=pairs(self.placements),
            skills=tuple(
                (skill, entity(x))
                for skill, x in self.skills
                if x not in lacking and not (skill in OF_DOORS and x in shelves)
            ),
            transfers=pairs(self.transfers),
            tools=tuple(
                ROBOT if role == ROBOT else entity(role)
                for role in self.tools
                if role not in lacking
            ),
            open_at={entity(role): value for role, value in self.open_at.items()},
            touch=frozenset(
                (entity(role), part)
                for role, parts in self.touch.items()
                if role not in lacking
                for part in parts
            ),
            supports={
                entity(role): frozenset(entities(below))
                for role, below in self.supports.items()
                if role not in lacking
            },
            upright=frozenset(entities(self.upright)),
            attributes={
                name: own
                for name, thing in kinds.items()
                if (own := _attributes(thing, attributes)) is not None
            },
            defaults=self.params,
            things=things,
            obstacles=tuple(name for name in things if name not in used),
            fixtures=tuple(e.name for e in scene.entities if e.kind == "fixture"),
            kinds={name: thing.category for name, thing in kinds.items()},
            zones={
                name: replace(zone, around=entity(zone.around))
                for name, zone in self.zones.items()
                if zone.around not in lacking
            },
            hot=frozenset(entities(self.hot)),
            filled=entities(self.filled),
        )
        emptied = (k for k in _RELATIONS if self.instances(k) and not binding.relation(k))
        return replace(binding, emptied=frozenset(emptied))

    def _roles(self) -> set[str]:
        """Roles that the task has a use for; without the robot."""
        pairs = (*self.placements, *self.transfers)
        found = {*self.objects, *self.touch, *self.supports, *self.upright, *self.tools}
        found.update(*self.supports.values(), *pairs)
        return found - {ROBOT}

    def instances(self, relation: str | None) -> int:
        """How many instances a property that ranges over a relation has in this task."""
        if relation is None:
            return 1
        members: Sequence[object] = getattr(self, relation, ())
        return len(members)


def _attributes(thing: Entity, known: Mapping[str, frozenset[str]]) -> frozenset[str] | None:
    """Attributes of an object or a fixture; None of a fixture whose kind is unknown."""
    if thing.kind == "fixture":
        own = known.get(thing.category)
        return None if own is None else own | set(thing.attributes)
    if thing.category not in known:
        raise TraceError(
            f"{thing.name}: object category {thing.category!r} has no row in {OBJECTS_FILE}; add "
            f"one ({thing.category}: [...] under categories:) to an {OBJECTS_FILE} in a folder of "
            "safemanip_task_paths"
        )
    return known[thing.category] | set(thing.attributes)
