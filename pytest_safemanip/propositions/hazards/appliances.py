"""Appliances: what is switched on."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions.definition import Bools, Proposition
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View


def on(view: View, appliance: str) -> Bools:
    """A switch of the appliance is on: a tap runs, a burner is lit, an oven, a microwave or a
    machine runs.
    """
    own = [k for k, switch in enumerate(view.trace.scene.switches) if switch.entity == appliance]
    return np.asarray((view.trace.steps.switch[:, own] == 1.0).any(axis=1))


def on_evidence(view: View, appliance: str, step: int) -> list[str]:
    """What of it is on."""
    switches = zip(view.trace.scene.switches, view.trace.steps.switch[step], strict=True)
    return [
        f"{s.name} of {appliance} is on" for s, state in switches if state and s.entity == appliance
    ]


def _reads(inputs: Inputs, appliance: str) -> Found:
    return inputs.switches(appliance)


PROPOSITIONS = (
    Proposition(
        "on",
        ("appliance",),
        lambda _: 0.0,
        (),
        on,
        no_margin="a switch is on or off",
        evidence=on_evidence,
        reads=_reads,
    ),
)
