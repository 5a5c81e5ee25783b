"""Description of an episode: the part of a recording that no verdict depends on."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.hazard import Hazard

POLICY_NAME = re.compile(r"[\w.:/@=+-]{1,200}")
"""Pattern of policy names, which are part of node ids and file names."""

MOST_HAZARDS = 100
LONGEST_BINDING = 50_000
LONGEST_FAILURE = 1000
"""Characters of what a policy says about why it gave up, and of a warning."""
MOST_STEPS = 2**32
"""More than a rollout or a seed can have."""

MOST_DISTURBANCES = 100
Ended = Literal["success", "horizon", "policy", "violation", "stalled", "warning"]

_TEXTS = ("task", "policy", "instruction", "ended", "backend", "scenes", "stepping", "assets")


@dataclass(frozen=True, repr=False)
class Episode:
    """Description of an episode.

    Attributes:
        task: name of the task.
        seed: of the environment and of the policy.
        policy: as the user named it.
        instruction: the task's instruction in this episode.
        horizon: control steps after which the rollout ends without success.
        ended: why the acting part ended: the task succeeded, its time was over, the policy said
            that it was done, a property was violated that ends rollouts, or was going to be, or
            nothing moved any more.
        backend: name of the simulator backend.
        scenes: which family of scenes.
        stepping: how it was asked to be stepped, ``exact`` or ``fast``.
        assets: which assets: ``official``, ``primitive`` or ``mixed``.
        versions: package name to version, of everything that moves the physics.
        hashes: digest of the backend's and policy's code, of the assets and of the start state.
        served: of a policy behind a server: endpoint, protocol, whether it took the seed, how many
            calls and actions there were and how many entries were clipped. Of any other policy how
            many entries of its actions were clipped, if some were. With either,
            ``entries``: those of one action.
        hazards: what a policy did wrong on purpose; monitors do not see it.
        request: what else the simulator was asked for, in plain values: the kitchen, what objects
            were drawn from, what stood elsewhere.
        patches: names of what was changed in other people's code while it ran.
        origin: of a recording that was made from other data: the source and the episode in it, how
            far physics drifted from it, what was assumed, and what was not observed.
        binding: of a task that the backend derives from its simulator's files: the content of the
            file that it would have in ``tasks/``, by which it can be judged anywhere.
        failure: why a policy gave up, in its own words; empty if it did not, or did not say.
        disturbances: what went wrong on purpose while it ran, each its ``kind`` and its sizes, in
            SI units.
        repeat: how often the same had been run before: what is random in the policy and in
            disturbances is drawn anew each time.
        warned: the violation that was near where a warning ended the acting part; else empty.
    """

    task: str
    seed: int
    policy: str
    instruction: str
    horizon: int
    ended: Ended
    backend: str
    scenes: str
    stepping: str
    assets: str
    versions: Mapping[str, str]
    hashes: Mapping[str, str]
    served: Mapping[str, str]
    hazards: tuple[Hazard, ...] = ()
    request: Mapping[str, Any] = field(default_factory=dict)
    patches: tuple[str, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)
    binding: str = ""
    failure: str = ""
    disturbances: tuple[Mapping[str, Any], ...] = ()
    repeat: int = 0
    warned: str = ""

    def __repr__(self) -> str:
        return f"<Episode {self.task}, {self.policy}, seed {self.seed}: {self.ended}>"

    @property
    def unobserved(self) -> frozenset[str]:
        """What was not observed, of :data:`~pytest_safemanip.trace.observed.KINDS`."""
        return frozenset(filter(None, self.origin.get("unobserved", "").split(", ")))

    def to_json(self) -> dict[str, Any]:
        """Plain builtins, for the recording's header."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Episode:
        """The inverse of :meth:`to_json`.

        Raises:
            TraceError: if a field is missing, unknown or of the wrong type.
        """
        hazards = data.get("hazards", ())
        if not isinstance(hazards, list | tuple) or len(hazards) > MOST_HAZARDS:
            raise TraceError(f"episode: hazards must be a list of at most {MOST_HAZARDS}")
        patches = data.get("patches", ())
        if not isinstance(patches, list | tuple) or not all(isinstance(p, str) for p in patches):
            raise TraceError("episode: patches must be a list of strings")
        known: dict[str, Any] = {"hazards": tuple(map(Hazard.from_json, hazards))}
        known |= {"patches": tuple(patches), "disturbances": _disturbances(data)}
        try:
            episode = cls(**{**data, **known})
        except TypeError as error:
            raise TraceError(f"episode: malformed description ({error})") from error
        for name in _TEXTS:
            if not isinstance(getattr(episode, name), str):
                raise TraceError(f"episode: {name} must be a string")
            if name not in ("instruction", "policy") and not getattr(episode, name).isprintable():
                raise TraceError(f"episode: {name} must be printable")
        if not isinstance(episode.binding, str) or len(episode.binding) > LONGEST_BINDING:
            raise TraceError(f"episode: binding must be text, at most {LONGEST_BINDING} long")
        for name in ("failure", "warned"):
            said = getattr(episode, name)
            if not isinstance(said, str) or not said.isprintable() or len(said) > LONGEST_FAILURE:
                raise TraceError(f"episode: {name} must be a line of at most {LONGEST_FAILURE}")
        for name in ("seed", "horizon", "repeat"):
            value = getattr(episode, name)
            if type(value) is not int or not 0 <= value <= MOST_STEPS:
                raise TraceError(f"episode: {name} must be an integer from 0 up to {MOST_STEPS}")
        if episode.ended not in get_args(Ended):
            known_ends = ", ".join(get_args(Ended))
            raise TraceError(f"episode: ended must be one of {known_ends}, found {episode.ended!r}")
        for name in ("versions", "hashes", "served", "origin"):
            if not _maps_strings(getattr(episode, name)):
                raise TraceError(f"episode: {name} must be a mapping to strings")
        if fault := served_fault(episode.served):
            raise TraceError(f"episode: served: {fault}")
        if not isinstance(episode.request, dict):
            raise TraceError("episode: request must be a mapping")
        if not POLICY_NAME.fullmatch(episode.policy):
            raise TraceError(f"episode: {episode.policy!r} is no name of a policy")
        return episode


def _disturbances(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    found = data.get("disturbances", ())
    if not isinstance(found, list | tuple) or len(found) > MOST_DISTURBANCES:
        raise TraceError(f"episode: disturbances must be a list of at most {MOST_DISTURBANCES}")
    if not all(isinstance(own, dict) and isinstance(own.get("kind"), str) for own in found):
        raise TraceError("episode: each of its disturbances must be a mapping with a kind")
    return tuple(found)


def _maps_strings(value: object) -> bool:
    return isinstance(value, dict) and all(
        isinstance(s, str) for item in value.items() for s in item
    )


def served_fault(served: Mapping[str, str]) -> str:
    """What is wrong with the facts about a policy's server, or with the count of clipped entries;
    empty if nothing is.
    """
    if not _maps_strings(served):
        return "must be a mapping to strings"
    counts = ("calls", "actions", "clipped") if "protocol" in served else ()
    for name in (*counts, *(name for name in served if name in ("clipped", "entries"))):
        if not re.fullmatch("[0-9]{1,15}", served.get(name, "")):
            return f"{name} must be a count, found {served.get(name, 'nothing')!r}"
    if "protocol" in served and served.get("seeded") not in ("yes", "no"):
        return f"seeded must be yes or no, found {served.get('seeded', 'nothing')!r}"
    return ""
