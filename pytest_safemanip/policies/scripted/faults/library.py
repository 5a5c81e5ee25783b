"""All faults and near misses, by name."""

from __future__ import annotations

from collections.abc import Mapping

from pytest_safemanip.policies.scripted.faults.acting import ACTING
from pytest_safemanip.policies.scripted.faults.anywhere import ANYWHERE
from pytest_safemanip.policies.scripted.faults.appliances import APPLIANCES
from pytest_safemanip.policies.scripted.faults.beside import BESIDE
from pytest_safemanip.policies.scripted.faults.bumping import BUMPING
from pytest_safemanip.policies.scripted.faults.chilled import CHILLED
from pytest_safemanip.policies.scripted.faults.containing import CONTAINING
from pytest_safemanip.policies.scripted.faults.contaminating import CONTAMINATING
from pytest_safemanip.policies.scripted.faults.crowding import CROWDING
from pytest_safemanip.policies.scripted.faults.depositing import DEPOSITING
from pytest_safemanip.policies.scripted.faults.enclosing import ENCLOSING
from pytest_safemanip.policies.scripted.faults.fault import Fault
from pytest_safemanip.policies.scripted.faults.holding import HOLDING
from pytest_safemanip.policies.scripted.faults.jamming import JAMMING
from pytest_safemanip.policies.scripted.faults.lighting import LIGHTING
from pytest_safemanip.policies.scripted.faults.passing_on import PASSING_ON
from pytest_safemanip.policies.scripted.faults.pouring import POURING
from pytest_safemanip.policies.scripted.faults.racking import RACKING
from pytest_safemanip.policies.scripted.faults.reaching import REACHING
from pytest_safemanip.policies.scripted.faults.releasing import RELEASING
from pytest_safemanip.policies.scripted.faults.shutting import SHUTTING
from pytest_safemanip.policies.scripted.faults.striking import STRIKING
from pytest_safemanip.policies.scripted.faults.switching import SWITCHING

FAULTS: Mapping[str, Fault] = {
    fault.name: fault
    for fault in (
        *RELEASING,
        *HOLDING,
        *ENCLOSING,
        *DEPOSITING,
        *RACKING,
        *JAMMING,
        *SHUTTING,
        *APPLIANCES,
        *REACHING,
        *CHILLED,
        *STRIKING,
        *BUMPING,
        *ACTING,
        *SWITCHING,
        *LIGHTING,
        *CROWDING,
        *CONTAINING,
        *BESIDE,
        *POURING,
        *CONTAMINATING,
        *PASSING_ON,
        *ANYWHERE,
    )
}
