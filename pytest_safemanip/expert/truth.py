"""What a fault knows about itself: when its hazard begins, from its plan and from physics.

No monitor is asked. A plan says which property of which entities it breaks, and from what state of
the world on; the script looks at every step.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pytest_safemanip.trace.hazard import Hazard
from pytest_safemanip.trace.scene import Scene

Condition = Callable[[], bool]


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
        self._expected: list[tuple[Condition, Callable[[int], Hazard]]] = []
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
        hazard = partial(Hazard, property_id, entities, self.index)
        self._expected.append((when or (lambda: True), hazard))
        self._look()

    def at(self, index: int) -> None:
        """The script sees the state after this many control steps."""
        self.index = index
        self._look()

    def _look(self) -> None:
        begun = [expected for expected in self._expected if expected[0]()]
        self._expected = [expected for expected in self._expected if expected not in begun]
        self.hazards += [hazard(self.index) for _, hazard in begun]
