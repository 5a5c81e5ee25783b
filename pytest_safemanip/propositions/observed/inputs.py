"""What of a step propositions read: a value on what was not observed is not known."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.scene import Scene

if TYPE_CHECKING:
    from pytest_safemanip.propositions.binding import Binding
    from pytest_safemanip.propositions.definition import Bools, Proposition
    from pytest_safemanip.propositions.view import View

Kind = Literal["pose", "boxes", "joints", "switches", "particles", "hands", "openings", "commands",
               "cameras", "touch", "start"]  # fmt: skip
NAMED: tuple[Kind, ...] = ("pose", "boxes", "joints", "switches", "particles")
"""Kinds of which each entity has its own."""
HANDS: tuple[Kind, ...] = ("hands", "openings", "commands")
"""Kinds that the robot has one of for all its grippers."""


@dataclass(frozen=True)
class Input:
    """Something of a step that may be observed or not.

    Attributes:
        kind: ``pose`` and twist of an object; the poses of a fixture's ``boxes``, the openness of
            its ``joints``, its ``switches``; the ``particles`` of a liquid; poses of the ``hands``,
            ``openings`` of the grippers and ``commands`` to them; poses of the ``cameras``;
            contacts between parts (``touch``), or which of them have been since the first step
            (``start``).
        entity: whose it is; empty for hands, cameras and contacts.
        one: parts on one side of the contacts.
        other: those on the other side.
        seconds: how long a value looks back on it; None for as long as the proposition says.
    """

    kind: Kind
    entity: str = ""
    one: frozenset[int] = frozenset()
    other: frozenset[int] = frozenset()
    seconds: float | None = None


Found = frozenset[Input]
Reads = Callable[..., Iterable[Input]]
"""Given :class:`Inputs` and the proposition's arguments, what its value may depend on."""


class Inputs:
    """What there is to read in a scene, by kind.

    Args:
        scene: the static part of the trace.
        binding: which entities play which part.
        catalogue: the propositions by name.
        parameters: values of all parameters.
        known: the value of a proposition at the present step, given its name and its arguments;
            None if it is not known.
        holds: the value, at the present step, of a function of a view that depends on each step
            alone; from what stands where something was not observed.
    """

    def __init__(
        self,
        scene: Scene,
        binding: Binding,
        catalogue: Mapping[str, Proposition],
        parameters: Mapping[str, float],
        known: Callable[..., bool | None],
        holds: Callable[[Callable[[View], Bools]], bool],
    ) -> None:
        self.scene, self.binding, self.known, self.holds = scene, binding, known, holds
        self._catalogue, self._parameters = catalogue, parameters
        self.all_parts = frozenset(range(len(scene.parts)))
        self.objects = tuple(body.entity for body in scene.bodies)
        hands = {part for hand in scene.grippers for part in hand.parts}
        fingers = {p for hand in scene.grippers for group in hand.fingers for p in group}
        own = [(k, part.name) for k, part in enumerate(scene.parts) if part.entity == ROBOT]
        self.hand_parts = frozenset(k for k, name in own if name in hands)
        self.finger_parts = frozenset(k for k, name in own if name in fingers)
        self.limb_parts = frozenset(k for k, _ in own) - self.hand_parts

    def of(self, name: str, *arguments: str) -> Found:
        """All that another proposition reads; everything if it does not say."""
        reads = self._catalogue[name].reads
        return self.everything() if reads is None else frozenset(reads(self, *arguments))

    def now(self, name: str, *arguments: str) -> Found:
        """What another proposition reads for its value at the present step alone."""
        window = self._catalogue[name].seconds(self._parameters)
        return frozenset(
            replace(one, seconds=window) if one.seconds is None else one
            for one in self.of(name, *arguments)
        )

    def parts(self, *entities: str) -> frozenset[int]:
        """Indices of the parts of some entities."""
        empty = frozenset[int]()
        return empty.union(*(self.scene.owned.get(name, empty) for name in entities))

    def poses(self, *entities: str, seconds: float | None = None) -> Found:
        """Poses of those of some entities that are objects."""
        objects = (name for name in entities if name in self.scene.object_index)
        return frozenset(Input("pose", name, seconds=seconds) for name in objects)

    def space(self, name: str) -> Found:
        """What something fills: poses of hands or of an object, joints of a fixture, what a zone is
        around.
        """
        if name in self.binding.zones:
            return self.space(self.binding.zones[name].around)
        if name == ROBOT:
            return self.robot("hands")
        return self.poses(name) | self.joints(name)

    def place(self, entity: str) -> Found:
        """Where an entity holds things: the pose of an object, the boxes of a fixture."""
        return self.poses(entity) or frozenset((Input("boxes", entity),))

    def joints(self, *fixtures: str) -> Found:
        """Openness of those of some entities that have joints."""
        jointed = (name for name in fixtures if self.scene.joints_of(name))
        return frozenset(Input("joints", name) for name in jointed)

    def boxes(self, fixture: str) -> Found:
        """Poses of a fixture's boxes."""
        return frozenset((Input("boxes", fixture),))

    def switches(self, fixture: str) -> Found:
        """Whether what a fixture has is on."""
        return frozenset((Input("switches", fixture),))

    def particles(self, liquid: str, seconds: float | None = None) -> Found:
        """Where the particles of a liquid are."""
        return frozenset((Input("particles", liquid, seconds=seconds),))

    def cameras(self) -> Found:
        """Poses of all cameras."""
        return frozenset((Input("cameras"),))

    def robot(self, *kinds: Kind, seconds: float | None = None) -> Found:
        """What all grippers have: ``hands``, ``openings``, ``commands``."""
        return frozenset(Input(kind, seconds=seconds) for kind in kinds)

    def touch(
        self, one: frozenset[int], other: frozenset[int], seconds: float | None = None
    ) -> Found:
        """Contacts between parts."""
        return frozenset((Input("touch", one=one, other=other, seconds=seconds),))

    def start(self, one: frozenset[int], other: frozenset[int]) -> Found:
        """Which contacts between parts have been since the first step."""
        return frozenset((Input("start", one=one, other=other),))

    def everything(self) -> Found:
        """All that can be observed."""
        scene = self.scene
        owners = {
            "boxes": {box.entity for box in scene.boxes},
            "switches": {switch.entity for switch in scene.switches},
            "particles": {liquid.entity for liquid in scene.liquids},
        }
        named = {Input(kind, name) for kind, found in owners.items() for name in found}  # type: ignore[arg-type]
        fixtures = [entity.name for entity in scene.entities]
        return (
            self.poses(*self.objects)
            | self.joints(*fixtures)
            | frozenset(named)
            | self.robot(*HANDS)
            | self.cameras()
            | self.touch(self.all_parts, self.all_parts)
        )
