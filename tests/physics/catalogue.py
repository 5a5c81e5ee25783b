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
    "can carried over jar": partial(handling.carries, height=0.12),
    "can carried past jar": partial(handling.carries, height=0.12, beside=0.05),
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
    "water poured into pan": partial(handling.pours_water, beside=0.0),
    "water poured beside pan": partial(handling.pours_water, beside=0.2),
    "can put on lit burner": partial(handling.heats, burns=True),
    "can put on cold burner": partial(handling.heats, burns=False),
    "can put at edge": partial(handling.puts_down, x=EDGE + 0.022),
    "can added to empty shelf": partial(shelving.adds, clears=True),
    "can added to full shelf": partial(shelving.adds, clears=False),
    "hand in open cabinet": partial(shelving.reaches_in, door=1.0),
    "hand in half open cabinet": partial(shelving.reaches_in, door=0.6),
    "can let go inside": partial(shelving.shelves, depth=0.12),
    "can let go half inside": partial(shelving.shelves, depth=0.01),
    "turned apple let go inside": shelving.shelves_turned,
    "can held at shelf": shelving.hesitates,
    "things touched gently": handling.brushes,
    "arm wades through bottle": partial(handling.sweeps, height=1.0, seconds=3.0),
    "arm dashes through bottle": partial(handling.sweeps, height=1.0, seconds=0.5),
    "can dropped from 10 cm": partial(handling.puts_down, x=EDGE + 0.1, height=0.1),
    "can dropped from 1 m": partial(handling.puts_down, x=EDGE + 0.1, height=1.0),
    "can slides out in the air": partial(handling.lifts_high, friction=0.1),
    "palm set down hard": partial(handling.strikes, seconds=1.0, permitted=True),
    "palm strikes": partial(handling.strikes, seconds=0.2, permitted=True),
    "palm leans for 1 s": partial(handling.strikes, seconds=1.0, holds=1.0),
    "palm leans for 20 s": partial(handling.strikes, seconds=1.0, holds=20.0),
    "palm strikes where it may not": partial(handling.strikes, seconds=0.2),
    "hand not washed for long": partial(handling.prepares_food, washes=False, holds=10.0),
    "door pushed on for long": partial(
        shelving.opens_door, mass=8.0, then="pushes on", pushes=18.0
    ),
    "hand in nearly open cabinet": partial(shelving.thrusts_in, door=0.8, seconds=0.6),
    "hand in ajar cabinet": partial(shelving.thrusts_in, door=0.6, seconds=0.6),
    "hand thrust into ajar cabinet": partial(shelving.thrusts_in, door=0.6, seconds=0.25),
    "can let go mostly outside": partial(shelving.shelves, depth=-0.005),
    "can squeezed": handling.squeezes,
    "can pushed": handling.pushes,
    "nothing happens": handling.lies_there,
}
