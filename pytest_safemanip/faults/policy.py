"""The scripted policy: the expert, with plans of the user's or without, or one of its faults."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.digest import code_digest, plan_digest
from pytest_safemanip.expert.policy import Expert
from pytest_safemanip.expert.tasks.plans import ENTRIES, EXPERT, load, plan_of
from pytest_safemanip.faults.library import find
from pytest_safemanip.provenance import source_digest
from pytest_safemanip.sim.staging import Staging

FILE_ENDINGS = (".yaml", ".yml")
OTHER_ENDINGS = (".txt", ".json", ".toml", ".py")


class Scripted(Expert):
    """The expert, or what does a fault with the expert's skills.

    Args:
        what: what it does wrong, an event of a family with its number (``slip@0.03``), or the file
            of plans that go before the shipped ones (``plans.yaml``); empty for the expert.

    Raises:
        ConfigError: if there is no such fault, or the file is no file of plans, or ends otherwise.
    """

    def __init__(self, what: str = "") -> None:
        of_file = what.endswith(FILE_ENDINGS)
        if not of_file and Path(what).suffix in OTHER_ENDINGS:
            raise ConfigError(
                f"scripted:{what}: a file of plans ends in {' or '.join(FILE_ENDINGS)}"
            )
        self._fault = find(what) if what and not of_file else None
        self._own = load(Path(what)) if of_file else {}
        own = {task: plan_of(entries) for task, entries in self._own.items()}
        super().__init__(
            self._fault.plans if self._fault else {**EXPERT, **own},
            f"scripted:{what}" if what else "scripted",
        )

    @property
    def fingerprint(self) -> str:
        """Digest of all the code, the plans and the faults."""
        return source_digest("expert", "faults") + (f" {self._own}" if self._own else "")

    def fingerprint_in(self, task: str) -> str:
        """Digest of the plan of one task and of the code that it stands on."""
        if self._fault is None:
            return plan_digest({**ENTRIES, **self._own}[task])
        return code_digest(self._fault.entries.get(task, ""), [self._fault.home])

    def staging(self, task: str) -> Staging:
        """What its fault wants otherwise in the episodes of a task."""
        return self._fault.staging.get(task, Staging()) if self._fault else Staging()
