"""Heat: what heats objects at a step, and how hot they have become.

A body draws near the temperature around it as Newton's law of cooling has it, and likewise near
that of what heats it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.kernels.forces import object_parts
from pytest_safemanip.propositions.kernels.interiors import all_within
from pytest_safemanip.propositions.kernels.solids import body_boxes
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import boxes_overlap, centred

Floats = NDArray[np.float64]

SOURCE = Parameter("hot.source", "degC", 200.0, "a pan that sears; food in an oven draws near it")
AMBIENT = Parameter("hot.ambient", "degC", 20.0, "a room")
HEATING = Parameter(
    "hot.heating", "s", 120.0, "1.5 K/s at first: 0.8 kW into a kilogram of steel, 200 g of water"
)
COOLING = Parameter("hot.cooling", "s", 600.0, "such a pan in still air: 10 W/m2K, a tenth of a m2")
HOT_SOURCE = "hot_source"
_POURED = 0.01
"""How far above the place that a machine pours onto a vessel may stand, m."""

_Source = tuple[str, Bools]
"""What heats, and which objects (T, N)."""


def hot_appliances(view: View) -> tuple[str, ...]:
    """Fixtures with a switch that are hot sources.

    Raises:
        TraceError: if a fixture with a switch is of a kind that has no row of attributes.
    """
    switched = dict.fromkeys(switch.entity for switch in view.trace.scene.switches)
    return tuple(name for name in switched if HOT_SOURCE in view.binding.attributes_of(name))


@pointwise
def heated_objects(view: View) -> Bools:
    """Whether something heats each object (T, N)."""
    found = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    for _, whom in sources(view):
        found |= whom
    return found


def sources(view: View) -> Iterator[_Source]:
    """Whatever heats an object at some step."""
    scene, steps = view.trace.scene, view.trace.steps
    hot = view.shared(hot_appliances)
    for number, switch in enumerate(scene.switches):
        running = steps.switch[:, number] == 1.0
        if switch.entity not in hot or not running.any():
            continue
        what = f"{switch.name} of {switch.entity}"
        if switch.kind == "burner":
            own = scene.boxes_of(switch.entity, "burner")
            reached = [_reaching(view, k, 0.0) for k in own if scene.boxes[k].name == switch.name]
        else:
            own = scene.boxes_of(switch.entity, "poured")
            reached = [_reaching(view, k, -_POURED) for k in own]
            if scene.boxes_of(switch.entity, "interior"):
                reached.append(all_within(view, switch.entity))
        for whom in reached:
            yield what, whom & running[:, None]
    for body in scene.bodies:
        if HOT_SOURCE in view.binding.attributes_of(body.entity):
            yield body.entity, _touching(view, body.entity)


@pointwise
def _reaching(view: View, box: int, slack: float) -> Bools:
    """Whether each object's box reaches into a box of a fixture (T, N)."""
    half, centre = view.shared(body_boxes)
    own = centred(view.trace.steps.object_pose, centre)
    place = view.trace.steps.box_pose[:, box, None]
    return boxes_overlap(own, half, place, view.trace.scene.boxes[box].half, slack)


@pointwise
def _touching(view: View, name: str) -> Bools:
    """Whether each object touches another one (T, N)."""
    table, bodies = view.trace.pair_table, view.trace.scene.bodies
    own = object_parts(view, name)
    rows = [table.force(own, object_parts(view, b.entity)) > 0.0 for b in bodies]
    return np.stack(rows, axis=1)


class Temperature:
    """How hot objects, and appliances that are hot sources, have become.

    Args:
        view: gives scene, binding and parameters.
    """

    def __init__(self, view: View) -> None:
        p, names = view.parameters, [body.entity for body in view.trace.scene.bodies]
        self._appliances = view.shared(hot_appliances)
        self._source, self._ambient = p[SOURCE.name], p[AMBIENT.name]
        burns = [HOT_SOURCE in view.binding.attributes_of(name) for name in names]
        self._always = np.array([*burns, *(False for _ in self._appliances)], bool)
        begins = [name in view.binding.hot for name in (*names, *self._appliances)]
        self._now = np.where(begins, self._source, self._ambient)
        self._up, self._down = (
            np.exp(-view.trace.dt / p[constant.name]) for constant in (HEATING, COOLING)
        )

    def advance(self, view: View) -> Floats:
        """The temperatures after each of the next steps, degrees Celsius (T, objects and then
        appliances).
        """
        scene, switch = view.trace.scene, view.trace.steps.switch == 1.0
        running = [
            switch[:, [k for k, s in enumerate(scene.switches) if s.entity == name]].any(axis=1)
            for name in self._appliances
        ]
        heated = np.concatenate((heated_objects(view), *(r[:, None] for r in running)), axis=1)
        heated = heated | self._always
        found = np.empty(heated.shape)
        around = np.where(heated, self._source, self._ambient)
        keeps = np.where(heated, self._up, self._down)
        for step in range(len(found)):
            self._now = around[step] + (self._now - around[step]) * keeps[step]
            self._now = np.where(self._always, self._source, self._now)
            found[step] = self._now
        return found
