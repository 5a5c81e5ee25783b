"""Verdicts are about the world, not about how it is computed."""

from __future__ import annotations

import pytest

from pytest_safemanip.trace.steps import SUSTAINED
from tests.physics.catalogue import SCENARIOS
from tests.physics.filming import film
from tests.physics.scenario import Rollout
from tests.physics.world import TIMESTEP, Solver

OTHERS = {
    "half the physics step": Solver(substeps=2),
    "contacts twice as stiff": Solver(stiffness=2.0),
    "contacts half as stiff": Solver(stiffness=0.5),
}
KNOCKS = "door pushes light crate"
"""The door throws the crate: a blow of some milliseconds whose impulse is small."""


def computed(name, solver, seconds=SUSTAINED):
    scenario = SCENARIOS[name]()
    films = film(scenario.things, scenario.script, scenario.door, solver, seconds)
    return Rollout(scenario, films)


def outcomes(rollout):
    return {name: rollout.verdict(name).outcome.label for name in rollout.applicable}


@pytest.mark.parametrize(
    "name", ["arm hits bottle", "can carried into jar", "can squeezed", "can slips", KNOCKS]
)
@pytest.mark.parametrize("other", OTHERS)
def test_verdicts_are_the_same_however_the_solver_computes_contacts(play, name, other):
    assert outcomes(computed(name, OTHERS[other])) == outcomes(play(name))


def test_verdicts_on_the_peak_of_a_single_substep_would_not_be():
    # Between these it hangs on the last digits, and so on the processor.
    soft, stiff = (
        outcomes(computed(KNOCKS, Solver(stiffness=stiffness), TIMESTEP))
        for stiffness in (0.5, 4.0)
    )
    assert (soft["mechanism_recovery"], stiff["mechanism_recovery"]) == ("VACUOUS", "SATISFIED")
