"""A task's file for recordings of a task that nobody has bound yet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from pytest_safemanip.spec.task import OBJECTS_FILE
from pytest_safemanip.trace.recording import Recording

_HEAD = """\
# Drafted from a recording: look through it. docs/tasks.md explains the keys.
task: {task}
sets: [imported]
suite: imported
horizon: atomic
"""
_PROPERTIES = {
    True: ("collision_contact", "grasp_stability", "release_stability"),
    False: ("collision_contact",),
}


def draft_task(recording: Recording) -> str:
    """The text of a task's file: its objects may be touched, and rest on what they rested on when
    the recording began and when it ended.
    """
    names = [body.entity for body in recording.scene.bodies]
    text = _HEAD.format(task=recording.episode.task)
    if names:
        text += f"objects: [{', '.join(names)}]\n"
        text += "touch:\n" + "".join(f"  {name}: [body]\n" for name in names)
        below = {name: _met(recording, name) for name in names}
        if any(below.values()):
            text += "supports:\n"
            text += "".join(f"  {n}: [{', '.join(found)}]\n" for n, found in below.items() if found)
    return text + f"properties: [{', '.join(_PROPERTIES[bool(names)])}]\n"


def _met(recording: Recording, name: str) -> list[str]:
    """The objects and fixtures that an object touches at the first step or at the last."""
    scene, contacts = recording.scene, recording.steps.contacts
    found = set()
    for step in (0, len(recording.steps) - 1):
        for row in range(*contacts.span(step, step + 1)):
            pair = [scene.parts[side[row]].entity for side in (contacts.a, contacts.b)]
            if name in pair:
                found |= {e for e in pair if scene.entity[e].kind in ("object", "fixture")}
    return sorted(found - {name})


class Drafts:
    """Files for the tasks and the categories of objects that nobody has described.

    Args:
        tasks: the known ones.
        categories: likewise.
    """

    def __init__(self, tasks: Iterable[str], categories: Iterable[str]) -> None:
        self._tasks, self._categories = {*tasks}, {*categories}
        self._texts: dict[str, str] = {}
        self._unknown: set[str] = set()

    def lack(self, task: str) -> bool:
        """Whether a task has neither a file nor a draft."""
        return task not in self._tasks and f"{task}.yaml" not in self._texts

    def note(self, recording: Recording) -> None:
        """Draft what a recording needs."""
        scene, task = recording.scene, recording.episode.task
        if self.lack(task):
            self._texts[f"{task}.yaml"] = draft_task(recording)
        found = {scene.entity[body.entity].category for body in scene.bodies}
        self._unknown |= found - self._categories

    def write(self, folder: Path) -> list[Path]:
        """Write them; those that exist stay as they are.

        Returns:
            What was written.
        """
        drafts = dict(self._texts)
        if self._unknown:
            drafts[OBJECTS_FILE] = _rows(sorted(self._unknown))
        written = []
        for name, text in drafts.items():
            path = folder / name
            if not path.exists():
                folder.mkdir(parents=True, exist_ok=True)
                scratch = path.with_name(f".{name}.new")
                scratch.write_text(text)
                scratch.replace(path)  # whoever finds a draft finds all of it
                written.append(path)
        return written


def _rows(names: Sequence[str]) -> str:
    rows = "".join(f"  {name}: []\n" for name in names)
    return f"# Drafted: add what each is like (fragile, liquid, ...).\ncategories:\n{rows}"
