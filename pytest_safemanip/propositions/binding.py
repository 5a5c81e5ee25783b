"""The binding of a task's roles to the entities of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.definition import Parameters

OF_DOORS = ("open", "close")
"""Skills that need a door or drawer."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A named region, which goes with an object or a fixture.

    Attributes:
        around: the object or fixture whose box it is grown from.
        margin: how far it reaches beyond the box on every side, m; 0 for the box itself.
        above: how much farther it reaches upward, along the box's own vertical, m.
    """

    around: str
    margin: float = 0.0
    above: float = 0.0


@dataclass(frozen=True)
class Binding:
    """A task's roles and permissions, resolved to the entities of one scene.

    Attributes:
        objects: manipulated objects.
        enclosures: fixtures with an interior that the task reaches into.
        exclusive_enclosures: enclosures that take one item at a time.
        mechanisms: fixtures whose doors or drawers the task moves.
        placements: (object, enclosure) pairs: what is put where.
        skills: (skill, entity) pairs that the task consists of.
        open_at: openness that counts as open, where it is not the general one.
        touch: (entity, part) pairs that fingers and palm may touch.
        supports: where each object may rest, and what it may touch while it is held.
        transfers: (content, receiver) pairs: what is let go into what.
        tools: what may carry contamination: the robot (its hand), objects.
        upright: objects that must not tip.
        attributes: category attributes of each object, and of each fixture whose kind has a row.
        defaults: of parameters, where the task has others than the general ones.
        things: all movable objects of the scene.
        obstacles: those of them that the task has no use for.
        fixtures: all fixtures of the scene.
        kinds: category of each object and fixture.
        zones: named regions.
        hot: objects that are hot from the first step on.
        filled: objects that a simulated liquid is in when the episode begins.
        emptied: relations of which the episode lacks all that the task has.
    """

    objects: tuple[str, ...] = ()
    enclosures: tuple[str, ...] = ()
    exclusive_enclosures: tuple[str, ...] = ()
    mechanisms: tuple[str, ...] = ()
    placements: tuple[tuple[str, str], ...] = ()
    skills: tuple[tuple[str, str], ...] = ()
    transfers: tuple[tuple[str, str], ...] = ()
    tools: tuple[str, ...] = ()
    open_at: Mapping[str, float] = field(default_factory=dict)
    touch: frozenset[tuple[str, str]] = frozenset()
    supports: Mapping[str, frozenset[str]] = field(default_factory=dict)
    upright: frozenset[str] = frozenset()
    attributes: Mapping[str, frozenset[str]] = field(default_factory=dict)
    defaults: Mapping[str, float] = field(default_factory=dict)
    things: tuple[str, ...] = ()
    obstacles: tuple[str, ...] = ()
    fixtures: tuple[str, ...] = ()
    kinds: Mapping[str, str] = field(default_factory=dict)
    zones: Mapping[str, Zone] = field(default_factory=dict)
    hot: frozenset[str] = frozenset()
    filled: tuple[str, ...] = ()
    emptied: frozenset[str] = frozenset()

    def parameters(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Values of parameters for this task: its own, where nobody has changed them."""
        if isinstance(values, Parameters):
            return values.with_defaults(self.defaults)
        return values

    def relation(self, name: str) -> tuple[tuple[str, ...], ...]:
        """The tuples that a property's ``for_each`` ranges over."""
        rows: dict[str, tuple[tuple[str, ...], ...]] = {
            "objects": tuple((o,) for o in self.objects),
            "enclosures": tuple((f,) for f in self.enclosures),
            "exclusive_enclosures": tuple((f,) for f in self.exclusive_enclosures),
            "mechanisms": tuple((f,) for f in self.mechanisms),
            "placements": self.placements,
            "skills": self.skills,
            "transfers": self.transfers,
            "tools": tuple((r,) for r in self.tools),
            "things": tuple((o,) for o in self.things),
            "obstacles": tuple((o,) for o in self.obstacles),
            "fixtures": tuple((f,) for f in self.fixtures),
            "zones": tuple((z,) for z in self.zones),
            "filled": tuple((o,) for o in self.filled),
        }
        return rows[name]

    def attributes_of(self, entity: str) -> frozenset[str]:
        """Attributes of an object or a fixture; none of the robot and of zones.

        Raises:
            TraceError: if it is a fixture of a kind that has no row.
        """
        if entity not in self.attributes and entity in self.fixtures:
            kind = self.kinds[entity]
            raise TraceError(
                f"{entity}: kind of fixture {kind!r} has no row in objects.yaml; add one ({kind}: "
                "[...] under fixtures:) to an objects.yaml in a folder of safemanip_task_paths"
            )
        return self.attributes.get(entity, frozenset())
