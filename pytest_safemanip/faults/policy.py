"""The scripted policy: the expert, or one of its faults."""

from __future__ import annotations

from pytest_safemanip.expert.digest import code_digest, plan_digest
from pytest_safemanip.expert.policy import Expert
from pytest_safemanip.expert.tasks.plans import EXPERT
from pytest_safemanip.faults.library import find
from pytest_safemanip.provenance import source_digest
from pytest_safemanip.sim.staging import Staging


class Scripted(Expert):
    """The expert, or what does a fault with the expert's skills.

    Args:
        fault: what it does wrong, an event of a family with its number (``slip@0.03``); empty for
            the expert.

    Raises:
        ConfigError: if there is no such fault.
    """

    def __init__(self, fault: str = "") -> None:
        self._fault = find(fault) if fault else None
        super().__init__(
            self._fault.plans if self._fault else EXPERT,
            f"scripted:{fault}" if fault else "scripted",
        )

    @property
    def fingerprint(self) -> str:
        """Digest of all the code, the plans and the faults."""
        return source_digest("expert", "faults")

    def fingerprint_in(self, task: str) -> str:
        """Digest of the plan of one task and of the code that it stands on."""
        if self._fault is None:
            return plan_digest(task)
        return code_digest(self._fault.entries.get(task, ""), [self._fault.home])

    def staging(self, task: str) -> Staging:
        """What its fault wants otherwise in the episodes of a task."""
        return self._fault.staging.get(task, Staging()) if self._fault else Staging()
