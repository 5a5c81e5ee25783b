from __future__ import annotations

import shutil

import pytest

from pytest_safemanip.expert import digest
from pytest_safemanip.expert.tasks.plans import CALLS, ENTRIES, EXPERT
from pytest_safemanip.faults.library import FAULTS
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.policies.registry import resolve

PICK = "PickPlaceCounterToCabinet"
ALL = {*((task, "") for task in EXPERT), *((next(iter(f.plans)), n) for n, f in FAULTS.items())}


def handles(call):
    return call.skill.startswith(("grasp", "place", "lay"))


class Package:
    """A copy of the expert and its faults, with the digest of every task and fault as it is."""

    def __init__(self, root):
        self.root = root
        self.digests = self._digests()

    def changed_by(self, *edited):
        """Which digests an edit of some files changes, by task and fault."""
        before = self.digests
        for file in edited:
            (self.root / file).write_text((self.root / file).read_text() + "\nEDITED = True\n")
        self.digests = self._digests()
        return {key for key in ALL if self.digests[key] != before[key]}

    def _digests(self):
        return {(task, name): self._digest(task, name) for task, name in ALL}

    def _digest(self, task, name):
        if not name:
            return digest.plan_digest(ENTRIES[task], self.root)
        return digest.code_digest(FAULTS[name].entries[task], [FAULTS[name].home], self.root)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("package")
    for room in ("expert", "faults"):
        shutil.copytree(digest.ROOT / room, folder / room)
    return Package(folder)


def test_an_edited_fault_makes_its_own_recordings_stale_and_no_others(package):
    home = f"{digest.TOP}.faults.collision_contact.bumps"
    of_it = {name for name, fault in FAULTS.items() if fault.home == home}
    changed = package.changed_by("faults/collision_contact/bumps.py")
    assert {fault for _, fault in changed} == of_it


def test_an_edited_skill_makes_the_tasks_stale_that_use_it(package):
    assert package.changed_by("expert/tasks/stirring.py") == {("StirVegetables", "")}
    assert package.changed_by("expert/tasks/rinsing.py") == {("WashLettuce", "")}
    tasks = {task for task, fault in package.changed_by("expert/tasks/handling.py") if not fault}
    assert tasks == {task for task, calls in CALLS.items() if any(map(handles, calls))}


@pytest.mark.parametrize(
    "file",
    [
        "policy.py",
        "truth.py",
        "tasks/plans.py",
        "tasks/search.py",
        "world/knocks.py",
        "robot/arm.py",
    ],
)
def test_what_runs_every_plan_is_part_of_every_digest(package, file):
    assert package.changed_by(f"expert/{file}") == ALL


@pytest.mark.parametrize(
    "file",
    [
        "expert/tasks/skills.py",
        "expert/tasks/plans.yaml",
        "faults/library.py",
        "faults/collision_contact/faults.yaml",
    ],
)
def test_a_new_skill_plan_or_fault_leaves_recordings_as_they_are(package, file):
    assert not package.changed_by(file)


def test_another_plan_has_another_digest(monkeypatch):
    before = digest.plan_digest(ENTRIES["OpenDrawer"])
    monkeypatch.setitem(ENTRIES, "OpenDrawer", ENTRIES["OpenCabinet"])
    assert digest.plan_digest(ENTRIES["OpenDrawer"]) != before


def test_a_recording_is_recognised_by_the_digest_of_its_task_and_fault():
    spec = resolve("scripted", {})
    assert spec.fingerprint_in("OpenDrawer") != spec.fingerprint_in("CloseFridge")
    fault = resolve("scripted:half_inside", {})
    assert fault.fingerprint_in(PICK) != spec.fingerprint_in(PICK)


def test_an_edited_entry_makes_the_recordings_of_its_fault_stale():
    before = digest.code_digest(FAULTS["near_edge"].entries[PICK], [FAULTS["near_edge"].home])
    other = FAULTS["near_edge"].entries[PICK].replace("0.02", "0.03")
    assert digest.code_digest(other, [FAULTS["near_edge"].home]) != before
    assert Scripted("near_edge").fingerprint_in(PICK) == before
