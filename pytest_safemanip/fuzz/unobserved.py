"""The law about what was not observed: it does not matter for a value that is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.fuzz.changes import with_steps
from pytest_safemanip.fuzz.recordings import recordings
from pytest_safemanip.fuzz.trial import Draw, Trial
from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.observed.inputs import HANDS, Kind
from pytest_safemanip.propositions.observed.known import Observations, Unobserved
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts

_MOST = 10_000
_GAPS = 3
"""Stretches of steps, at most, at which something is not observed."""


def unobserved(trial: Trial, draw: Draw) -> None:
    """Values that are known are the same when something else happens where nobody looks."""
    recording, length = trial.recording, len(trial.recording.steps)
    there = st.just(recording.scene)
    elsewhere = draw(recordings(there, min_steps=length, max_steps=length))
    missing = _missing(recording.scene, length, draw)
    other = trial.on(_completed(recording, elsewhere, missing))
    for arguments in trial.calls:
        known = _known(trial, arguments, missing)
        values = trial.values(arguments)
        found = np.where(known, other(arguments), values)
        trial.expect(arguments, found, values, "when what was not observed is something else")


def _missing(scene: Scene, length: int, draw: Draw) -> list[Unobserved]:
    """What is not observed at each step."""
    inputs: list[tuple[Kind, str]] = [
        *(("pose", body.entity) for body in scene.bodies),
        *(("boxes", name) for name in sorted({box.entity for box in scene.boxes})),
        *(("joints", name) for name in sorted({joint.entity for joint in scene.joints})),
        *(("switches", name) for name in sorted({switch.entity for switch in scene.switches})),
        *(("particles", liquid.entity) for liquid in scene.liquids),
        *((kind, "") for kind in (*HANDS, "cameras")),
    ]
    everything = frozenset(range(len(scene.parts)))
    hand = {name for gripper in scene.grippers for name in gripper.parts}
    unfelt = (
        everything,
        everything - scene.owned.get(ROBOT, frozenset()),
        everything - frozenset(scene.parts_of(ROBOT, sorted(hand))),
        *(everything - own for own in scene.owned.values()),
    )
    kinds = [
        *(Unobserved(frozenset((one,))) for one in inputs),
        *(Unobserved(frozenset(), u) for u in unfelt),
    ]
    found = [Unobserved()] * length
    for _ in range(draw(st.integers(1, _GAPS))):
        first, what = draw(st.integers(0, length - 1)), draw(st.sampled_from(kinds))
        for step in range(first, draw(st.integers(first + 1, length))):
            before = found[step]
            found[step] = Unobserved(before.names | what.names, before.unfelt | what.unfelt)
    return found


def _completed(seen: Recording, other: Recording, missing: Sequence[Unobserved]) -> Recording:
    """A recording with what another one has where something is missing."""
    scene, rows = seen.scene, [seen.steps.contacts, other.steps.contacts]
    arrays = {name: getattr(seen.steps, name).copy() for name in (*_OF_THINGS, *_OF_HANDS)}
    for step, lack in enumerate(missing):
        for kind, entity in lack.names:
            for name, places in _places(scene, kind, entity):
                arrays[name][step, places] = getattr(other.steps, name)[step, places]
    blind = np.zeros((len(missing), len(scene.parts)), bool)
    for step, lack in enumerate(missing):
        blind[step, list(lack.unfelt)] = True
    kept = []
    for contacts, wanted in zip(rows, (False, True), strict=True):
        unfelt = blind[contacts.step, contacts.a] & blind[contacts.step, contacts.b]
        kept.append({f.name: getattr(contacts, f.name)[unfelt == wanted] for f in _COLUMNS})
    columns = {name: np.concatenate([part[name] for part in kept]) for name in kept[0]}
    order = np.argsort(columns["step"], kind="stable")
    contacts = Contacts(**{name: column[order] for name, column in columns.items()})
    return with_steps(seen, contacts=contacts, **arrays)


_COLUMNS = dataclasses.fields(Contacts)
_OF_THINGS = (
    *("object_pose", "object_twist", "box_pose", "joint", "switch"),
    *("particles", "camera_pose"),
)
_OF_HANDS: dict[str, Kind] = {
    "eef_poses": "hands",
    "eef_twists": "hands",
    "openings": "openings",
    "commands": "commands",
}


def _places(scene: Scene, kind: Kind, entity: str) -> list[tuple[str, list[int]]]:
    """The arrays that an input is in, and where."""
    match kind:
        case "pose":
            own = [scene.object_index[entity]]
            return [("object_pose", own), ("object_twist", own)]
        case "boxes":
            return [("box_pose", [k for k, box in enumerate(scene.boxes) if box.entity == entity])]
        case "joints":
            return [("joint", scene.joints_of(entity))]
        case "switches":
            own = [k for k, switch in enumerate(scene.switches) if switch.entity == entity]
            return [("switch", own)]
        case "particles":
            return [("particles", list(range(*scene.particles[entity].indices(_MOST))))]
        case "cameras":
            return [("camera_pose", list(range(len(scene.cameras))))]
    hands = list(range(len(scene.grippers)))
    return [(name, hands) for name, of in _OF_HANDS.items() if of == kind]


def _known(trial: Trial, arguments: tuple[str, ...], missing: Sequence[Unobserved]) -> Bools:
    """At which steps the value is known (T,)."""
    view, now, known = trial.view(), 0, []
    observations = Observations(
        trial.recording.scene,
        trial.binding,
        trial.parameters,
        trial.catalogue,
        lambda call: bool(view(*call)[now]),
        lambda compute: bool(compute(view)[now]),
    )
    contacts = trial.recording.steps.contacts
    for now, lack in enumerate(missing):
        rows = slice(*contacts.span(now, now + 1))
        pairs = zip(contacts.a[rows].tolist(), contacts.b[rows].tolist(), strict=True)
        felt = {(min(p), max(p)) for p in pairs if not lack.unfelt.issuperset(p)}
        observations.add(lack, felt)
        known.append(observations.knows((trial.proposition.name, *arguments)))
    return np.array(known)
