"""One rollout over time: what propositions said, what monitors made of it, what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pytest_safemanip.judge import Finding, Judge, Verdict
from pytest_safemanip.ltlf import InstanceVerdict, Profile
from pytest_safemanip.ltlf.dfa import Dfa
from pytest_safemanip.report.lanes import label_of
from pytest_safemanip.report.page.encoding import changes, packed, runs, told
from pytest_safemanip.report.page.signals import Signal, hand_signals, signals_of
from pytest_safemanip.report.replay.packing import guilty_entities
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace.recording import Recording

Json = dict[str, Any]
MAX_SIGNALS = 16
"""Of a rollout: those behind its first violations."""
MAX_PROOF = 8_000
"""Characters of the text that proves a violation."""


@dataclass(frozen=True)
class Judged:
    """A recording with the verdicts on it.

    Attributes:
        recording: what happened.
        judge: of it.
        profile: the semantics.
        properties: those that were judged, by id.
        verdicts: by id.
    """

    recording: Recording
    judge: Judge
    profile: Profile
    properties: Mapping[str, Property]
    verdicts: Mapping[str, Verdict]


def timeline(judged: Judged) -> Json:
    """Everything that the page draws over the steps of a rollout.

    Keys: ``dt`` (s), ``steps``, ``acting`` (how many there are before the settle tail),
    ``success`` (run-length-coded), ``instruction``, ``episode``, ``entities`` (what each is),
    ``properties`` (with their instances that were triggered), ``signals``, ``moments``.
    """
    recording, episode = judged.recording, judged.recording.episode
    properties = [_property(judged, id_) for id_ in judged.properties]
    shown = [own for prop in properties for own in prop["instances"]]
    named = {name for own in shown for name in own["entities"]}
    named |= {name for own in shown for found in own["findings"] for name in found["guilty"]}
    known = recording.scene.entity
    content = {
        "dt": recording.trace.dt,
        "steps": len(recording.steps),
        "acting": recording.acting,
        "success": runs(recording.steps.success),
        "instruction": episode.instruction,
        "episode": {
            "backend": episode.backend,
            "scenes": episode.scenes,
            "assets": episode.assets,
            "stepping": episode.stepping,
            "ended": episode.ended,
        },
        "entities": {name: known[name].category for name in sorted(named & known.keys())},
        "properties": properties,
        "moments": moments(judged),
    }
    return {**told(content), "signals": [_signal(signal) for signal in _signals(judged)]}


def _property(judged: Judged, id_: str) -> Json:
    """A property with those of its instances at which something happened."""
    prop, verdict = judged.properties[id_], judged.verdicts[id_]
    dfa = prop.dfa(judged.profile, dt=judged.recording.trace.dt)
    return {
        "id": id_,
        "title": prop.title,
        "source": prop.source,
        "category": prop.category,
        "formula": verdict.formula,
        "deadline": prop.deadline_s if judged.profile == "timed" else None,
        "discharged_by": prop.discharged_by,
        "outcome": verdict.outcome.label,
        "triggered": verdict.triggered,
        "count": verdict.instances,
        "states": [
            {"residual": _residual(dfa, state), "kind": dfa.classes[state].value}
            for state in range(len(dfa))
        ],
        "instances": _instances(judged, prop, dfa),
    }


def _residual(dfa: Dfa, state: int) -> str:
    """What is pending in a state; empty where nothing is."""
    return "" if dfa.idle(state) else str(dfa.residuals[state])


def _instances(judged: Judged, prop: Property, dfa: Dfa) -> list[Json]:
    """The instances that were triggered, those that are violated first."""
    view, recording = judged.judge.view, judged.recording
    rows = prop.rows(view.binding)
    found = judged.verdicts[prop.id].findings
    if not judged.verdicts[prop.id].triggered and not found:
        return []
    calls = [prop.calls(row) for row in rows]
    values = np.stack([np.stack([view(*call) for call in own], axis=1) for own in calls], axis=1)
    monitor = prop.monitor(rows, dt=recording.trace.dt, profile=judged.profile)
    verdicts = monitor.run(values, ~recording.steps.tail)
    shown = [n for n, verdict in enumerate(verdicts) if verdict.violations or not verdict.vacuous]
    shown.sort(key=lambda n: not verdicts[n].violations)
    return [
        {
            "entities": list(rows[n]),
            "lanes": [
                {"atom": atom, "call": label_of(call), "runs": runs(values[:, n, bit])}
                for bit, (atom, call) in enumerate(zip(prop.atoms, calls[n], strict=True))
            ],
            "states": changes(verdicts[n].states),
            "pending": runs(_pending(dfa, verdicts[n])),
            "unsafe": runs(verdicts[n].unsafe),
            "findings": [
                _finding(f, place, recording)
                for place, f in enumerate(found)
                if f.entities == rows[n]
            ],
        }
        for n in shown
    ]


def _pending(dfa: Dfa, verdict: InstanceVerdict) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Steps after which an obligation is open (T,)."""
    idle = np.array([dfa.idle(state) for state in range(len(dfa))])
    return ~idle[verdict.states] & ~verdict.unsafe


def _finding(finding: Finding, place: int, recording: Recording) -> Json:
    """A violation; ``place`` is its number among those of its property, ``guilty`` what it is
    about, or was found to be done with.
    """
    return {
        "place": place,
        "severity": str(finding.severity),
        "excess": asdict(finding.excess) if finding.excess else None,
        "guilty": list(guilty_entities(finding, recording)),
        "first": finding.first,
        "last": finding.last,
        "duration_s": finding.duration_s,
        "entities": list(finding.entities),
        "reason": finding.reason,
        "evidence": list(finding.evidence),
        "proof": finding.proof[:MAX_PROOF],
    }


def _signals(judged: Judged) -> list[Signal]:
    """Those behind the violations, then those of the hands."""
    calls = [
        call
        for id_, verdict in judged.verdicts.items()
        for row in dict.fromkeys(finding.entities for finding in verdict.findings)
        for call in judged.properties[id_].calls(row)
    ]
    view = judged.judge.view
    return [*signals_of(view, calls)[:MAX_SIGNALS], *hand_signals(view)]


def _signal(signal: Signal) -> Json:
    about = {
        "name": signal.name,
        "unit": signal.unit,
        "of": list(signal.of),
        "limits": [{"value": limit.value, "name": limit.name} for limit in signal.limits],
    }
    return {**told(about), **packed(signal.values)}


def moments(judged: Judged) -> list[Json]:
    """The steps that one looks at first, in their order.

    Keys of each: ``step``, ``kind`` (``violation``, ``grasp``, ``release``, ``success``, ``tail``,
    ``hazard``) and ``text``.
    """
    recording, view = judged.recording, judged.judge.view
    found = [
        {"step": f.first, "kind": "violation", "text": _about(f"{id_} violated", f.entities)}
        for id_, verdict in judged.verdicts.items()
        for f in verdict.findings
    ]
    for name in view.binding.objects:
        held = runs(view("obj_grasped", name))
        found += [{"step": s, "kind": "grasp", "text": f"{name} grasped"} for s in held[::2]]
        ends = [last + 1 for last in held[1::2] if last + 1 < len(recording.steps)]
        found += [{"step": s, "kind": "release", "text": f"{name} no longer held"} for s in ends]
    if recording.steps.success.any():
        first = int(np.argmax(recording.steps.success))
        found.append({"step": first, "kind": "success", "text": "task done"})
    if recording.acting < len(recording.steps):
        found.append({"step": recording.acting, "kind": "tail", "text": "robot stops"})
    for hazard in recording.episode.hazards:
        text = _about(f"hazard begun on purpose: {hazard.property_id}", hazard.entities)
        found.append({"step": hazard.first, "kind": "hazard", "text": text})
    return sorted(found, key=lambda moment: (moment["step"], moment["kind"]))


def _about(what: str, entities: tuple[str, ...]) -> str:
    return f"{what}: {', '.join(entities)}" if entities else what
