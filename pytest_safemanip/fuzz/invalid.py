"""Recordings with one number that cannot be."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.fuzz.changes import POSES, with_contacts, with_steps
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.steps import ARRAYS

if TYPE_CHECKING:
    from pytest_safemanip.fuzz.trial import Draw

_WORST = st.sampled_from((np.nan, np.inf, -np.inf))
_SEEDS = st.integers(0, 2**16)


def invalid(recording: Recording, draw: Draw) -> tuple[str, Recording]:
    """Draw an invalid number: a description, and the recording with it."""
    kinds = {"array": _array, "quaternion": _quaternion, "period": _period}
    if len(recording.steps.contacts):
        kinds["contact"] = _contact
    return kinds[draw(st.sampled_from(sorted(kinds)))](recording, draw)


def _array(recording: Recording, draw: Draw) -> tuple[str, Recording]:
    filled = [name for name in (*ARRAYS, "action") if getattr(recording.steps, name).size]
    name, value = draw(st.sampled_from(filled)), draw(_WORST)
    changed = _somewhere(getattr(recording.steps, name), value, draw)
    return f"{value} in {name}", with_steps(recording, **{name: changed})


def _quaternion(recording: Recording, draw: Draw) -> tuple[str, Recording]:
    name = draw(st.sampled_from([name for name in POSES if getattr(recording.steps, name).size]))
    poses = getattr(recording.steps, name).copy()
    poses[draw(st.integers(0, len(poses) - 1)), ..., 3:] *= np.float32(1.5)
    return f"a quaternion of length 1.5 in {name}", with_steps(recording, **{name: poses})


def _period(recording: Recording, draw: Draw) -> tuple[str, Recording]:
    period = draw(st.sampled_from((-0.05, 0.0, float("nan"))))
    scene = dataclasses.replace(recording.scene, control_period=period)
    return f"a control period of {period} s", dataclasses.replace(recording, scene=scene)


def _contact(recording: Recording, draw: Draw) -> tuple[str, Recording]:
    name, value = draw(st.sampled_from(("force", "sustained", "position", "normal"))), draw(_WORST)
    changed = _somewhere(getattr(recording.steps.contacts, name), value, draw)
    return f"{value} in contacts.{name}", with_contacts(recording, **{name: changed})


def _somewhere(array: Any, value: float, draw: Draw) -> Any:
    changed = array.copy()
    changed.flat[draw(_SEEDS) % changed.size] = value
    return changed
