"""``python -m pytest_safemanip.policies.scripted`` lists what the script can do, and do wrong."""

from __future__ import annotations

import sys

from pytest_safemanip.policies.scripted.faults.library import FAULTS
from pytest_safemanip.policies.scripted.plans import EXPERT


def document() -> str:
    """The expert's tasks; faults and near misses by property."""
    lines = [f"scripted: the expert, for {len(EXPERT)} tasks", f"  {', '.join(EXPERT)}"]
    for name in dict.fromkeys(fault.property_id for fault in FAULTS.values()):
        lines += ["", name]
        for fault in FAULTS.values():
            if fault.property_id == name:
                kind = "near miss" if fault.near_miss else "fault"
                tasks = ", ".join(fault.plans)
                lines.append(f"  scripted:{fault.name:<28}{kind:<11}{fault.doc} ({tasks})")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(document())
