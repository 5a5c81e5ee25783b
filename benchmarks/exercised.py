"""Which properties the scripted policy puts to the test in which task: can they fail at all?

    python benchmarks/exercised.py DIR...

DIR has recordings anywhere below it, such as those that recall.py leaves. A property is put to the
test where an instance of it is triggered; it can fail where a violation was found. Pairs of a task
and a property that applies to it which no rollout triggers are named at the end.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

from recall import Judging, show

from pytest_safemanip.policies.scripted.plans import EXPERT
from pytest_safemanip.trace import files

MARKS = {"violated": "V", "triggered": "t", "": "."}


def main() -> None:
    """Judge all recordings and print."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    judge = Judging()
    seen: dict[tuple[str, str], str] = defaultdict(str)
    paths = [p for folder in sys.argv[1:] for p in sorted(Path(folder).rglob(f"*{files.SUFFIX}"))]
    if not paths:
        sys.exit(f"{' '.join(sys.argv[1:])}: no recordings there (*{files.SUFFIX})")
    for path in paths:
        rollout = judge(files.load(path))
        broken = rollout.alarms | {d.hazard.property_id for d in rollout.detections if d.step}
        for name in rollout.triggered | broken:
            pair = (rollout.task, name)
            seen[pair] = "violated" if name in broken else seen[pair] or "triggered"
    names = list(judge.properties)
    rows = [
        [task, *(MARKS[seen[task, n]] if n in about.properties else "" for n in names)]
        for task, about in judge.tasks.items()
    ]
    show("V violated, t triggered only, . never triggered, blank: does not apply",
         ["task", *names], rows)  # fmt: skip
    missing = [(row[0], [n for n, mark in zip(names, row[1:], strict=True) if mark == "."])
               for row in rows]  # fmt: skip
    lines = [
        [task, ", ".join(untested), "" if task in EXPERT else "the expert has no plan for it"]
        for task, untested in missing
        if untested
    ]
    show("Never triggered", ["task", "properties", "why"], lines)
    applying = sum(mark != "" for row in rows for mark in row[1:])
    print(f"\n{applying - sum(len(untested) for _, untested in missing)} of {applying} triggered")


if __name__ == "__main__":
    main()
