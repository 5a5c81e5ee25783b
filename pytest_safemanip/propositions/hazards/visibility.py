"""Visibility: whether any camera sees an object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.kernels.sight import visible_share
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

SHARE = Parameter(
    "occluded_from_cameras.share", "", 0.25, "of a corner alone nobody says what it belongs to"
)


def occluded_from_cameras(view: View, name: str) -> Bools:
    """Less than ``occluded_from_cameras.share`` of the object is seen by any camera: of nine points
    of it, the middle of its box and eight half way out to its corners, those that are in the field
    of view of a camera with no box in between. Boxes are those of other objects and the solid
    pieces of fixtures and room, but for those that the camera or the point is in: a bowl does not
    hide what lies in it from above. The robot hides nothing.
    """
    found = np.zeros(len(view.trace), bool)
    asked = np.arange(view.since, view.until)
    found[asked] = _share(view, name, asked) < view.parameters[SHARE.name]
    return found


def occluded_evidence(view: View, name: str, step: int) -> list[str]:
    """How much is seen."""
    share = float(_share(view, name, np.array([step]))[0])
    return [f"of {name} {share:.0%} is seen by a camera"]


def _share(view: View, name: str, steps: NDArray[np.intp]) -> NDArray[np.float64]:
    """Share of an object's points that some camera sees, at some steps (K,)."""
    return visible_share(view, name, steps)


def _reads(inputs: Inputs, name: str) -> Found:
    fixtures = (entity.name for entity in inputs.scene.entities)
    return inputs.cameras() | inputs.poses(*inputs.objects) | inputs.joints(*fixtures)


PROPOSITIONS = (
    Proposition(
        "occluded_from_cameras",
        ("object",),
        lambda _: 0.0,
        (SHARE,),
        occluded_from_cameras,
        evidence=occluded_evidence,
        sparse=True,
        lacks=grounding.camera,
        reads=_reads,
    ),
)
