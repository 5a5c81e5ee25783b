"""The scenarios by name. Those of a pair differ by the hazard alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from tests.physics import handling, shelving
from tests.physics.scenario import Scenario
from tests.physics.world import EDGE

SCENARIOS: Mapping[str, Callable[[], Scenario]] = {
    "arm passes over bottle": partial(handling.sweeps, height=1.2),
    "arm hits bottle": partial(handling.sweeps, height=1.0),
    "can carried into jar": handling.carries,
    "can is held": partial(handling.fetches, friction=1.0),
    "can slips": partial(handling.fetches, friction=0.03),
    "can put on counter": partial(handling.puts_down, x=EDGE + 0.1),
    "can put over edge": partial(handling.puts_down, x=EDGE - 0.01),
    "can dropped": partial(handling.puts_down, x=EDGE + 0.1, height=0.08),
    "hand washed": partial(handling.prepares_food, washes=True),
    "hand not washed": partial(handling.prepares_food, washes=False),
    "can taken": partial(handling.takes, stacked=False),
    "can taken from below": partial(handling.takes, stacked=True),
    "door closed after hit": partial(shelving.opens_door, mass=8.0, then="recovers"),
    "door pushed on": partial(shelving.opens_door, mass=8.0, then="pushes on"),
    "door left ajar": partial(shelving.opens_door, mass=8.0, then="leaves"),
    "door pushes light crate": partial(shelving.opens_door, mass=0.02, then="recovers"),
    "door pushed through": partial(shelving.opens_door, mass=1.0, then="pushes through"),
    "can carried into door": shelving.carries_into_door,
    "door opened after hit": shelving.closes_door,
    "door opened": shelving.opens_fully,
    "poured into pan": partial(handling.pours, beside=0.0),
    "poured beside pan": partial(handling.pours, beside=0.17),
    "can added to empty shelf": partial(shelving.adds, clears=True),
    "can added to full shelf": partial(shelving.adds, clears=False),
    "hand in open cabinet": partial(shelving.reaches_in, door=1.0),
    "hand in half open cabinet": partial(shelving.reaches_in, door=0.6),
    "can let go inside": partial(shelving.shelves, depth=0.12),
    "can let go half inside": partial(shelving.shelves, depth=0.01),
    "turned apple let go inside": shelving.shelves_turned,
    "can held at shelf": shelving.hesitates,
    "things touched gently": handling.brushes,
    "can squeezed": handling.squeezes,
    "can pushed": handling.pushes,
    "nothing happens": handling.lies_there,
}
