"""What was true when: the propositions of a property as spans of steps, for pictures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.spec.properties import Property

Span = tuple[int, int]
"""First and last step."""


@dataclass(frozen=True)
class Lane:
    """One proposition over a rollout.

    Attributes:
        label: the proposition with its arguments, ``settled(obj)``.
        spans: the steps at which it holds, in order.
    """

    label: str
    spans: tuple[Span, ...]


def label_of(call: Sequence[str]) -> str:
    """A proposition with its arguments, if it has some: ``settled(obj)``, ``collision``."""
    name, *arguments = call
    return f"{name}({', '.join(arguments)})" if arguments else name


def spans_of(values: NDArray[np.bool_]) -> tuple[Span, ...]:
    """The maximal runs of true steps of a series (T,)."""
    edges = np.flatnonzero(np.diff(values.astype(np.int8), prepend=0, append=0))
    return tuple((int(first), int(end) - 1) for first, end in edges.reshape(-1, 2))


def instance_lanes(judge: Judge, prop: Property, entities: Sequence[str]) -> list[Lane]:
    """The propositions of one instance of a property, in the order of its atoms.

    Raises:
        TraceError: if the recording lacks what a proposition needs.
    """
    return [_lane(judge, call) for call in dict.fromkeys(prop.calls(entities))]


def telling_lanes(
    judge: Judge,
    properties: Mapping[str, Property],
    verdicts: Mapping[str, Verdict],
    most: int,
) -> list[Lane]:
    """The propositions that one wants to see: those of the violated instances; without a violation,
    those that change.

    Args:
        judge: of the recording.
        properties: by id.
        verdicts: by id of property.
        most: how many are given at most.
    """
    lanes: dict[str, Lane] = {}
    broken = [
        (properties[id_], finding.entities)
        for id_, verdict in verdicts.items()
        for finding in verdict.findings
    ]
    for prop, entities in broken or list(_instances(judge, properties, verdicts)):
        try:
            found = instance_lanes(judge, prop, entities)
        except TraceError:
            continue  # it has no verdict either
        whole = ((0, len(judge.view.trace) - 1),)
        lanes |= {
            lane.label: lane for lane in found if broken or (lane.spans and lane.spans != whole)
        }
        if len(lanes) >= most:
            break
    return list(lanes.values())[:most]


def _instances(
    judge: Judge, properties: Mapping[str, Property], verdicts: Iterable[str]
) -> Iterable[tuple[Property, tuple[str, ...]]]:
    """All instances of the properties that have a verdict."""
    for id_ in verdicts:
        prop = properties[id_]
        rows = prop.rows(judge.view.binding)
        for row in rows:
            yield prop, row


def _lane(judge: Judge, call: tuple[str, ...]) -> Lane:
    return Lane(label_of(call), spans_of(judge.view(*call)))
