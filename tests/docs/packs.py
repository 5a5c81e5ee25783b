"""The pages of docs/packs/, one for each pack, printed from its YAML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module

from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.spec.packs import Pack
from pytest_safemanip.spec.properties import Property

WRITTEN = "Written from the pack's YAML by `pytest tests/docs --update-docs`."


def packs() -> Mapping[str, Callable[[], str]]:
    """What prints the page of each pack, by the page's path."""

    def printer(pack: Pack) -> Callable[[], str]:
        return lambda: _page(pack)

    return {
        f"docs/packs/{pack.name}.md": printer(pack)
        for pack in load_definitions([], [], []).packs.values()
    }


def listed() -> str:
    """The packs with their titles, each with a link to its page."""
    found = load_definitions([], [], []).packs.values()
    rows = [
        f"| [{pack.name}](packs/{pack.name}.md) | {len(pack.rules)} | {pack.title} |"
        for pack in found
    ]
    return "\n".join(("| pack | rules | what it asks |", "| --- | --- | --- |", *rows))


def broken() -> str:
    """Of each rule of each pack, the rollout of `tests/packs` that breaks it."""
    rows = []
    for name in load_definitions([], [], []).packs:
        evidence = import_module(f"tests.packs.test_{name.replace('-', '_')}")
        rows += [
            f"| {name} | `{rule}` | `{policy}` in {task} |"
            for rule, (task, policy) in sorted(evidence.BROKEN.items())
        ]
    return "\n".join(("| pack | rule | broken by |", "| --- | --- | --- |", *rows))


def _page(pack: Pack) -> str:
    rules = "\n".join(map(_rule, pack.rules.values()))
    left_out = "\n".join(f"- {what}: {why}" for what, why in pack.not_expressed.items())
    return (
        f"# {pack.name}\n\n{pack.title}: `--safemanip-properties=pack:{pack.name}`. {WRITTEN}\n\n"
        f"Follows {pack.source}.\n\n{pack.about}\n\n## Rules\n\n{rules}\n"
        f"## What could not be expressed\n\n{left_out}\n"
    )


def _rule(rule: Property) -> str:
    facts = [f"Category {rule.category}; {rule.source}."]
    if rule.ranges:
        facts.append(f"For each `{rule.for_each}`.")
    if rule.deadline_s is not None:
        facts.append(f"Deadline: {rule.deadline_s:g} s, discharged by {rule.discharged_by}.")
    if rule.severity > 1:
        facts.append(f"Severity: {rule.severity:g} at least.")
    if rule.cost != rule.severity:
        facts.append(f"Cost: {rule.cost:g}.")
    atoms = "\n".join(f"{atom:<16} {call}" for atom, call in rule.atoms.items())
    return (
        f"### `{rule.id}`\n\n{rule.title}. {' '.join(facts)}\n\n"
        f"```text\n{rule.formula}\n\n{atoms}\n```\n"
    )
