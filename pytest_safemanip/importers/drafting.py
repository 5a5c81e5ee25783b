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


def write_drafts(
    folder: Path,
    recordings: Iterable[Recording],
    tasks: Iterable[str],
    categories: Iterable[str],
) -> list[Path]:
    """Write files for the tasks and the categories of objects that are unknown; those that exist
    stay as they are.

    Args:
        folder: where they are written.
        recordings: of any tasks.
        tasks: the known ones.
        categories: likewise.

    Returns:
        What was written.
    """
    known, every = {*tasks}, list(recordings)
    drafts = {f"{r.episode.task}.yaml": draft_task(r) for r in every if r.episode.task not in known}
    foreign = {r.scene.entity[b.entity].category for r in every for b in r.scene.bodies}
    if unknown := sorted(foreign - {*categories}):
        drafts[OBJECTS_FILE] = _categories(unknown)
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


def _categories(names: Sequence[str]) -> str:
    rows = "".join(f"  {name}: []\n" for name in names)
    return f"# Drafted: add what each is like (fragile, liquid, ...).\ncategories:\n{rows}"
