"""What is asked of whoever runs rollouts, and what comes of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.dimension import Deviation


@dataclass(frozen=True)
class Trial:
    """A rollout to be run.

    Attributes:
        seed: of the episode.
        deviation: what is otherwise in it.
        repeat: how often the same was asked for before: what is random in the policy and in
            disturbances is drawn anew.
    """

    seed: int
    deviation: Deviation
    repeat: int = 0


LONGEST = 255
"""Letters of a file's name."""


@dataclass(frozen=True)
class Finding:
    """What a rollout says about a property.

    Attributes:
        violated: whether it violates it.
        margin: by how much it keeps it (positive) or violates it, in units of its thresholds; the
            smallest of its instances.
        severity: of its worst violation; 0 without one.
        triggered: whether it came to bear at all.
    """

    violated: bool
    margin: float
    severity: float = 0.0
    triggered: bool = True

    @property
    def loss(self) -> float:
        """What a search makes smaller: below 0 exactly where the property is violated.

        Violated, a property may have a positive margin, as by a deadline that is not in its
        formula; and kept, a negative one: what is open at the end is owed, and not violated.
        """
        if self.violated:
            return -1.0 - max(-self.margin, 0.0)
        return max(self.margin, 0.0)


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Attributes:
        findings: by property id; empty if there was no episode.
        refused: why there was no episode: what was asked for cannot be; empty if there was.
        digest: of everything that was recorded of it: the same for the same bits.
        recording: its file, relative to the folder of searches; empty if none was kept.
        error: why its rollout failed; empty if it did not.
    """

    findings: Mapping[str, Finding] = field(default_factory=dict)
    refused: str = ""
    digest: str = ""
    recording: str = ""
    error: str = ""

    def violates(self, property_id: str) -> bool:
        """Whether it violates a property."""
        found = self.findings.get(property_id)
        return found is not None and found.violated

    def satisfies(self, property_id: str) -> bool:
        """Whether it keeps a property that came to bear in it."""
        found = self.findings.get(property_id)
        return found is not None and found.triggered and not found.violated

    def to_json(self) -> dict[str, Any]:
        """Plain builtins. What failed is not kept."""
        return {name: value for name, value in asdict(self).items() if name != "error"}

    @classmethod
    def from_json(cls, values: Any, place: str) -> Outcome:
        """The inverse of :meth:`to_json`.

        Raises:
            ConfigError: if they are none.
        """
        try:
            findings = {str(name): Finding(**own) for name, own in values["findings"].items()}
            texts = {key: values[key] for key in ("refused", "digest", "recording")}
        except (TypeError, KeyError, AttributeError) as error:
            raise ConfigError(f"{place}: no outcome of a trial ({error})") from error
        numbers = [x for own in findings.values() for x in (own.margin, own.severity)]
        flags = [x for own in findings.values() for x in (own.violated, own.triggered)]
        if (
            not all(type(flag) is bool for flag in flags)
            or not all(isinstance(x, int | float) and abs(x) < math.inf for x in numbers)
            or not all(isinstance(text, str) for text in texts.values())
            or len(texts["recording"]) > LONGEST
            or "/" in texts["recording"]
        ):
            raise ConfigError(f"{place}: no outcome of a trial")
        return cls(findings, **texts)
