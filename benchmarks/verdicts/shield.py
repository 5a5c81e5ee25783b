"""What a shield prevents that stops a rollout at a warning, and what it disturbs.

    python -m benchmarks.verdicts.shield --seeds 100:103 [--only GLOB,...] [--out DIR] [--put]

The scripted policy's drops (faults of release_stability), slips (of grasp_stability) and blows (of
collision_contact), and its expert, are rolled out twice (what DIR already has is used again): as
they are, and with ``--safemanip-stop=warning``. A rollout that violates its own property without
the shield is prevented if with it that property is not violated; it is clean if no property is. The
expert is stopped for nothing where a warning ends a rollout that violates nothing without the
shield.
"""

from __future__ import annotations

import argparse
import fnmatch
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.options import add_seeds, as_option
from benchmarks.tables import put, table
from benchmarks.verdicts.recall import EXPERT, FAULTS, Judging, share
from pytest_safemanip.trace import files

DOCUMENT = Path(__file__).parents[2] / "docs" / "warnings.md"
GROUPS = {"drops": "release_stability", "slips": "grasp_stability", "blows": "collision_contact"}
"""The property whose faults are of each kind."""
STOPS = ("success", "warning")

Key = tuple[str, str, int]


@dataclass(frozen=True)
class Rolled:
    """A rollout, judged.

    Attributes:
        ended: why its acting part ended.
        success: whether the task succeeded.
        violated: properties that were violated.
    """

    ended: str
    success: bool
    violated: frozenset[str]


def record(policies: Sequence[str], seeds: Sequence[int], out: Path, stop: str) -> None:
    """Roll out what is not there yet."""
    command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-p", "no:cacheprovider"]
    command += ["-p", "no:xdist", f"--safemanip-policy={','.join(policies)}"]
    command += ["--safemanip-tasks=all", f"--safemanip-stop={stop}"]
    command += [f"--safemanip-seeds={as_option(seeds)}"]
    command += [f"--safemanip-out={out / stop}", "--safemanip-violations=xfail"]
    command += ["--safemanip-stepping=fast", "--safemanip-jobs=1"]
    status = subprocess.run(command, check=False).returncode
    if status not in (0, 1):
        sys.exit(f"the rollouts did not run through (pytest exit status {status})")


def rolled(policies: Iterable[str], seeds: Sequence[int], folder: Path) -> dict[Key, Rolled]:
    """The rollouts of these policies and seeds in a folder."""
    judging, wanted, found = Judging(), set(policies), dict[Key, Rolled]()
    for path in sorted((folder / "recordings").glob(f"*{files.SUFFIX}")):
        about = files.load_episode(path)
        if about.policy in wanted and about.seed in seeds:
            recording = files.load(path)
            verdicts = judging.verdicts(recording).items()
            violated = frozenset(name for name, verdict in verdicts if verdict.findings)
            key = about.task, about.policy, about.seed
            found[key] = Rolled(about.ended, recording.success, violated)
    return found


def of_faults(plain: Mapping[Key, Rolled], shielded: Mapping[Key, Rolled]) -> list[list[str]]:
    """A line for each kind of fault, and each fault."""
    lines = []
    for group, property_id in GROUPS.items():
        names = [f.name for f in FAULTS.values() if f.property_id == property_id]
        for name in ("", *names):
            chosen = {f"scripted:{one}" for one in ([name] if name else names)}
            both = [k for k in plain if k in shielded and k[1] in chosen]
            both = [k for k in both if property_id in plain[k].violated]
            if both:
                prevented = sum(property_id not in shielded[k].violated for k in both)
                clean = sum(not shielded[k].violated for k in both)
                cells = [str(len(both)), share(prevented, len(both)), str(clean)]
                lines.append([name or f"all {group}", *cells])
    return lines


def of_expert(plain: Mapping[Key, Rolled], shielded: Mapping[Key, Rolled]) -> list[list[str]]:
    """The line of the expert."""
    both = [k for k in plain if k in shielded and k[1] == EXPERT]
    safe = [k for k in both if not plain[k].violated]
    stopped = [k for k in safe if shielded[k].ended == "warning"]
    lost = sum(plain[k].success and not shielded[k].success for k in both)
    bad = [sum(bool(some[k].violated) for k in both) for some in (plain, shielded)]
    return (
        [[str(len(both)), f"{bad[0]} / {bad[1]}", f"{len(stopped)} of {len(safe)}", str(lost)]]
        if both
        else []
    )


def main() -> None:
    """Roll out, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "100:103")
    parser.add_argument("--only", default="*", help="globs of scripted, scripted:FAULT")
    parser.add_argument("--out", type=Path, default=Path(".safemanip/shield"))
    parser.add_argument(
        "--judge", action="store_true", help="judge what is there, roll nothing out"
    )
    parser.add_argument("--put", action="store_true", help=f"write tables into {DOCUMENT.name}")
    options = parser.parse_args()
    kinds = set(GROUPS.values())
    faults = [f for f in FAULTS.values() if f.property_id in kinds and not f.near_miss]
    known = [EXPERT, *(f"scripted:{fault.name}" for fault in faults)]
    globs = options.only.split(",")
    policies = [name for name in known if any(fnmatch.fnmatch(name, glob) for glob in globs)]
    if not policies:
        parser.error(f"--only {options.only}: nothing of that name; there are {', '.join(known)}")
    for stop in STOPS if not options.judge else ():
        record(policies, options.seeds, options.out, stop)
    both = [rolled(policies, options.seeds, options.out / stop) for stop in STOPS]
    texts = {
        "shield": table(["", "violated without", "prevented % (95 %)", "clean"], of_faults(*both)),
        "shield expert": table(
            ["rollouts", "violated without / with", "stopped for nothing", "successes lost"],
            of_expert(*both),
        ),
    }
    for name, text in texts.items():
        print(f"\n{name.capitalize()}\n\n{text}")
        if options.put:
            put(DOCUMENT, name, text)


if __name__ == "__main__":
    main()
