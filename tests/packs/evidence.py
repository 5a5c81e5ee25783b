"""What has to be shown of a pack, in physics: its rules are judged, kept, and broken."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.plan import Extensions, make_plan
from tests.conftest import Rollouts

PACKS = load_definitions([], [], []).packs
EXPERT = "scripted"

Rollout = tuple[str, str]
"""A task, and who does it: a policy, as for `--safemanip-policy`."""


def check_pack(
    rollouts: Rollouts, name: str, kept: Sequence[str], broken: Mapping[str, Rollout]
) -> None:
    """Fail unless all rules of a pack are collected, triggered, kept by the expert and broken.

    Args:
        rollouts: makes and keeps them.
        name: of the pack.
        kept: tasks that the expert does without breaking any rule, and that trigger all of them.
        broken: for each rule, its id without the pack's name, a rollout that breaks it.
    """
    pack = PACKS[name]
    prefix = f"{name.replace('-', '_')}_"
    assert {prefix + rule for rule in broken} == set(pack.rules)
    assert collected(rollouts, name, kept) == set(pack.rules)
    triggered = set()
    for task in kept:
        found = judged(rollouts, name, (task, EXPERT))
        assert {rule for rule, verdict in found.items() if verdict.findings} == set(), task
        triggered |= {rule for rule, verdict in found.items() if verdict.triggered}
    assert triggered == set(pack.rules)
    for rule, rollout in broken.items():
        assert judged(rollouts, name, rollout)[prefix + rule].findings, (rule, rollout)


def judged(rollouts: Rollouts, name: str, rollout: Rollout):
    """The verdict on each rule of a pack."""
    judge = rollouts.get(*rollout).judge
    return {id_: judge.judge(rule) for id_, rule in PACKS[name].rules.items()}


def collected(rollouts: Rollouts, name: str, tasks: Sequence[str]) -> set[str]:
    """The rules of which there are cases when a pack is asked for."""
    settings = dataclasses.replace(
        rollouts.plan(tasks[0]).settings, tasks=tuple(tasks), properties=(f"pack:{name}",)
    )
    return {case.property_id for case in make_plan(settings, Extensions({}, (), {})).cases}
