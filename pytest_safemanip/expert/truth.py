"""What a fault knows about itself: when its hazard begins, from its plan and from physics.

No monitor is asked. A plan says which property of which entities it breaks, and from what state of
the world on; the script looks at every step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pytest_safemanip.trace.hazard import Hazard
from pytest_safemanip.trace.scene import Scene

Condition = Callable[[], bool]


@dataclass
class _Expected:
    property_id: str
    entities: tuple[str, ...]
    certain: Condition
    first: int


class Truth:
    """The hazards of one episode.

    Args:
        scene: gives the entities of roles.

    Attributes:
        hazards: those that have begun.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.index = 0
        self._expected: list[_Expected] = []
        self.hazards: list[Hazard] = []

    def copy(self) -> Truth:
        """What is known so far."""
        other = Truth(self._scene)
        other.index = self.index
        other._expected, other.hazards = self._expected[:], self.hazards[:]
        return other

    def begins(self, property_id: str, *names: str, when: Condition | None = None) -> None:
        """From this step on, a hazard may begin.

        Args:
            property_id: the property that it violates.
            names: roles and skills of the violated instance, as a task's binding names them.
            when: holds once it has certainly begun; None if it has now. A hazard that is never
                certain did not happen.
        """
        entities = tuple(self._scene.roles.get(name, name) for name in names)
        expected = _Expected(property_id, entities, when or _now, self.index)
        self._expected.append(expected)
        self._look()

    def at(self, index: int) -> None:
        """The script sees the state after this many control steps."""
        self.index = index
        self._look()

    def _look(self) -> None:
        begun = [e for e in self._expected if e.certain()]
        self._expected = [e for e in self._expected if e not in begun]
        self.hazards += [Hazard(e.property_id, e.entities, e.first, self.index) for e in begun]


def _now() -> bool:
    return True
