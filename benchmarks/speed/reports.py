"""Time and size of the reports of small and large runs.

    python -m benchmarks.speed.reports

Some rollouts are recorded with the scripted expert and its faults, six of seven with a violation;
larger runs are these with other seeds, judged on ten properties each: their own, and copies of
these. `page s` is what writing the page takes, the judging of the rollouts with a violation among
it; `interactive s` is from its address in Chromium until the table of rollouts has answered to a
search, `timeline s` from a click on a rollout until its timeline stands.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.tables import table
from pytest_safemanip.report.page.writing import BESIDE, write_page
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.trace import files

FAULTS = ("half_inside", "drop_high", "over_edge", "tossed", "hangs_loose", "rolls_off")
PROPERTIES = 10


def record(folder: Path) -> None:
    """A run of rollouts with and without violations."""
    policies = ",".join(("scripted", *(f"scripted:{fault}" for fault in FAULTS)))
    command = [
        *(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q"),
        f"--safemanip-policy={policies}",
        "--safemanip-tasks=PickPlaceCounterToCabinet",
        "--safemanip-seeds=2",
        "--safemanip-assets=primitive",
    ]
    done = subprocess.run(command, check=False, cwd=folder, capture_output=True, text=True)
    if not (folder / ".safemanip" / "summary.json").exists():
        sys.exit(done.stdout[-3000:])


def enlarge(recorded: Path, folder: Path, rollouts: int) -> None:
    """A run of so many rollouts, made from those that are recorded."""
    summary = json.loads((recorded / "summary.json").read_text())
    (folder / "recordings").mkdir(parents=True)
    found = []
    for number in range(rollouts):
        base = summary["rollouts"][number % len(summary["rollouts"])]
        path = f"recordings/{number}{files.SUFFIX}"
        recording = files.load(recorded / base["recording"])
        episode = replace(recording.episode, seed=number)
        files.save(replace(recording, episode=episode), folder / path)
        verdicts = [*base["properties"], *copies(base["properties"])]
        found.append({**base, "seed": number, "recording": path, "properties": verdicts})
    kept = ("schema", "versions", "settings", "hashes", "provenance", "cases")
    document = {**{name: summary[name] for name in kept}, "rollouts": found}
    (folder / "summary.json").write_text(json.dumps(document))


def copies(verdicts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """As many as lack, with other names."""
    lacking = PROPERTIES - len(verdicts)
    return [{**own, "property": f"{own['property']}_copy"} for own in verdicts[:lacking]]


def with_copies(found: Definitions) -> Definitions:
    """The definitions, and each property once more with another name."""
    more = {f"{id_}_copy": replace(own, id=f"{id_}_copy") for id_, own in found.properties.items()}
    return replace(found, properties={**found.properties, **more})


def look_at(page: Path) -> tuple[float, float]:
    """Seconds until the table answers, and until a timeline stands."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        tab = browser.new_page()
        tab.goto("about:blank")
        began = time.perf_counter()
        tab.goto(page.as_uri(), wait_until="commit")
        tab.fill("#search", "half_inside")
        if " of " not in tab.inner_text("#count"):
            sys.exit("the table does not answer")
        interactive = time.perf_counter() - began
        began = time.perf_counter()
        tab.locator("#rollouts tbody a").last.click()
        tab.wait_for_selector(".timeline canvas")
        timeline = time.perf_counter() - began
        browser.close()
    return interactive, timeline


def measured(recorded: Path, folder: Path, rollouts: int) -> list[str]:
    """The row of a run."""
    enlarge(recorded, folder, rollouts)
    definitions = with_copies(load_definitions([], [], []))
    began, computing = time.perf_counter(), time.process_time()
    page = write_page(folder, definitions)
    written, computed = time.perf_counter() - began, time.process_time() - computing
    beside = sum(path.stat().st_size for path in (folder / BESIDE).glob("*"))
    size = page.stat().st_size
    interactive, timeline = look_at(page)
    shutil.rmtree(folder)
    return [
        str(rollouts),
        f"{written:.1f}",
        f"{computed:.1f}",
        f"{size / 1e6:.1f}",
        f"{beside / 1e6:.1f}",
        f"{interactive:.2f}",
        f"{timeline:.2f}",
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rollouts", type=int, nargs="+", default=[10, 100, 2500], metavar="N")
    parser.add_argument("--recorded", type=Path, metavar="DIR", help="the output of an earlier run")
    options = parser.parse_args()
    scratch = Path(tempfile.mkdtemp())
    try:
        if options.recorded is None:
            record(scratch)
        recorded = options.recorded or scratch / ".safemanip"
        rows = [measured(recorded, scratch / str(n), n) for n in options.rollouts]
        head = [
            "rollouts",
            "page s",
            "CPU s",
            "page MB",
            "beside MB",
            "interactive s",
            "timeline s",
        ]
        print(table(head, rows))
    finally:
        shutil.rmtree(scratch)


if __name__ == "__main__":
    main()
