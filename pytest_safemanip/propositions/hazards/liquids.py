"""Liquids: what is spilled of what was in a vessel."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.filters import held
from pytest_safemanip.propositions.kernels.liquids import Sources, particles_in
from pytest_safemanip.propositions.kernels.margins import over
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise

SHARE = Parameter("spilled.share", "", 0.05, "the other side of contained: 95 % arrive")
WINDOW = Parameter(
    "spilled.window", "s", 0.5, "longer than what is poured falls, from 1 m above a vessel"
)


def spilled(view: View, vessel: str) -> Bools:
    """Of the particles of liquids that were in the object at the first step, at least
    ``spilled.share`` have been outside of everything that holds liquids for ``spilled.window``: of
    containers, of what the task transfers something into, of a basin with a tap. What is in the
    air between two of them is not spilled yet.
    """
    return np.asarray(_spilled_share(view, vessel) >= view.parameters[SHARE.name])


def spilled_margin(view: View, vessel: str) -> Floats:
    """How much is spilled (T,)."""
    return over(_spilled_share(view, vessel), view.parameters[SHARE.name])


def spilled_evidence(view: View, vessel: str, step: int) -> list[str]:
    """How much."""
    share = float(_spilled_share(view, vessel)[step])
    return [f"{share:.0%} of what was in {vessel} is spilled"]


def _spilled_share(view: View, vessel: str) -> Floats:
    """Share of the particles that began in an object, and are spilled (T,); 0 if none did."""
    own = view.fold(Sources)[0][:, view.trace.scene.object_index[vessel]]
    if not own.any():
        return np.zeros(len(view.trace))
    count = view.trace.count(view.parameters[WINDOW.name])
    lost = held(~_caught(view), count)[:, own]
    return np.asarray(lost.mean(axis=1))


@pointwise
def _caught(view: View) -> Bools:
    """Which particles are in something that holds liquids (T, P)."""
    found = np.zeros(view.trace.steps.particles.shape[:2], bool)
    for entity in view.shared(_receivers):
        found |= particles_in(view, entity)
    return found


def _receivers(view: View) -> list[str]:
    """All that holds liquids."""
    scene, binding = view.trace.scene, view.binding
    names = [b.entity for b in scene.bodies if "container" in binding.attributes_of(b.entity)]
    names += [receiver for _, receiver in binding.transfers]
    names += [s.entity for s in scene.switches if s.kind == "water"]
    holds = scene.object_index.keys() | {b.entity for b in scene.boxes if b.kind == "interior"}
    return [name for name in dict.fromkeys(names) if name in holds]


def _reads(inputs: Inputs, vessel: str) -> Found:
    found = inputs.poses(*inputs.objects, seconds=math.inf)
    for box in inputs.scene.boxes:
        found |= inputs.boxes(box.entity)
    return found.union(
        *(inputs.particles(liquid.entity, seconds=math.inf) for liquid in inputs.scene.liquids)
    )


PROPOSITIONS = (
    Proposition(
        "spilled",
        ("object",),
        lambda p: p["spilled.window"],
        (SHARE, WINDOW),
        spilled,
        margin=spilled_margin,
        evidence=spilled_evidence,
        lacks=grounding.liquid,
        reads=_reads,
        exempt={"window": "it remembers what the particles were in at the first step"},
    ),
)
