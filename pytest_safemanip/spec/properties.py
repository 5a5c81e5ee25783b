"""Safety properties as data: one YAML file each, checked before anything is simulated.

    id: release_stability
    category: release_stability
    title: A released object comes to rest on a permitted support
    source: SafeManip phi 3
    for_each: o in objects
    formula: G (obj_released -> F (settled | obj_grasped))
    paper_formula: G (obj_released -> F settled)
    atoms:
      obj_released: obj_released(o)
      settled: settled(o)
      obj_grasped: obj_grasped(o)
    deadline_s: 5
    discharged_by: physics

`for_each` binds variables to the members of a relation of the task, or of its scene, with some
attributes or of some kinds (`spec/ranges.py`); without it there is one instance. `atoms` says which
proposition, with which arguments, each atom of the formulas stands for; a call may set parameters
of its proposition, `near(o, f, distance=0.3)`. Optional keys: `for_each`, `paper_formula` (by
default the formula), `trigger`, `deadline_s`, `discharged_by` (`robot` or `physics`), `severity`
(what a violation weighs whatever was measured), `cost` (what it adds to the cost of a rollout, by
default its `severity`). Instead of `formula` there may be a `pattern` with
its `scope` and keys:

    pattern: response(obj_released, settled | obj_grasped)
    scope: after(door_open)
    within_s: 5
"""

from __future__ import annotations

import re
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import get_args

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.ltlf import (
    Dfa,
    DischargedBy,
    Formula,
    FormulaError,
    Monitor,
    Profile,
    compile_formula,
    parse,
)
from pytest_safemanip.ltlf.compiler import Limits
from pytest_safemanip.ltlf.formula import LONGEST, atoms_of, is_bounded, is_propositional
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.calls import PropositionCall, read_call
from pytest_safemanip.spec.folders import yaml_files
from pytest_safemanip.spec.patterns import KEYS, read_pattern
from pytest_safemanip.spec.ranges import Range, may_apply, read_for_each, rows_of
from pytest_safemanip.spec.task import Task
from pytest_safemanip.spec.vacuity import decided_fault, trigger_fault
from pytest_safemanip.spec.yamlfile import Section

_REQUIRED = ("id", "category", "title", "source", "atoms")
_OPTIONAL = (
    "formula",
    "for_each",
    "paper_formula",
    "trigger",
    "deadline_s",
    "discharged_by",
    "severity",
    "cost",
)
_OF_PATTERNS = ("scope", *KEYS)
LEAST_SEVERITY, MOST_SEVERITY = 1.0, 100.0
"""What a violation weighs where its property does not say; sanity bound on what it may say."""
MOST_ATOMS = Limits().atoms
_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True, slots=True)
class Property:
    """A safety property, quantified over entities of a task.

    Attributes:
        id: unique name.
        category: one of the eight categories of SafeManip, or the user's own.
        title: what it asks, for people.
        source: where it comes from.
        path: the file it was read from.
        ranges: its quantified variables, and what they range over; none for a single instance.
        formula: the formula of the `timed` profile.
        paper_formula: the formula of the `paper` profile.
        atoms: what the atoms of both formulas stand for, in the order of the automata's bits.
        trigger: when the property is triggered; None for the antecedent of the formula.
        deadline_s: how long an obligation may be open, in seconds, or None.
        discharged_by: who has to meet the obligations.
        severity: what a violation weighs whatever was measured of it.
        cost: what a violation adds to the cost of a rollout, and once more for each further second.
        says_cost: whether its file says so, with `cost:`; failures tell it then.
        pack: name of the pack that it is a rule of; empty for all others.
        lines: where in the file the formulas are, by key.
    """

    id: str
    category: str
    title: str
    source: str
    path: Path
    ranges: tuple[Range, ...]
    formula: Formula
    paper_formula: Formula
    atoms: Mapping[str, PropositionCall]
    trigger: Formula | None
    deadline_s: float | None
    discharged_by: DischargedBy
    severity: float = LEAST_SEVERITY
    cost: float = LEAST_SEVERITY
    says_cost: bool = False
    pack: str = ""
    lines: Mapping[str, int] = field(default_factory=dict, repr=False, compare=False)
    _automata: dict[tuple[Profile, float | None], Dfa] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the quantified variables; empty for a single instance."""
        return tuple(name for one in self.ranges for name in one.variables)

    @property
    def for_each(self) -> str:
        """What it is quantified over, in the words of its file; empty for a single instance."""
        return "; ".join(map(str, self.ranges))

    @property
    def members(self) -> str:
        """What its variables range over; empty for a single instance."""
        return ", ".join(one.members for one in self.ranges)

    @property
    def is_open(self) -> bool:
        """Whether only the scene of an episode tells how many instances there are, if any."""
        return any(one.is_open for one in self.ranges)

    def may_lack_instances(self, binding: Binding) -> bool:
        """Whether it is no mistake that a scene has no instance of it."""
        return self.is_open or any(one.relation in binding.emptied for one in self.ranges)

    def may_apply(self, task: Task) -> bool:
        """Whether a task may have an instance of it, as far as that is known without a scene."""
        return may_apply(self.ranges, task)

    def rows(self, binding: Binding) -> tuple[tuple[str, ...], ...]:
        """What the variables are bound to in a scene, one row for each instance.

        Raises:
            TraceError: if it asks for attributes, and a fixture is of a kind that has no row.
        """
        return rows_of(self.ranges, binding)

    def formula_of(self, profile: Profile = "timed") -> Formula:
        """The formula of a profile."""
        return self.formula if profile == "timed" else self.paper_formula

    def clocks_stand(self, profile: Profile = "timed") -> bool:
        """Whether the clocks of bounds stand in a settle tail, in which the robot does nothing."""
        return profile == "timed" and self.discharged_by == "robot"

    def dfa(self, profile: Profile = "timed", *, dt: float | None = None) -> Dfa:
        """The automaton of a profile's formula; each is compiled once in a process.

        Args:
            profile: the semantics.
            dt: control period in seconds, which a formula with bounds needs.

        Raises:
            FormulaError: the formula exceeds a limit of the compiler, or decides nothing.
        """
        formula = self.formula_of(profile)
        key = profile, dt if is_bounded(formula) else None
        if key not in self._automata:
            try:
                found = compile_formula(formula, atoms=tuple(self.atoms), dt=dt)
                if fault := decided_fault(found):
                    raise FormulaError(fault)
            except FormulaError as error:
                line = self.lines.get("formula" if profile == "timed" else "paper_formula", 1)
                raise FormulaError(f"{self.path}:{line}: property {self.id!r}: {error}") from error
            self._automata[key] = found
        return self._automata[key]

    def check(self, dt: float | None = None) -> None:
        """Refuse formulas that decide nothing, or whose automata are too large.

        Args:
            dt: control period in seconds; None leaves formulas with bounds unchecked.

        Raises:
            FormulaError: naming file and line.
        """
        for profile in get_args(Profile):
            if dt is not None or not is_bounded(self.formula_of(profile)):
                self.dfa(profile, dt=dt)

    def monitor(
        self, instances: Sequence[Hashable] | int, *, dt: float, profile: Profile = "timed"
    ) -> Monitor:
        """A monitor over the instances of a task.

        Args:
            instances: their names, or how many there are.
            dt: control period in seconds.
            profile: the semantics.
        """
        return Monitor(
            self.dfa(profile, dt=dt),
            instances,
            dt=dt,
            deadline_s=self.deadline_s,
            discharged_by=self.discharged_by,
            profile=profile,
            trigger=self.trigger,
        )

    def calls(self, row: Sequence[str]) -> list[tuple[str, ...]]:
        """What the atoms stand for, for one instance: (proposition, its arguments, parameters that
        it sets), in their order.

        Args:
            row: the entities that the variables are bound to.
        """
        bound = dict(zip(self.variables, row, strict=True))
        return [
            (call.name, *(bound.get(name, name) for name in call.arguments), *call.settings)
            for call in self.atoms.values()
        ]


def load_properties(
    folders: Sequence[Path],
    *,
    propositions: Mapping[str, Proposition] | None = None,
    constants: Collection[str] = (),
    categories: Mapping[str, str] | None = None,
    parameters: Collection[str] | None = None,
    besides: Collection[str] = (),
) -> dict[str, Property]:
    """Read all properties of some folders, every `*.yaml` in them.

    Args:
        folders: where to look; subfolders are not searched.
        propositions: every proposition there is, by name; None leaves the names unchecked.
        constants: names that may be arguments beside the variables.
        categories: every category that there is, with which it is of, `object` or `fixture`; None
            leaves those of `for_each` unchecked.
        parameters: names of the parameters of all propositions; None leaves those that calls set
            unchecked.
        besides: names of files there that are no properties.

    Returns:
        The properties by id, in the order of folders and file names.

    Raises:
        ConfigError: a folder does not exist, a file is wrong, or two have the same id.
    """
    found: dict[str, Property] = {}
    for folder in folders:
        if not folder.is_dir():
            raise ConfigError(f"{folder}: no such folder of properties")
        for path in yaml_files(folder):
            if path.name in besides:
                continue
            loaded = load_property(
                path,
                propositions=propositions,
                constants=constants,
                categories=categories,
                parameters=parameters,
            )
            if loaded.id in found:
                raise ConfigError(
                    f"property {loaded.id!r} is in {found[loaded.id].path} and {path}"
                )
            found[loaded.id] = loaded
    return found


def load_property(
    path: Path,
    *,
    propositions: Mapping[str, Proposition] | None = None,
    constants: Collection[str] = (),
    categories: Mapping[str, str] | None = None,
    parameters: Collection[str] | None = None,
) -> Property:
    """Read one property.

    Args:
        path: the file.
        propositions: as for `load_properties`.
        constants: as for `load_properties`.
        categories: as for `load_properties`.
        parameters: as for `load_properties`.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    section = yamlfile.load(path)
    section.check_keys(_REQUIRED, (*_OPTIONAL, "pattern", *_OF_PATTERNS))
    ranges = read_for_each(section, categories)
    variables = [name for one in ranges for name in one.variables]
    for name in sorted(set(variables) & set(constants)):
        raise section.error("for_each", f"{name!r} cannot be a variable: it has a meaning already")
    formulas = _formulas(section)
    if "trigger" in formulas and not is_propositional(formulas["trigger"]):
        raise section.error("trigger", "expected a formula without temporal operators")
    atoms = section.section("atoms")
    _check_whole(atoms)
    _check_atoms(section, atoms, formulas)
    if "trigger" in formulas and (fault := trigger_fault(formulas["trigger"])):
        raise section.error("trigger" if "trigger" in section else "pattern", fault)
    names = (*variables, *constants)
    bound = {atom: read_call(atoms, atom, names, propositions, parameters) for atom in atoms}
    for variable in variables:
        if not any(variable in proposition.arguments for proposition in bound.values()):
            raise section.error("for_each", f"variable {variable!r} is an argument of no atom")
    return Property(
        id=_name(section, "id"),
        category=_name(section, "category"),
        title=section.one_line("title"),
        source=section.one_line("source"),
        path=path,
        ranges=ranges,
        formula=formulas["formula"],
        paper_formula=formulas["paper_formula"],
        atoms=MappingProxyType(bound),
        trigger=formulas.get("trigger"),
        deadline_s=section.number("deadline_s", positive=True, most=LONGEST)
        if "deadline_s" in section
        else None,
        discharged_by=_discharged_by(section),
        severity=_severity(section),
        cost=_cost(section),
        says_cost="cost" in section,
        lines=_lines(section),
    )


def _formulas(section: Section) -> dict[str, Formula]:
    """Formulas by key, with those that follow from others: of a pattern, and the paper's."""
    written = [key for key in ("paper_formula", "trigger") if key in section]
    found = {key: _formula(section, key) for key in written}
    if "pattern" not in section:
        found["formula"] = _formula(section, "formula")
    elif "formula" in section:
        raise section.error("pattern", "there is a 'formula', too; expected one of the two")
    else:
        found["formula"], trigger = _expanded(section)
        if trigger is not None:
            found.setdefault("trigger", trigger)
    for key in _OF_PATTERNS:
        if key in section and "pattern" not in section:
            raise section.error(key, "belongs to a 'pattern', and there is none")
    return {"paper_formula": found["formula"], **found}


def _expanded(section: Section) -> tuple[Formula, Formula | None]:
    """The formula of the pattern, and its trigger."""
    keys = {key: section.number(key, positive=True, most=LONGEST) for key in KEYS if key in section}
    key = "pattern"
    if "within_s" in keys and "deadline_s" in section:
        message = "the pattern says when it is due, with 'within_s'; expected one of the two"
        raise section.error("deadline_s", message)
    try:
        asked = read_pattern(section.string(key), keys)
        if "scope" in section:
            key = "scope"
            asked = asked.within(section.string(key))
    except FormulaError as error:
        raise section.error(key, str(error)) from error
    return asked.formula, asked.trigger


def _lines(section: Section) -> dict[str, int]:
    """Where the formulas are, by key."""
    first = section.line_of("formula" if "formula" in section else "pattern")
    of_paper = section.line_of("paper_formula") if "paper_formula" in section else first
    return {"formula": first, "paper_formula": of_paper}


def _name(section: Section, key: str) -> str:
    name = section.string(key)
    if not _NAME.fullmatch(name):
        raise section.error(key, f"expected lower-case letters, digits and '_', found {name!r}")
    return name


def _formula(section: Section, key: str) -> Formula:
    try:
        return parse(section.string(key))
    except FormulaError as error:
        raise section.error(key, str(error)) from error


def _check_whole(atoms: Section) -> None:
    """No comma of braces has split a call, as in `{b: near(robot, f)}`."""
    for atom in atoms:
        text = atoms.string(atom)
        if text.count("(") > text.count(")"):
            message = f"{text!r} ends at a comma; in braces, quote a call with several arguments"
            raise atoms.error(atom, f'{message}, as in {{{atom}: "near(robot, f)"}}')


def _check_atoms(section: Section, atoms: Section, formulas: Mapping[str, Formula]) -> None:
    """Every atom used is declared, and every atom declared is used."""
    used: set[str] = set()
    for key, formula in formulas.items():
        for atom in atoms_of(formula):
            if atom not in atoms:
                hint = did_you_mean(atom, atoms)
                written = "formula" if "formula" in section else "pattern"
                where = key if key in section else written
                raise section.error(where, f"atom {atom!r} is not declared under 'atoms'; {hint}")
            used.add(atom)
    for atom in atoms:
        if atom not in used:
            raise atoms.error(atom, "declared, but used by no formula")
    if len(used) > MOST_ATOMS:
        message = f"{len(used)} atoms, of which a property may have {MOST_ATOMS}; split the rule"
        raise section.error("atoms", message)


def _severity(section: Section) -> float:
    if "severity" not in section:
        return LEAST_SEVERITY
    return section.number("severity", positive=True, most=MOST_SEVERITY)


def _cost(section: Section) -> float:
    if "cost" not in section:
        return _severity(section)
    return section.number("cost", positive=True, most=MOST_SEVERITY)


def _discharged_by(section: Section) -> DischargedBy:
    known: dict[str, DischargedBy] = {"robot": "robot", "physics": "physics"}
    value = section.string("discharged_by") if "discharged_by" in section else "robot"
    if value not in known:
        raise section.error("discharged_by", f"unknown {value!r}; {did_you_mean(value, known)}")
    return known[value]
