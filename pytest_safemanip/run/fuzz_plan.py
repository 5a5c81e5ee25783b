"""Which laws are tried on which propositions."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.fuzz.laws import Law, laws_of
from pytest_safemanip.fuzz.trial import shortened
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Parameters, Proposition
from pytest_safemanip.run.cases import SUITE, select_properties
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.run.settings import Settings


@dataclass(frozen=True)
class LawCase:
    """A law to try on a proposition.

    Attributes:
        proposition: what is tried.
        law: what it has to obey.
    """

    proposition: Proposition
    law: Law

    @property
    def name(self) -> str:
        """Name of the test item."""
        return f"fuzz[{self.proposition.name}-{self.law.name}]"

    @property
    def node_id(self) -> str:
        """Node id of the test item."""
        return f"{SUITE}::{self.name}"


@dataclass(frozen=True)
class FuzzPlan:
    """The laws of the chosen propositions, ready to be tried.

    Attributes:
        cases: in the order in which they run.
        catalogue: all propositions.
        parameters: values of their parameters, with short windows.
        examples: recordings for each; None for what Hypothesis's profile says.
        out: folder for recordings that break a law.
    """

    cases: tuple[LawCase, ...]
    catalogue: Catalogue
    parameters: Parameters
    examples: int | None
    out: Path


def make_fuzz_plan(settings: Settings, added: Sequence[Proposition]) -> FuzzPlan:
    """Lay out the laws; node ids on the command line say which, else the chosen propositions.

    Args:
        settings: what was asked for.
        added: the user's propositions.

    Raises:
        ConfigError: if an id or a selector names none, or a proposition cannot be tried.
    """
    defined = load_definitions(settings.task_paths, settings.property_paths, added)
    catalogue = defined.catalogue
    every = {
        case.node_id: case
        for p in catalogue.values()
        for law in laws_of(p)
        for case in [LawCase(p, law)]
    }
    for text in settings.laws:
        if text not in every:
            raise ConfigError(f"unknown node id: {text}; {did_you_mean(text, every)}")
    if settings.laws:
        chosen = [case for node_id, case in every.items() if node_id in settings.laws]
    else:
        names = _select_propositions(settings, defined, {p.name for p in added})
        chosen = [case for case in every.values() if case.proposition.name in names]
    return FuzzPlan(
        cases=tuple(chosen),
        catalogue=catalogue,
        parameters=shortened(catalogue, settings.params),
        examples=settings.fuzz_examples,
        out=settings.out / "fuzz",
    )


def _select_propositions(settings: Settings, defined: Definitions, own: set[str]) -> set[str]:
    """Names of propositions by selector; without any, those that the chosen properties use."""
    catalogue = defined.catalogue
    if not settings.fuzz_propositions:
        if not settings.properties:
            return set(catalogue)
        properties = defined.properties
        wanted = select_properties(properties, settings.properties)
        return {call.name for name in wanted for call in properties[name].atoms.values()}
    chosen: set[str] = set()
    for selector in settings.fuzz_propositions:
        groups = {"all": set(catalogue), "mine": own}
        found = groups.get(selector) or set(fnmatch.filter(catalogue, selector))
        if not found:
            hint = did_you_mean(selector, {*catalogue, *groups}, "safemanip propositions")
            raise ConfigError(
                f"--safemanip-fuzz-propositions: {selector!r} matches no proposition; {hint}"
            )
        chosen |= found
    return chosen
