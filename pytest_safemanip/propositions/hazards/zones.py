"""Zones: what is in a named region, and what sticks out of it."""

from __future__ import annotations

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.margins import over
from pytest_safemanip.propositions.kernels.spaces import called, reach_in, reach_out
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

IN = Parameter("in_zone.depth", "m", 0.005, "a box is larger than what is in it")
OUT = Parameter("out_of_zone.depth", "m", 0.005, "as for in_zone")


def in_zone(view: View, name: str, zone: str) -> Bools:
    """Some of it is in the zone: its box, of the robot that of a hand, reaches into the zone by
    more than ``in_zone.depth``.
    """
    return reach_in(view, name, zone) > view.parameters[IN.name]


def out_of_zone(view: View, name: str, zone: str) -> Bools:
    """Some of it is outside the zone: its box, of the robot that of a hand, sticks out of the zone
    by more than ``out_of_zone.depth``.
    """
    return reach_out(view, name, zone) > view.parameters[OUT.name]


def in_zone_margin(view: View, name: str, zone: str) -> Floats:
    """How far it reaches in (T,)."""
    return over(reach_in(view, name, zone), view.parameters[IN.name])


def out_of_zone_margin(view: View, name: str, zone: str) -> Floats:
    """How far it sticks out (T,)."""
    return over(reach_out(view, name, zone), view.parameters[OUT.name])


def in_zone_evidence(view: View, name: str, zone: str, step: int) -> list[str]:
    """How far."""
    found = float(reach_in(view, name, zone)[step])
    return [f"{called(name)} reaches {100 * found:.1f} cm into {zone}"]


def out_of_zone_evidence(view: View, name: str, zone: str, step: int) -> list[str]:
    """How far."""
    found = float(reach_out(view, name, zone)[step])
    return [f"{called(name)} sticks {100 * found:.1f} cm out of {zone}"]


def _reads(inputs: Inputs, name: str, zone: str) -> Found:
    return inputs.space(name) | inputs.space(zone)


_WHO = ("robot or object", "zone")

PROPOSITIONS = (
    Proposition(
        "in_zone",
        _WHO,
        lambda _: 0.0,
        (IN,),
        in_zone,
        margin=in_zone_margin,
        evidence=in_zone_evidence,
        lacks=grounding.solid,
        reads=_reads,
        distinct=True,
    ),
    Proposition(
        "out_of_zone",
        _WHO,
        lambda _: 0.0,
        (OUT,),
        out_of_zone,
        margin=out_of_zone_margin,
        evidence=out_of_zone_evidence,
        lacks=grounding.solid,
        reads=_reads,
        distinct=True,
    ),
)
