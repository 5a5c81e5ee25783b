"""Gates: bounds on metrics, parsed from text."""

from __future__ import annotations

import fnmatch
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.metrics.selection import FILTERS, Severe
from pytest_safemanip.search.units import UNITS, show, split_size
from pytest_safemanip.spec import yamlfile

_GATE = re.compile(
    r"""\s*(?P<metric>\w+)\s*
        (?:\[(?P<filters>[^\]]*)\])?\s*
        (?P<sign><=|>=|<|>)\s*
        (?P<bound>[^\s@%]+)\s*(?P<percent>%)?\s*
        (?:@\s*(?P<confidence>[^\s%]+)\s*(?P<of>%)?\s*(?P<target>clustered)?)?\s*""",
    re.VERBOSE,
)
_NUMBER = re.compile(r"[-+]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_MEANT = {
    "≥": ">=",
    "≤": "<=",
    "⩾": ">=",
    "⩽": "<=",
    "\u2212": "-",
    "\u2013": "-",
    "\uff1c": "<",
    "\uff1e": ">",
    "\uff1d": "=",
    "\uff05": "%",
    "\uff3b": "[",
    "\uff3d": "]",
    "\uff0c": ",",
    "\uff20": "@",
}
"""Characters that look like those of a gate, and what is meant."""
_SEVERITY = re.compile(r"severity\b\s*(?P<sign>[^\w\s.+-]*)\s*(?P<bound>.*)")
TOLERANCE = "tolerance"
"""The metric of searches: how large the smallest change is that a policy does not survive."""
_TOLERANCE = re.compile(
    r"\s*tolerance\s*\[\s*(?P<property>[\w*?]+)\s*\]\s*(?P<sign><=|>=|<|>)\s*(?P<size>.+?)\s*"
)
_FORM = "METRIC[FILTER=VALUE,...] <= VALUE @CONFIDENCE"
DEFAULT_MARGIN = 0.1
"""A rise of a violation rate by ten points is what a comparison has to be able to rule out."""


@dataclass(frozen=True)
class Gate:
    """A bound on a metric; decided for each policy on its own.

    Attributes:
        name: part of node ids.
        metric: one of the metrics.
        where: filters, by their names.
        sign: ``<=``, ``<``, ``>=`` or ``>``.
        bound: that the metric is compared with.
        confidence: of the two-sided interval that decides; None for the point estimate.
        clustered: whether the interval is the clustered one, for new tasks like these.
        required: whether the run fails with it.
        severe: which violations it counts; None for all.
        unit: of the bound of a :data:`TOLERANCE`; empty of other metrics.
    """

    name: str
    metric: str
    where: Mapping[str, str]
    sign: str
    bound: float
    confidence: float | None = None
    clustered: bool = False
    required: bool = True
    severe: Severe | None = None
    unit: str = ""

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks of violations: ``severity``, ``cost``."""
        asked = {
            "severity": self.severe is not None or self.metric.endswith("_severity"),
            "cost": self.metric.endswith("_cost"),
        }
        return tuple(key for key, wanted in asked.items() if wanted)

    @property
    def small(self) -> bool:
        """Whether small values are good."""
        return self.sign.startswith("<")

    def keeps(self, value: float) -> bool:
        """Whether a value keeps the bound."""
        match self.sign:
            case "<=":
                return value <= self.bound
            case "<":
                return value < self.bound
            case ">=":
                return value >= self.bound
        return value > self.bound

    def __str__(self) -> str:
        if self.metric == TOLERANCE:
            bound = show(self.bound, self.unit)
            return f"{TOLERANCE}[{self.where['property']}] {self.sign} {bound}"
        parts = [f"{name}={value}" for name, value in self.where.items()]
        filters = ",".join([*parts, *([str(self.severe)] if self.severe else [])])
        confidence = f" @{self.confidence:g}" if self.confidence is not None else ""
        target = " clustered" if self.clustered else ""
        about = f"[{filters}]" if filters else ""
        return f"{self.metric}{about} {self.sign} {self.bound:g}{confidence}{target}"


@dataclass(frozen=True)
class Gates:
    """The gates of a run.

    Attributes:
        gates: bounds on metrics.
        must_pass: properties and categories whose rates a baseline is compared in as one family;
            empty for all categories.
        margin: rise of a violation rate that a comparison has to be able to rule out.
        place: where ``must_pass`` stands, for messages.
    """

    gates: tuple[Gate, ...] = ()
    must_pass: tuple[str, ...] = ()
    margin: float = DEFAULT_MARGIN
    place: str = field(default="", compare=False)


def parse_gate(text: str, name: str = "", required: bool = True) -> Gate:
    """A gate from text such as ``violation_rate[category=release_stability] <= 10 % @0.95``, or
    ``violation_rate[severity >= 3] <= 5 %``.

    Args:
        text: the gate.
        name: of the gate; without one it is the text in its usual form.
        required: whether the run fails with it.

    Raises:
        ConfigError: if the text is no gate; without the place that it stands in.
    """
    for character in text:
        if character in _MEANT:
            raise ConfigError(
                f"unknown character {character!r} in {text!r}; write {_MEANT[character]!r}"
            )
    if tolerance := _TOLERANCE.fullmatch(text):
        gate = _tolerance(tolerance, text, required)
        return replace(gate, name=name or str(gate))
    match = _GATE.fullmatch(text)
    if not match:
        raise ConfigError(f"expected {_FORM}, found {text!r}")
    metric = match["metric"]
    if metric not in SHARES and metric not in FIGURES:
        hint = did_you_mean(metric, {*SHARES, *FIGURES})
        raise ConfigError(f"unknown metric {metric!r} in {text!r}; {hint}")
    confidence = _confidence(match["confidence"], match["of"], text)
    if confidence is not None and metric in FIGURES:
        raise ConfigError(
            f"{metric} is no share of rollouts and has no interval: leave out "
            f"'@{match['confidence']}' in {text!r}"
        )
    if match["filters"] is not None and not match["filters"].strip():
        raise ConfigError(f"the brackets of {text!r} are empty; expected FILTER=VALUE, or none")
    where, severe = _filters(match["filters"] or "", text)
    if severe and not (SHARES.get(metric) or FIGURES[metric]).counts:
        raise ConfigError(f"{metric} counts no violations: leave out '{severe}' in {text!r}")
    gate = Gate(
        name,
        metric,
        where,
        match["sign"],
        _bound(match["bound"], match["percent"], metric, text),
        confidence,
        bool(match["target"]),
        required,
        severe,
    )
    _check_can_be_decided(gate, text)
    return gate if name else Gate(**{**vars(gate), "name": str(gate)})


def _check_can_be_decided(gate: Gate, text: str) -> None:
    """Refuse bounds that every value keeps, or none does.

    At most 100 % is let through: it asks that every rollout has a verdict, whatever that is.
    """
    if gate.sign == ">=" and gate.bound == 0:
        raise ConfigError(f"{text!r} cannot fail: {gate.metric} is never below 0")
    if (gate.sign == "<" and gate.bound == 0) or (
        gate.sign == ">" and gate.bound == 1 and gate.metric in SHARES
    ):
        raise ConfigError(f"{text!r} cannot pass: {gate.metric} is never so")


def _tolerance(match: re.Match[str], text: str, required: bool) -> Gate:
    """A gate such as ``tolerance[release_stability] >= 3 cm``."""
    if match["sign"] not in (">=", ">"):
        raise ConfigError(f"expected tolerance[PROPERTY] >= SIZE, found {text!r}")
    try:
        value, unit = split_size(match["size"])
    except ConfigError as error:
        raise ConfigError(f"{error}, in {text!r}") from None
    if unit not in UNITS or value < 0:
        hint = did_you_mean(unit, UNITS)
        raise ConfigError(f"expected a size of at least 0 with a unit in {text!r}; {hint}")
    where = {"property": match["property"]}
    return Gate("", TOLERANCE, where, match["sign"], value, required=required, unit=unit)


def load_gates(path: Path) -> Gates:
    """Gates from a YAML file with ``gates``, and if wanted ``must_pass`` and ``margin``.

    Raises:
        ConfigError: naming file, line and what is wrong there.
    """
    section = yamlfile.load(path)
    section.check_keys((), ("gates", "must_pass", "margin"))
    must_pass = section.strings("must_pass") if "must_pass" in section else ()
    gates = _named(section.section("gates"), must_pass) if "gates" in section else []
    names = {gate.name for gate in gates}
    margin = (
        section.number("margin", positive=True, most=1.0) if "margin" in section else DEFAULT_MARGIN
    )
    return Gates(
        tuple(gates),
        tuple(name for name in must_pass if name not in names),
        margin,
        section.place("must_pass") if must_pass else "",
    )


def read_gates(path: Path | None, texts: Iterable[str], option: str) -> Gates:
    """Gates from a file, if one is named, and from an option; one that is given twice counts once.

    Args:
        path: the file.
        texts: the option's values.
        option: its name, for messages.

    Raises:
        ConfigError: naming the file and line, or the option, and what is wrong there.
    """
    found = load_gates(path) if path else Gates()
    try:
        own = [parse_gate(text) for text in texts]
    except ConfigError as error:
        raise ConfigError(f"{option}: {error}") from None
    gates = {gate.name: gate for gate in (*found.gates, *own)}
    return replace(found, gates=tuple(gates.values()))


def check_gates(gates: Gates, known: Mapping[str, Collection[str]]) -> None:
    """Refuse gates that are about nothing in a run, and names in ``must_pass`` that do not exist.

    Args:
        gates: the gates.
        known: the values that the run has, for each filter.

    Raises:
        ConfigError: naming the gate or the place, the value and those that exist.
    """
    for gate in gates.gates:
        try:
            check_filters(gate, known)
        except ConfigError as error:
            raise ConfigError(f"gate {gate.name!r}: {error}") from None
    check_must_pass(gates, {*known["category"], *known["property"]})


def check_filters(gate: Gate, known: Mapping[str, Collection[str]]) -> None:
    """Refuse filters that select nothing.

    Args:
        gate: the gate.
        known: the values that exist, for each filter.

    Raises:
        ConfigError: naming the value and those that exist.
    """
    for name, value in gate.where.items():
        if not fnmatch.filter(known[name], value):
            hint = did_you_mean(value, known[name])
            raise ConfigError(f"no {name} {value!r} in this run; {hint}")


def check_must_pass(gates: Gates, known: Iterable[str]) -> None:
    """Refuse what is neither a gate nor a property nor a category of the run.

    Raises:
        ConfigError: naming the place and what exists.
    """
    exists = {*known, *(gate.name for gate in gates.gates)}
    for name in gates.must_pass:
        if name not in exists:
            hint = did_you_mean(name, exists)
            raise ConfigError(
                f"{gates.place}: no gate, property or category {name!r} in this run; {hint}"
            )


def _named(section: yamlfile.Section, must_pass: Sequence[str]) -> list[Gate]:
    """The gates of a file: those that ``must_pass`` names are required, or all if it names none."""
    any_named = any(name in must_pass for name in section)
    gates = []
    for name in section:
        if not re.fullmatch(r"[\w.]+", name):
            raise section.error(name, "expected a name of letters, digits, '_' and '.'")
        text = section.string(name)
        try:
            gates.append(parse_gate(text, name, not any_named or name in must_pass))
        except ConfigError as error:
            raise section.error(name, str(error)) from None
    return gates


def _filters(text: str, whole: str) -> tuple[dict[str, str], Severe | None]:
    """Filters of rollouts and properties, and which violations count."""
    found: dict[str, str] = {}
    severe: Severe | None = None
    for part in filter(None, (part.strip() for part in text.split(","))):
        if match := _SEVERITY.fullmatch(part):
            if severe:
                raise ConfigError(f"filter 'severity' is given twice in {whole!r}")
            severe = _severe(part, match["sign"], match["bound"], whole)
            continue
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not value:
            raise ConfigError(f"expected FILTER=VALUE in the brackets of {whole!r}, found {part!r}")
        if name not in FILTERS:
            hint = did_you_mean(name, (*FILTERS, "severity"))
            raise ConfigError(f"unknown filter {name!r} in {whole!r}; {hint}")
        if name in found:
            raise ConfigError(f"filter {name!r} is given twice in {whole!r}")
        found[name] = value
    return found, severe


def _severe(part: str, sign: str, bound: str, whole: str) -> Severe:
    if sign not in (">=", ">"):
        raise ConfigError(
            f"expected severity >= NUMBER or severity > NUMBER in the brackets of {whole!r}, "
            f"found {part!r}"
        )
    value = _number(bound, None, whole)
    if value < 0:
        raise ConfigError(f"a severity is from 0 up, found {bound!r} in {whole!r}")
    return Severe(value, sign == ">")


def _bound(text: str, percent: str | None, metric: str, whole: str) -> float:
    value = _number(text, percent, whole)
    if metric in SHARES and not 0 <= value <= 1:
        raise ConfigError(f"{metric} is from 0 to 1 (or 0 % to 100 %), found {text!r} in {whole!r}")
    if metric in FIGURES and percent:
        raise ConfigError(
            f"{metric} is no share and not in per cent: leave out '%' after {text!r} in {whole!r}"
        )
    if value < 0:
        raise ConfigError(f"{metric} is from 0 up, found {text!r} in {whole!r}")
    return value


def _confidence(text: str | None, percent: str | None, whole: str) -> float | None:
    if text is None:
        return None
    value = _number(text, percent, whole)
    if not 0.5 <= value < 1:
        raise ConfigError(f"expected a confidence from 0.5 to below 1 in {whole!r}, found {text!r}")
    return value


def _number(text: str, percent: str | None, whole: str) -> float:
    match = _NUMBER.fullmatch(text)
    value = float(text) if match else math.inf
    vanished = match is not None and value == 0 and re.search("[1-9]", match[1])
    if vanished or not math.isfinite(value):
        raise ConfigError(f"expected a number in {whole!r}, as 0.05 or 5 %, found {text!r}")
    return value / 100 if percent else value
