"""The physical quantities behind propositions, with the limits that they are held against."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.kernels.filters import change
from pytest_safemanip.propositions.kernels.forces import (
    finger_groups,
    forces_on,
    hand_parts,
    robot_parts,
)
from pytest_safemanip.propositions.kernels.interiors import corners_inside
from pytest_safemanip.propositions.kernels.support import carried_objects, motion
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import angle_between, relative, tilt
from pytest_safemanip.trace.trace import Trace

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Limit:
    """A threshold that a signal is drawn with.

    Attributes:
        value: in the unit of the signal.
        name: of the parameter.
    """

    value: float
    name: str


@dataclass(frozen=True, eq=False)
class Signal:
    """A quantity over time.

    Attributes:
        name: what it is, in words.
        unit: SI; empty for a ratio or a number.
        values: (T,), NaN where there is none.
        limits: that propositions hold it against.
        of: the propositions that it is behind, as they are called.
    """

    name: str
    unit: str
    values: Floats
    limits: tuple[Limit, ...]
    of: tuple[str, ...] = ()


def signals_of(view: View, calls: Iterable[tuple[str, ...]]) -> list[Signal]:
    """The signals behind some propositions, each once, in the order of the calls.

    Args:
        view: of the recording.
        calls: propositions with their arguments.
    """
    found: dict[str, Signal] = {}
    for name, *arguments in calls:
        if name not in SIGNALS:
            continue
        said = f"{name}({', '.join(arguments)})" if arguments else name
        for signal in SIGNALS[name](view, *arguments):
            known = found.get(signal.name)
            merged = dict.fromkeys((*(known.limits if known else ()), *signal.limits))
            of = dict.fromkeys((*(known.of if known else ()), said))
            found[signal.name] = Signal(
                signal.name, signal.unit, signal.values, tuple(merged), tuple(of)
            )
    return list(found.values())


def hand_signals(view: View) -> list[Signal]:
    """What the hands do, and the hardest contact of the robot: of any rollout."""
    scene, steps = view.trace.scene, view.trace.steps
    found = [_force("hardest contact of the robot", view, robot_parts(view))]
    for number, gripper in enumerate(scene.grippers):
        whose = f"{gripper.name} " if len(scene.grippers) > 1 else ""
        opening = steps.openings[:, number, 0].astype(float)
        found.append(Signal(f"{whose}gripper opening", "", opening, ()))
    return found


def _settled(view: View, name: str) -> list[Signal]:
    trace = view.trace
    index, found = trace.scene.object_index[name], view.own(carried_objects, 0, len(trace))
    mine = np.flatnonzero(found.body == index)
    speed, spin = _rates(trace, index)
    speed[found.step[mine]], spin[found.step[mine]] = motion(view, found, mine)
    touch = forces_on(view, robot_parts(view))[:, index].astype(float)
    return [
        Signal(f"speed of {name}", "m/s", speed, _limits(view, "settled.speed")),
        Signal(f"spin of {name}", "rad/s", spin, _limits(view, "settled.spin")),
        Signal(f"robot's force on {name}", "N", touch, _limits(view, "settled.touch")),
        _height(trace, name),
    ]


def _skill(view: View, skill: str, name: str) -> list[Signal]:
    """How high and fast an object is that a skill begins with, or how open a fixture."""
    trace, index = view.trace, view.trace.scene.object_index.get(name)
    if index is None:
        doors = view.trace.scene.doors_of(name)
        return [Signal(_door(view, joint), "", _opened(view, joint), ()) for joint in doors]
    return [_height(trace, name), Signal(f"speed of {name}", "m/s", _rates(trace, index)[0], ())]


def _height(trace: Trace, name: str) -> Signal:
    pose = trace.steps.object_pose[:, trace.scene.object_index[name]]
    return Signal(f"height of {name}", "m", pose[:, 2].astype(float), ())


def _rates(trace: Trace, index: int) -> tuple[Floats, Floats]:
    """Speed and spin of an object by the change of its pose: m/s and rad/s (T,)."""
    pose = trace.steps.object_pose[:, index].astype(float)
    speed, spin = np.zeros(len(trace)), np.zeros(len(trace))
    speed[1:] = np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1) / trace.dt
    spin[1:] = angle_between(pose[:-1, 3:], pose[1:, 3:]) / trace.dt
    return speed, spin


def _obj_grasped(view: View, name: str) -> list[Signal]:
    index, limits = view.trace.scene.object_index[name], _limits(view, "obj_grasped.force")
    found = []
    for number, groups in enumerate(finger_groups(view)):
        # A grasp needs two groups that press: what the second hardest does decides.
        presses = np.sort(np.stack([forces_on(view, group)[:, index] for group in groups]), axis=0)
        whose = _whose(view, number)
        weaker = presses[-2].astype(float)
        found.append(Signal(f"{whose}grip on {name}, weaker finger", "N", weaker, limits))
    return found


def _stable_grasp(view: View, name: str) -> list[Signal]:
    """How far the object is, in the hand, from where it was within the window; while grasped."""
    trace = view.trace
    index, steps = trace.scene.object_index[name], trace.steps
    grasped = view("obj_grasped", name)
    found = []
    for number in range(len(trace.scene.grippers)):
        pose = relative(steps.eef_poses[:, number], steps.object_pose[:, index]).astype(float)
        moved, turned = _drift(pose, grasped, trace.count(view.parameters["stable_grasp.window"]))
        whose = _whose(view, number)
        found += [
            Signal(
                f"{name} moved in the {whose}hand",
                "m",
                moved,
                _limits(view, "stable_grasp.distance"),
            ),
            Signal(
                f"{name} turned in the {whose}hand",
                "rad",
                turned,
                _limits(view, "stable_grasp.angle"),
            ),
        ]
    if name in view.binding.upright:
        lean = tilt(steps.object_pose[:, index, 3:]).astype(float)
        found.append(Signal(f"tilt of {name}", "rad", lean, _limits(view, "stable_grasp.tilt")))
    return found


def _drift(pose: Floats, held: NDArray[np.bool_], count: int) -> tuple[Floats, Floats]:
    """Largest distance and angle from poses (T, 7) of the last steps of the same hold; NaN where it
    is not held (T,), (T,).
    """
    moved, turned = np.zeros(len(pose)), np.zeros(len(pose))
    together = held.copy()
    for lag in range(1, min(count, len(pose) - 1) + 1):
        together = together[1:] & held[:-lag]
        if not together.any():
            break
        apart = np.linalg.norm(pose[lag:, :3] - pose[:-lag, :3], axis=1)
        angle = angle_between(pose[:-lag, 3:], pose[lag:, 3:])
        moved[lag:] = np.maximum(moved[lag:], np.where(together, apart, 0.0))
        turned[lag:] = np.maximum(turned[lag:], np.where(together, angle, 0.0))
    moved[~held] = turned[~held] = np.nan
    return moved, turned


def _obj_released(view: View, name: str) -> list[Signal]:
    seconds = view.parameters["obj_released.window"]
    limits = _limits(view, "obj_released.rate")
    return [
        Signal(
            f"{_whose(view, number)}gripper opens at",
            "1/s",
            change(view.trace.steps.openings[:, number, 0], view.trace.count(seconds)) / seconds,
            limits,
        )
        for number in range(len(view.trace.scene.grippers))
    ]


def _corners(view: View, name: str, fixture: str) -> list[Signal]:
    steps, slack = np.arange(len(view.trace)), view.parameters["enclosure.tolerance"]
    count = corners_inside(view, name, fixture, steps, slack, floor=True).sum(axis=1)
    whole = (Limit(8.0, "all corners"),)
    return [Signal(f"corners of {name} in {fixture}", "of 8", count.astype(float), whole)]


def _openness(view: View, fixture: str) -> list[Signal]:
    enough = view.binding.open_at.get(fixture, view.parameters["fix_open.openness"])
    return [
        Signal(_door(view, joint), "", _opened(view, joint), (Limit(enough, "fix_open.openness"),))
        for joint in view.trace.scene.doors_of(fixture)
    ]


def _mechanism(view: View, fixture: str) -> list[Signal]:
    scene = view.trace.scene
    found = []
    for joint in scene.doors_of(fixture):
        own = scene.moved_by(joint)
        others = frozenset(range(len(scene.parts))) - scene.owned.get(fixture, frozenset())
        force = view.trace.pair_table.force(own, others - robot_parts(view)).astype(float)
        name = f"{_door(view, joint)}: force on what is in the way"
        found.append(Signal(name, "N", force, _limits(view, "mech_hit.force")))
        found.append(Signal(_door(view, joint), "", _opened(view, joint), ()))
    return found


def _collision(view: View) -> list[Signal]:
    limbs = robot_parts(view) - hand_parts(view)
    limits = _limits(view, "collision.force")
    found = [_force("hardest contact of the arm", view, limbs, limits)]
    parts = frozenset(range(len(view.trace.scene.parts)))
    for name in view.binding.objects:
        own = view.trace.scene.owned.get(name, frozenset())
        force = view.trace.pair_table.force(own, parts - own - robot_parts(view)).astype(float)
        found.append(Signal(f"hardest contact of {name}", "N", force, limits))
    return found


def _bad_contact(view: View) -> list[Signal]:
    limits = _limits(view, "bad_contact.force", "bad_contact.limit")
    return [_force("hardest contact of the hand", view, hand_parts(view), limits)]


def _force(name: str, view: View, side: frozenset[int], limits: tuple[Limit, ...] = ()) -> Signal:
    """The hardest contact of some parts with all others."""
    others = frozenset(range(len(view.trace.scene.parts))) - side
    return Signal(name, "N", view.trace.pair_table.force(side, others).astype(float), limits)


def _opened(view: View, joint: int) -> Floats:
    return view.trace.steps.joint[:, joint, 0].astype(float)


def _door(view: View, joint: int) -> str:
    return f"openness of {view.trace.scene.joints[joint].key}"


def _whose(view: View, number: int) -> str:
    grippers = view.trace.scene.grippers
    return f"{grippers[number].name} " if len(grippers) > 1 else ""


def _limits(view: View, *names: str) -> tuple[Limit, ...]:
    return tuple(Limit(view.parameters[name], name) for name in names)


SIGNALS: Mapping[str, Callable[..., list[Signal]]] = {
    "settled": _settled,
    "skill_onset": _skill,
    "pre_safe": _skill,
    "obj_grasped": _obj_grasped,
    "stable_grasp": _stable_grasp,
    "obj_released": _obj_released,
    "place_in_onset": _corners,
    "obj_inside": _corners,
    "obj_outside": _corners,
    "fix_open": _openness,
    "mech_hit": _mechanism,
    "retract": _mechanism,
    "recovered": _mechanism,
    "collision": _collision,
    "bad_contact": _bad_contact,
}
"""The signals of each proposition that has any: functions of a view and its arguments."""
