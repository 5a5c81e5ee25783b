"""A generated recording as a small table: at each step, what changes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.trace.geometry import tilt
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene

MAX_ROWS = 40


def table(
    recording: Recording, values: Bools | None = None, marked: int | None = None
) -> list[str]:
    """Lines that show a recording; steps at which nothing changes are left out.

    Args:
        recording: a short one.
        values: of a proposition, shown beside it (T,).
        marked: a step that is shown whatever happens there.
    """
    scene = recording.scene
    things = [f"{b.entity} ({scene.entity[b.entity].category})" for b in scene.bodies]
    doors = [f"{j.entity} ({scene.entity[j.entity].category})" for j in scene.joints]
    lines = [
        f"{', '.join(things)}; {', '.join(dict.fromkeys(doors))}; "
        f"{len(recording.steps)} steps of {scene.control_period:g} s",
        f"  step{'  value' if values is not None else ''}  what changes",
    ]
    rows = []
    for step in range(len(recording.steps)):
        news = list(_news(recording, step))
        turned = values is not None and step > 0 and values[step] != values[step - 1]
        if news or turned or step == marked:
            value = "" if values is None else f"  {'1' if values[step] else '.':^5}"
            mark = ">" if step == marked else " "
            head = f"{mark} {step:>4}{value}  "
            first, *more = news or [""]
            rows += [f"{head}{first}".rstrip(), *(" " * len(head) + item for item in more)]
    if len(rows) > MAX_ROWS:
        rows = [*rows[:MAX_ROWS], f"   ...  {len(rows) - MAX_ROWS} more lines"]
    return lines + rows


def _news(recording: Recording, step: int) -> Iterator[str]:
    """The differences of a step from the one before."""
    steps, scene = recording.steps, recording.scene
    now, before = (_contacts(recording, t) for t in (step, step - 1))
    yield from (f"{pair}: {force:g} N" for pair, force in now.items() if before.get(pair) != force)
    yield from (f"{pair}: apart" for pair in before if pair not in now)
    hands = _hand_names(scene)
    poses = {name: steps.eef_poses[:, n] for n, name in enumerate(hands)}
    poses |= {body.entity: steps.object_pose[:, n] for n, body in enumerate(scene.bodies)}
    for name, pose in poses.items():
        if step == 0 or not np.array_equal(pose[step], pose[step - 1]):
            yield f"{name} at {_place(pose[step])}"
    twists = {name: steps.eef_twists[:, n] for n, name in enumerate(hands)}
    twists |= {body.entity: steps.object_twist[:, n] for n, body in enumerate(scene.bodies)}
    for name, twist in twists.items():
        rest = twist[step - 1] if step else np.zeros(6)
        if not np.array_equal(twist[step], rest):
            speed, spin = (float(np.linalg.norm(part)) for part in np.split(twist[step], 2))
            yield f"{name} moves at {speed:.2f} m/s, {spin:.2f} rad/s"
    numbers = {f"{j.key} open": steps.joint[:, n] for n, j in enumerate(scene.joints)}
    for n, name in enumerate(hands):
        gripper = "gripper" if len(hands) == 1 else name
        numbers[f"{gripper} open"] = steps.openings[:, n]
        numbers[f"{gripper} commanded"] = steps.commands[:, [n]]
    numbers |= {
        f"{s.entity}/{s.name} on": steps.switch[:, [n]] for n, s in enumerate(scene.switches)
    }
    for name, value in numbers.items():
        rest = value[step - 1] if step else np.zeros_like(value[0])
        if not np.array_equal(value[step], rest):
            rate = f", {value[step, 1]:g}/s" if value.shape[1] == 2 and value[step, 1] else ""
            yield f"{name} {value[step, 0]:g}{rate}"
    if steps.tail[step] and not steps.tail[step - 1]:
        yield "settle tail"


def _hand_names(scene: Scene) -> list[str]:
    if len(scene.grippers) == 1:
        return ["hand"]
    return [f"{gripper.name} hand" for gripper in scene.grippers]


def _contacts(recording: Recording, step: int) -> dict[str, float]:
    """Pairs that press on each other at a step, and how hard."""
    contacts, parts = recording.steps.contacts, recording.scene.parts
    first, stop = contacts.span(step, step + 1)
    found: dict[str, float] = {}
    for row in range(first, stop):
        a, b = parts[contacts.a[row]], parts[contacts.b[row]]
        pair = f"{a.entity}/{a.name} on {b.entity}/{b.name}"
        found[pair] = max(found.get(pair, 0.0), round(float(contacts.sustained[row]), 3))
    return found


def _place(pose: NDArray[np.float32]) -> str:
    x, y, z = (f"{value:.2f}" for value in pose[:3])
    angle = math.degrees(float(tilt(pose[3:])))
    return f"({x}, {y}, {z})" + (f" tilted {angle:.0f} deg" if angle > 0.5 else "")
