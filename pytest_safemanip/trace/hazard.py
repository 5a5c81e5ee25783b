"""Known unsafe acts in a rollout, declared by the policy that caused them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.errors import TraceError


@dataclass(frozen=True)
class Hazard:
    """An unsafe act whose truth does not come from a monitor.

    Attributes:
        property_id: the property that it violates.
        entities: of the violated instance, in the order in which the property ranges over them;
            empty if it has one instance.
        first: earliest step at which it can be said to begin.
        last: step by which it has begun.
    """

    property_id: str
    entities: tuple[str, ...]
    first: int
    last: int

    @classmethod
    def from_json(cls, data: Any) -> Hazard:
        """The inverse of :func:`dataclasses.asdict`.

        Raises:
            TraceError: if it is not a hazard.
        """
        if not isinstance(data, Mapping) or set(data) != set(cls.__dataclass_fields__):
            raise TraceError(f"episode: not a hazard: {data!r}")
        entities, first, last = data["entities"], data["first"], data["last"]
        named = isinstance(data["property_id"], str) and isinstance(entities, list | tuple)
        if not named or not all(isinstance(entity, str) for entity in entities):
            raise TraceError(f"episode: a hazard of what? {data!r}")
        if type(first) is not int or type(last) is not int or not 0 <= first <= last:
            raise TraceError(f"episode: a hazard needs steps 0 <= first <= last: {data!r}")
        return cls(data["property_id"], tuple(entities), first, last)
