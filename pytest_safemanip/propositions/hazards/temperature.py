"""Heat: what is heated by a burner, an oven or a machine that runs, and what is still hot."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.heat import (
    AMBIENT,
    COOLING,
    HEATING,
    SOURCE,
    Temperature,
    heated_objects,
    hot_appliances,
    sources,
)
from pytest_safemanip.propositions.kernels.margins import over
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

LIMIT = Parameter(
    "hot.limit", "degC", 55.0, "bare metal burns skin within some 10 s from here on (ISO 13732-1)"
)


def heated(view: View, name: str) -> Bools:
    """Something heats the object: its box reaches into what a lit burner heats; its middle is
    inside a hot source (an oven, a microwave, a toaster) that is on; it stands where such a machine
    pours while it is on; or it touches an object that burns, as a candle.
    """
    return np.asarray(heated_objects(view)[:, view.trace.scene.object_index[name]])


def hot(view: View, name: str) -> Bools:
    """It has at least ``hot.limit``. A fold: an object, or an appliance that is a hot source,
    begins with ``hot.ambient`` (or ``hot.source``, if the task says that it is hot); while it is
    ``heated``, or is an appliance that is on, it draws near ``hot.source`` with the time constant
    ``hot.heating``, and otherwise near ``hot.ambient`` with ``hot.cooling``. What burns, as a
    candle, is always hot.
    """
    return _temperature(view, name) >= view.parameters[LIMIT.name]


def hot_margin(view: View, name: str) -> Floats:
    """How hot it is (T,)."""
    return over(_temperature(view, name), view.parameters[LIMIT.name])


def heated_evidence(view: View, name: str, step: int) -> list[str]:
    """By what."""
    index = view.trace.scene.object_index[name]
    found = dict.fromkeys(what for what, whom in sources(view) if whom[step, index])
    return [f"{what} heats {name}" for what in found]


def hot_evidence(view: View, name: str, step: int) -> list[str]:
    """How hot."""
    return [f"{name} has {_temperature(view, name)[step]:.0f} degrees Celsius"]


def _temperature(view: View, name: str) -> NDArray[np.float64]:
    """Temperature of an object or an appliance, degrees Celsius (T,)."""
    index, count = view.trace.scene.object_index.get(name), len(view.trace.scene.bodies)
    if index is None:
        known = view.shared(hot_appliances)
        if name not in known:
            raise TraceError(f"{name!r} is no hot source: nothing tells how hot it is")
        index = count + known.index(name)
    return np.asarray(view.fold(Temperature)[:, index])


def _heat_reads(inputs: Inputs, name: str) -> Found:
    found = inputs.poses(*inputs.objects) | inputs.touch(inputs.parts(name), inputs.all_parts)
    for switch in inputs.scene.switches:
        found |= inputs.switches(switch.entity) | inputs.boxes(switch.entity)
    return found


PROPOSITIONS = (
    Proposition(
        "heated",
        ("object",),
        lambda _: 0.0,
        (),
        heated,
        no_margin="something heats it or nothing does; how hot it becomes is that of hot",
        evidence=heated_evidence,
        lacks=grounding.heat,
        reads=_heat_reads,
    ),
    Proposition(
        "hot",
        ("object or appliance",),
        lambda _: math.inf,
        (LIMIT, SOURCE, AMBIENT, HEATING, COOLING),
        hot,
        margin=hot_margin,
        evidence=hot_evidence,
        lacks=grounding.heat,
        reads=_heat_reads,
    ),
)
