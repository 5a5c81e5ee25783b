"""Which properties the scripted policy puts to the test in which task: can they fail at all?

    python -m benchmarks.verdicts.exercised [--put] DIR...

DIR has recordings anywhere below it, such as those that recall.py leaves. A property is put to the
test where an instance of it is triggered; it can fail where a violation was found. Pairs of a task
and a property that applies to it which no rollout triggers are named at the end; docs/coverage.md
says why. ``--put`` writes the tables into it.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from benchmarks.recordings import below, load
from benchmarks.tables import put, table
from benchmarks.verdicts.recall import Judging

DOCUMENT = Path(__file__).parents[2] / "docs" / "coverage.md"
MARKS = {"violated": "V", "triggered": "t", "": "."}


def main() -> None:
    """Judge all recordings and print."""
    folders = [argument for argument in sys.argv[1:] if argument != "--put"]
    if not folders:
        sys.exit(__doc__)
    paths = below(list(map(Path, folders)))
    judge = Judging()
    seen = marks(judge, paths)
    names = list(judge.properties)
    rows = [
        [task, *(MARKS[seen[task, n]] if n in about.properties else "" for n in names)]
        for task, about in judge.tasks.items()
    ]
    untested = [
        [row[0], ", ".join(missing)]
        for row in rows
        if (missing := [n for n, mark in zip(names, row[1:], strict=True) if mark == "."])
    ]
    applying = [mark for row in rows for mark in row[1:] if mark]
    count = f"{sum(mark != '.' for mark in applying)} of {len(applying)} were triggered."
    tables = {
        "count": f"V violated, t triggered only, . never triggered, blank: does not apply. {count}",
        "pairs": table(["task", *names], rows),
        "never triggered": table(["task", "properties"], untested),
    }
    for name, text in tables.items():
        print(f"\n{text}")
        if "--put" in sys.argv:
            put(DOCUMENT, name, text)


def marks(judge: Judging, paths: Sequence[Path]) -> dict[tuple[str, str], str]:
    """What recordings show of each task and property."""
    seen: dict[tuple[str, str], str] = defaultdict(str)
    for path in paths:
        rollout = judge(load(path))
        broken = rollout.alarms | {d.hazard.property_id for d in rollout.detections if d.step}
        for name in rollout.triggered | broken:
            pair = (rollout.task, name)
            seen[pair] = "violated" if name in broken else seen[pair] or "triggered"
    return seen


if __name__ == "__main__":
    main()
