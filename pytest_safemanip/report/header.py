"""The lines that a run begins with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pytest_safemanip.ltlf.formula import is_bounded
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, STAND_INS
from pytest_safemanip.report.numbers import MIN_WIDTH, counted, fitted
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.sim.backend import Provenance
from pytest_safemanip.spec.properties import Property

MOST_NAMED = 5
"""Properties that a line names."""


def header_lines(plan: Plan, source: Provenance | None) -> list[str]:
    """What is about to be done.

    Args:
        plan: the run.
        source: of the backend; None when recordings are judged or cases only listed.
    """
    rollouts = {case.rollout for case in plan.cases}
    tasks = {case.task for case in plan.cases}
    policies = dict.fromkeys(case.policy for case in plan.cases)
    first = (
        f"safemanip: {counted(len(plan.cases), 'case')} on "
        f"{counted(len(rollouts), 'recording' if plan.recordings else 'rollout')} of "
        f"{counted(len(tasks), 'task')}, "
        f"policy {', '.join(policies) or 'none'}, {plan.settings.semantics}"
    )
    if plan.settings.shard is not None:
        first += f", shard {plan.settings.shard}"
    head = fitted(first, MIN_WIDTH, 2)
    if plan.unjudged:
        left = f"safemanip: no selected property applies to {', '.join(plan.unjudged)}"
        head += fitted(f"{left}: not run", MIN_WIDTH, 2)
    if source is None:
        return head
    settings = plan.settings
    elsewhere = [
        *([f"safemanip: rollouts on a Ray cluster ({settings.ray})"] if settings.ray else []),
        *([f"safemanip: recordings are shared in {settings.store}"] if settings.store else []),
    ]
    scenes = _each({name: plan.scenes(name) for name in policies})
    stepping = _each({name: plan.stepping(name) for name in policies})
    details = source.description or f"{source.assets} assets"
    where = f"{source.backend}, {scenes} scenes, {stepping} stepping"
    whole = f"safemanip: {where}, {details}"
    lines = [
        *head,
        *([whole] if len(whole) <= MIN_WIDTH else [f"safemanip: {where}", f"safemanip: {details}"]),
        *elsewhere,
    ]
    if source.assets in STAND_INS:
        trained = [name for name in policies if plan.policies[name].official]
        lines += [f"safemanip: {name}: {NOT_COMPARABLE}" for name in trained]
    lines += _unwarned(plan) if settings.stop == "warning" else []
    return lines + [line for name in policies for line in _claim(name, plan.policies[name].claim)]


def _unwarned(plan: Plan) -> list[str]:
    """The properties of whose violation nothing warns, since what they ask about has neither a
    margin nor a forecast, and no time that runs out.
    """
    judged = dict.fromkeys(case.property_id for case in plan.cases)
    found = [name for name in judged if not _is_foreseen(plan.properties[name], plan)]
    if not found:
        return []
    names = ", ".join(found[:MOST_NAMED])
    more = f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    text = f"safemanip: no warning stops a rollout before a violation of {names}{more}"
    return fitted(f"{text}: their propositions have neither margin nor forecast", MIN_WIDTH, 2)


def _is_foreseen(prop: Property, plan: Plan) -> bool:
    formula = prop.formula_of(plan.settings.semantics)
    used = [plan.catalogue[call.name] for call in prop.atoms.values()]
    timed = prop.deadline_s is not None or is_bounded(formula)
    return timed or any(one.margin or one.forecast for one in used)


def not_grounded_lines(plan: Plan) -> list[str]:
    """What one would expect to be judged in the tasks of a run, and cannot be."""
    tasks = dict.fromkeys(case.task for case in plan.cases)
    return [
        f"safemanip: {name}: {prop} is not judged: {reason}"
        for name in tasks
        for prop, reason in plan.tasks[name].not_grounded.items()
    ]


def _each(used: Mapping[str, str]) -> str:
    """What is used, with the policies that use it if they differ."""
    if len(set(used.values())) == 1:
        return next(iter(used.values()))
    return " and ".join(f"{value} ({name})" for name, value in used.items())


def _claim(policy: str, claim: Mapping[str, Any]) -> list[str]:
    """Where a policy is served, and as what: nobody can check which checkpoint it is."""
    if not claim:
        return []
    checkpoints = claim["claimed_checkpoints"]
    places = [
        f"{address}, {f'claimed to be {checkpoints[name]}' if checkpoints[name] else 'not claimed'}"
        for name, address in claim["servers"].items()
    ]
    steps = claim["open_loop_steps"]
    lines = [f"safemanip: {policy} at {'; '.join(places)}; open-loop steps: {steps}"]
    if not all(checkpoints.values()):
        lines.append(
            f"safemanip: rollouts of {policy} are run again in every run unless its server says "
            f"which checkpoint it has, or you do: --safemanip-policy={policy}@CHECKPOINT=ADDRESS"
        )
    return lines
