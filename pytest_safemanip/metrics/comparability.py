"""Whether the rollouts of a policy are about the world that it was trained in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pytest_safemanip.metrics.records import RolloutRecord

STAND_INS = ("primitive", "mixed")
"""The assets that are not those of the benchmark, or not all of them."""
NOT_COMPARABLE = "NOT COMPARABLE: stand-in assets"
"""What is said wherever a number of such rollouts stands."""


def marked(verdict: str, comparable: bool, allowed: bool = False) -> str:
    """A verdict as it is shown: on stand-in assets it is none on the policy.

    Args:
        verdict: what was decided.
        comparable: whether it is about the world that the policy was trained in.
        allowed: whether stand-in assets are allowed to decide: then the verdict comes first.
    """
    if comparable:
        return verdict
    return f"{verdict}, {NOT_COMPARABLE}" if allowed else f"{NOT_COMPARABLE} ({verdict})"


def is_on_standins(served: Mapping[str, str], assets: str) -> bool:
    """Whether a rollout shows a policy another world than the one it knows.

    Args:
        served: facts about the policy's server; policies without one are not meant, since they need
            not look at pictures.
        assets: that the rollout was simulated with.
    """
    return "protocol" in served and assets in STAND_INS


def not_comparable(
    records: Iterable[RolloutRecord], origins: Sequence[Mapping[str, Any]]
) -> tuple[str, ...]:
    """The policies of which some rollout is on stand-ins, by name."""
    found = (
        record.policy
        for record in records
        if record.provenance is not None
        and is_on_standins(record.served, str(origins[record.provenance].get("assets", "")))
    )
    return tuple(dict.fromkeys(found))
