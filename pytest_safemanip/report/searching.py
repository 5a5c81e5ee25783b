"""What searches found, in sentences and in plain values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from textwrap import wrap
from typing import Any

from pytest_safemanip.report.numbers import MIN_WIDTH, counted
from pytest_safemanip.run.searching.plan import SearchCase
from pytest_safemanip.run.searching.running import FOLDER, RECORDINGS, Searched
from pytest_safemanip.search.coverage import looked_at, tolerances
from pytest_safemanip.search.dimension import Deviation, Dimensions
from pytest_safemanip.search.kinds.definition import Named
from pytest_safemanip.search.regression import Regression, as_dimensions, changes_of
from pytest_safemanip.search.search import Failure
from pytest_safemanip.search.units import show
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.scene import Scene

REASONS = 3
"""Why rollouts could not be begun is told for so many reasons, the most frequent first."""
SearchData = dict[str, Any]
"""What a search found out about one property, in plain builtins; see :func:`search_data`."""


def names_in(scene: Scene) -> Named:
    """What people call what plays a role in a scene: what it is, if there is one of its kind."""
    categories = {entity.name: entity.category for entity in scene.entities}
    things = Counter(entity.category for entity in scene.entities if entity.kind == "object")

    def named(role: str) -> str:
        category = categories.get(scene.roles.get(role, ""), "")
        if role == ROBOT or not category:
            return role
        return f"the {category}" if things[category] == 1 else f"{role} (a {category})"

    return named


def sentence(property_id: str, told: str, seed: int, failed: int, runs: int, exact: bool) -> str:
    """``fails release_stability when the mug stands 4 cm nearer the robot (9 of 10)``."""
    when = f" when {told}" if told else f" as it is, without any change, with seed {seed}"
    often = "every time" if exact else f"{failed} of {runs}"
    return f"fails {property_id}{when} ({often})"


def told_again(kept: Regression, scene: Scene) -> str:
    """``fails release_stability when the mug stands 4 cm nearer the robot``."""
    dimensions, deviation = as_dimensions(kept.changes)
    return f"fails {kept.property_id} when {said(deviation, dimensions, scene)}"


def said(deviation: Deviation, dimensions: Dimensions, scene: Scene) -> str:
    """A deviation in words, after "when"."""
    return dimensions.say(deviation, names_in(scene))


def search_data(
    case: SearchCase, found: Searched, scene: Scene | None, kept: Path | None
) -> SearchData:
    """What a search found out about one property.

    Args:
        case: which.
        found: the search of its task and policy.
        scene: of the recording of its failure; None if it found none.
        kept: the file that the failure is kept in; None if none is.

    Returns:
        ``task``, ``policy``, ``property``; ``seeds`` and of them ``violated_plain`` (those whose
        episodes violate it as they are); ``rollouts`` (asked for until something was found) and
        ``shrinking`` (afterwards), ``trials`` of the whole search, of them ``satisfied`` (those
        with changes that triggered the property and kept it) and ``refused``, some reasons for
        which (``not_begun``, with how often each), ``errors``;
        ``failure`` (None, or what it is); ``margins`` of all trials in their order (None where
        there is none); ``tolerances`` and ``looked_at``, see `search/coverage.py`; ``left_out`` of
        the space.
    """
    pursuit, tried = found.search.pursuits[case.property_id], list(found.search.tried.items())
    failure = pursuit.failure
    findings = [outcome.findings.get(case.property_id) for _, outcome in tried]
    reasons = Counter(outcome.refused for _, outcome in tried if outcome.refused)
    return {
        "task": case.task,
        "policy": case.policy,
        "property": case.property_id,
        "over": pursuit.over,
        "seeds": len(found.search.seeds),
        "violated_plain": len(pursuit.violated_plain),
        "rollouts": pursuit.asked,
        "shrinking": pursuit.shrinking,
        "trials": len(tried),
        "reused": found.reused,
        "satisfied": found.search.satisfied(case.property_id),
        "refused": sum(bool(outcome.refused) for _, outcome in tried),
        "not_begun": dict(reasons.most_common(REASONS)),
        "errors": found.errors[:5],
        "failure": (
            _failure(case, found, failure, scene, kept) if failure is not None and scene else None
        ),
        "margins": [None if own is None else _told(own.margin) for own in findings],
        "tolerances": [
            {**asdict(own), "quantity": own.quantity}
            for own in tolerances(found.dimensions, pursuit, tried)
        ],
        "looked_at": [asdict(own) for own in looked_at(found.dimensions, tried)],
        "left_out": list(found.left_out),
    }


def _failure(
    case: SearchCase, found: Searched, failure: Failure, scene: Scene, kept: Path | None
) -> dict[str, Any]:
    finding = failure.outcome.findings[case.property_id]
    told = said(failure.deviation, found.dimensions, scene)
    often = failure.seed, failure.failed, failure.runs, failure.exact
    return {
        "sentence": sentence(case.property_id, told, *often),
        "seed": failure.seed,
        "found_at": failure.found_at,
        "failed": failure.failed,
        "runs": failure.runs,
        "exact": failure.exact,
        "changes": [own.to_plain() for own in changes_of(failure.deviation, found.dimensions)],
        "first_changes": len(failure.first),
        "price": round(found.dimensions.price(failure.deviation), 3),
        "first_price": round(found.dimensions.price(failure.first), 3),
        "margin": _told(finding.margin),
        "severity": round(finding.severity, 3),
        "recording": f"{FOLDER}/{RECORDINGS}/{failure.outcome.recording}",
        "kept": str(kept) if kept else "",
    }


def undecided(own: Mapping[str, Any]) -> str:
    """What is said of a property that no rollout with a change says anything about."""
    return f"undecided: triggered with a change in none of {counted(own['trials'], 'rollout')}"


def search_lines(searches: Sequence[Mapping[str, Any]], width: int = MIN_WIDTH) -> list[str]:
    """The terminal's block: a paragraph for each policy and task.

    Args:
        searches: what was found, see :func:`search_data`.
        width: columns of the terminal.
    """
    lines: list[str] = []
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for own in searches:
        groups.setdefault((own["policy"], own["task"]), []).append(own)
    for (policy, task), group in groups.items():
        most = max(group, key=lambda own: own["trials"])
        lines += [f"{policy} in {task}: {_effort(most)}"]
        for own in group:
            lines += [f"  {own['property']}"]
            lines += [line for told in _found(own) for line in _indented(told, 4, width)]
        beside = [f"not looked at: {line}" for line in most["left_out"]]
        begun = most.get("not_begun", {})
        beside += [f"could not be begun ({count}): {why}" for why, count in begun.items()]
        beside += [f"a rollout failed: {error}" for error in most["errors"]]
        lines += [line for told in beside for line in _indented(told, 2, width)]
    return lines


def _indented(text: str, columns: int, width: int) -> list[str]:
    indent, more = " " * columns, " " * (columns + 2)
    return wrap(text, width, initial_indent=indent, subsequent_indent=more)


def _effort(own: Mapping[str, Any]) -> str:
    words = [counted(own["trials"], "rollout"), counted(len(own["looked_at"]), "dimension")]
    if own["refused"]:
        words.append(f"{own['refused']} could not be begun")
    if own["reused"]:
        words.append(f"{own['reused']} of earlier runs")
    return ", ".join(words)


def _found(own: Mapping[str, Any]) -> list[str]:
    """What is said about one property; the first line is the news."""
    failure = own["failure"]
    plain = []
    if own["violated_plain"] and own["seeds"] > 1:
        plain = [f"as it is, fails with {own['violated_plain']} of {own['seeds']} seeds"]
    if failure is None:
        if not own["over"]:
            return [f"nothing found in {counted(own['trials'], 'rollout')} so far", *plain]
        if not own["satisfied"]:
            return [undecided(own)]
        return [f"{_survived(own)}; least margin {_least(own['margins'])}"]
    head = failure["sentence"].replace(f"fails {own['property']}", "fails", 1)
    measured = f"margin {failure['margin']:g}, severity {failure['severity']:g}"
    if not failure["changes"]:
        others = [f"with the others {_survived(own)}"] if own["satisfied"] else []
        return [head, *plain, *others, measured]
    reduced = (
        f"found after {failure['found_at']}, reduced from "
        f"{counted(failure['first_changes'], 'change')} in {own['shrinking']}; {measured}"
    )
    often = "" if failure["exact"] else f" ({failure['failed']} of {failure['runs']})"
    borders = [_border(t) + often for t in own["tolerances"] if t["failed"]]
    kept = [f"kept in {failure['kept']}"] if failure["kept"] else []
    return [head, *plain, reduced, *borders, *kept]


def _survived(own: Mapping[str, Any]) -> str:
    return f"survived {counted(own['satisfied'], 'rollout')} with changes that triggered it"


def _border(own: Mapping[str, Any]) -> str:
    survived, failed = (show(own[key], own["unit"]) for key in ("survived", "failed"))
    return f"{own['dimension']}: survives {survived}, fails at {failed}"


def _told(margin: float) -> float:
    """A margin as it is told: what is hardly below 0 is 0, and not -0."""
    return round(margin, 4) + 0.0


def _least(margins: Iterable[float | None]) -> str:
    known = [margin for margin in margins if margin is not None]
    return f"{min(known):g}" if known else "unknown"
