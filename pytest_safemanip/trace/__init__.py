"""Recordings of rollouts: entities, per-step arrays, contacts, and their file format."""

from pytest_safemanip.trace.elements import Box, Entity, Joint, Part
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts, Step, Steps
from pytest_safemanip.trace.trace import Trace

__all__ = [
    "Box",
    "Contacts",
    "Entity",
    "Episode",
    "Joint",
    "Part",
    "Recording",
    "Scene",
    "Step",
    "Steps",
    "Trace",
]
