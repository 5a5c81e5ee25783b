"""Visibility: whether any camera sees an object."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.margins import NONE, under
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
    return occluded_margin(view, name) > 0.0


def occluded_margin(view: View, name: str) -> Floats:
    """How little is seen, at the steps that are asked for (T,)."""
    found = np.full(len(view.trace), NONE)
    asked = np.arange(view.since, view.until)
    found[asked] = under(visible_share(view, name, asked), view.parameters[SHARE.name])
    return found


def occluded_evidence(view: View, name: str, step: int) -> list[str]:
    """How much is seen."""
    share = float(visible_share(view, name, np.array([step]))[0])
    return [f"of {name} {share:.0%} is seen by a camera"]


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
        margin=occluded_margin,
        evidence=occluded_evidence,
        sparse=True,
        lacks=grounding.camera,
        reads=_reads,
    ),
)
