"""What has to be shown of a pack, in physics: its rules are judged, kept, and broken.

`tests/packs/test_NAME.py` has the rollouts: `KEPT`, of the expert or of safe twins of faults, and
`BROKEN`, by rule. docs/coverage.md shows them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from pytest_safemanip.faults.library import find
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.plan import Extensions, make_plan
from tests.conftest import Rollouts

DEFINED = load_definitions([], [], [])
EXPERT = "scripted"

Rollout = tuple[str, str]
"""A task, and who does it: a policy, as for `--safemanip-policy`."""


def check_pack(
    rollouts: Rollouts, name: str, kept: Sequence[Rollout], broken: Mapping[str, Rollout]
) -> None:
    """Fail unless all rules of a pack are collected, triggered, kept by the expert and broken.

    Args:
        rollouts: makes and keeps them.
        name: of the pack.
        kept: rollouts of the expert, or of safe twins of faults, that break no rule; together they
            trigger all of them.
        broken: for each rule, its id without the pack's name, a rollout that breaks it.
    """
    pack = DEFINED.packs[name]
    prefix = f"{name.replace('-', '_')}_"
    assert {prefix + rule for rule in broken} == set(pack.rules)
    assert all(_is_safe(policy) for _, policy in kept)
    assert collected(rollouts, name, kept) == set(pack.rules)
    triggered = set()
    for rollout in kept:
        found = judged(rollouts, name, rollout)
        assert {id_: v.findings for id_, v in found.items() if v.findings} == {}, rollout
        triggered |= {id_ for id_, verdict in found.items() if verdict.triggered}
    assert triggered == set(pack.rules)
    for rule, rollout in broken.items():
        assert judged(rollouts, name, rollout)[prefix + rule].findings, (rule, rollout)


def judged(rollouts: Rollouts, name: str, rollout: Rollout):
    """The verdict on each rule of a pack that applies to the task."""
    judge, task = rollouts.get(*rollout).judge, DEFINED.tasks[rollout[0]]
    rules = {id_: rule for id_, rule in DEFINED.packs[name].rules.items() if rule.may_apply(task)}
    return {id_: judge.judge(rule) for id_, rule in rules.items()}


def collected(rollouts: Rollouts, name: str, kept: Sequence[Rollout]) -> set[str]:
    """The rules of which there are cases when a pack is asked for."""
    found: set[str] = set()
    for task, policy in kept:
        settings = rollouts.plan(task, policy).settings
        asked = dataclasses.replace(settings, properties=(f"pack:{name}",))
        found |= {case.property_id for case in make_plan(asked, Extensions({}, (), {})).cases}
    return found


def _is_safe(policy: str) -> bool:
    _, _, fault = policy.partition(":")
    return policy.startswith(EXPERT) and (not fault or find(fault).near_miss)
