"""Reading `summary.json` files, which may come from anywhere."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pytest_safemanip.decoding.files import Unreadable, read_regular
from pytest_safemanip.errors import ConfigError, printable
from pytest_safemanip.metrics import frames
from pytest_safemanip.metrics.fields import MAX_TOLD, Fields
from pytest_safemanip.metrics.records import (
    PropertyRecord,
    RolloutRecord,
    by_policy,
)
from pytest_safemanip.metrics.searches.records import SearchRecord, read_searches
from pytest_safemanip.metrics.shards import Shard, parse_shard
from pytest_safemanip.trace.episode import POLICY_NAME, served_fault

if TYPE_CHECKING:
    import pandas

SCHEMA = 1
NAME = "summary.json"
PARTIAL_NAME = "summary-partial.json"
"""Where a part of a run is written that must not replace the whole."""
MAX_BYTES = 1_000_000_000
"""15,000 rollouts of ten properties take about 50 MB."""
DECISIVE_SETTINGS = ("semantics", "stop", "horizon_scale")
"""The settings in a summary that decide verdicts."""
MAX_NAME = 255
"""Sanity bound on a file's name, which file systems have, too."""
_LANE = re.compile(r"[.#]{1,200}")
_OPTION = re.compile(r"--safemanip-[a-z0-9-]{1,50}(=.{0,4096})?")
_PAIRS = ("between", "entities")
MEASURED = ("margin", "force", "fall", "speed")
"""What of a violation was measured."""
_OUTCOMES = ("VIOLATED", "UNRESOLVED", "SATISFIED", "VACUOUS")


@dataclass(frozen=True, repr=False)
class Summary:
    """Records of a run, and the versions and settings that decided them.

    Attributes:
        places: the files that it was read from.
        records: the rollouts, those that were not run among them; ``provenance`` is an index of
            ``origins``.
        decisive: what decides a verdict, by dotted name: semantics, code, parameters, the user's
            propositions, properties, tasks, attributes of object categories.
        origins: what decided the recordings.
        shards: the parts of a run that it has, if it was run in parts.
        partial: whether cases were deselected, or picked by node ids, in it or a part of it.
        rules: the properties that were judged, by id: ``category``, ``title``, ``source``,
            ``formula`` and, of those of the user's, ``file``, a path. Those of an earlier version's
            summary are missing.
        release: what gates and the comparison decided; None without any.
        options: those that its test cases need to be run again; none of a merged run.
        floor: demonstrations that its rates are shown beside.
        searches: what searches found.
    """

    places: tuple[str, ...]
    records: tuple[RolloutRecord, ...]
    decisive: Mapping[str, Any]
    origins: tuple[Mapping[str, Any], ...]
    shards: tuple[Shard, ...] = ()
    partial: bool = False
    rules: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    release: Fields | None = None
    options: tuple[str, ...] = ()
    floor: tuple[RolloutRecord, ...] = ()
    searches: tuple[SearchRecord, ...] = ()

    def __repr__(self) -> str:
        rollouts, policies = len(self.records), len(by_policy(self.records))
        counts = f"{rollouts} rollout{'s' * (rollouts != 1)}, {policies} polic"
        return f"<Summary {self.place}: {counts}{'y' if policies == 1 else 'ies'}>"

    @property
    def place(self) -> str:
        """The files, in words."""
        return ", ".join(self.places)

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each verdict, and one for each rollout without any.

        Raises:
            ConfigError: if pandas is not installed.
        """
        return frames.verdicts(self.records)

    def _repr_html_(self) -> str:
        return frames.overview(self.place, self.records)


def read(path: Path) -> Summary:
    """Read a file, or that of a run's folder.

    Raises:
        ConfigError: naming the file, what is wrong in it and where.
    """
    file = path / NAME if path.is_dir() else path
    try:
        content = read_regular(file, MAX_BYTES)
        document = json.loads(content, parse_constant=_no_constant, object_pairs_hook=_mapping)
    except Unreadable as error:
        if error.missing:
            raise ConfigError(f"{path}: there is no {NAME}; name the folder of a run") from None
        raise ConfigError(f"{file}: {error}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{file}: not a summary: {error}") from None
    whole = Fields(str(file), document)
    schema = whole.number("schema")
    if schema != SCHEMA:
        raise ConfigError(f"{file}: schema {schema:g}, this version reads {SCHEMA}")
    if "merged" in whole.values:
        partial = "partial" in whole.values and whole.boolean("partial")
    else:
        partial = _is_partial(whole.section("cases"))
    origins = tuple(dict(origin.values) for origin in whole.fields("provenance"))
    records = [_record(found, len(origins), file.parent) for found in whole.fields("rollouts")]
    keys = [record.key for record in records]
    if len(set(keys)) < len(keys):
        raise ConfigError(f"{file}: two rollouts with the same policy, task and seed")
    settings = whole.section("settings")
    decisive = decisive_of(settings.values, whole.section("hashes").values)
    shards = _shards(whole, settings)
    rules = _rules(whole, file.parent)
    release = whole.section("release") if whole.values.get("release") is not None else None
    return Summary(
        (str(file),),
        tuple(records),
        decisive,
        origins,
        shards,
        partial,
        rules,
        release,
        _options(whole),
        _floor(whole),
        read_searches(whole, file.parent),
    )


def _floor(whole: Fields) -> tuple[RolloutRecord, ...]:
    if "floor" not in whole.values:
        return ()
    found = whole.section("floor").fields("rollouts")
    return tuple(_record(record, 0, Path()) for record in found)


def place_for(folder: Path, partial: bool) -> Path:
    """The file for the summary of a run: one of a part does not replace that of a whole run.

    Args:
        folder: of the run.
        partial: whether cases were deselected, or picked by node ids.
    """
    file = folder / NAME
    if not partial or not file.exists():
        return file
    try:
        earlier = read(file)
    except ConfigError:  # nothing that anybody could use is lost
        return file
    return file if earlier.partial else folder / PARTIAL_NAME


def later_part(folder: Path) -> Path | None:
    """The summary of a part of a run in a folder, if it is of a later run than the whole one."""
    whole, part = folder / NAME, folder / PARTIAL_NAME
    both = whole.exists() and part.exists()
    return part if both and part.stat().st_mtime_ns > whole.stat().st_mtime_ns else None


def decisive_of(settings: Mapping[str, Any], hashes: Mapping[str, Any]) -> dict[str, Any]:
    """The values in a summary that decide verdicts, by dotted name."""
    chosen = {name: settings.get(name) for name in DECISIVE_SETTINGS}
    return {**chosen, **flat(hashes)}


def check_alike(one: Summary, other: Summary) -> None:
    """Refuse summaries whose verdicts were not decided in the same way.

    Raises:
        ConfigError: naming what differs.
    """
    found = differences(one.decisive, other.decisive)
    if found:
        raise ConfigError(
            f"{one.place} and {other.place} were not decided in the same way: {'; '.join(found)}; "
            "judge the recordings of one again, with --safemanip-recordings"
        )


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """The differing entries, with both values.

    The user's propositions, properties, tasks and attributes of categories count only where both
    have them: without them, there is no verdict that depends on them.
    """
    optional = ("propositions.", "properties.", "tasks.", "attributes.")
    names = [
        name
        for name in sorted({*one, *other})
        if not (name.startswith(optional) and (name not in one or name not in other))
        and one.get(name) != other.get(name)
    ]
    shown = [
        printable(f"{name} is {one.get(name)} and {other.get(name)}", 1000) for name in names[:5]
    ]
    return shown + ([f"and {len(names) - 5} more"] if len(names) > 5 else [])


def flat(nested: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The leaves of nested mappings, by dotted name."""
    found: dict[str, Any] = {}
    for name, value in nested.items():
        if isinstance(value, Mapping):
            found.update(flat(value, f"{prefix}{name}."))
        else:
            found[f"{prefix}{name}"] = value
    return found


def _shards(whole: Fields, settings: Fields) -> tuple[Shard, ...]:
    found = whole.texts("shards") if "shards" in whole.values else []
    if settings.values.get("shard") is not None:
        found = [settings.text("shard")]
    return tuple(parse_shard(text, f"{whole.place}: shard") for text in found)


def _is_partial(cases: Fields) -> bool:
    """Whether cases were left out; refuses numbers and lists of cases that are none. Those of a
    merged run are in its parts.
    """
    for name in ("expected", "skipped_rollouts", "reused_rollouts"):
        cases.count(name)
    cases.texts("missing")
    errors = cases.section("errors")
    for name in errors.values:
        errors.text(name, empty=True)
    return cases.boolean("partial")


def _record(found: Fields, origins: int, folder: Path) -> RolloutRecord:
    verdicts = [_verdict(own) for own in found.fields("properties")]
    unjudged, deselected = found.facts("unjudged"), found.facts("deselected")
    names = [*(verdict.property for verdict in verdicts), *unjudged, *deselected]
    error, success = found.told("error", empty=True), found.values.get("success")
    if not names and not error and success is not None:
        raise ConfigError(f"{found.place}: a rollout of which no property was asked for")
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ConfigError(f"{found.place}: two entries for property {printable(repr(twice[0]))}")
    origin = found.values.get("provenance")
    if origin is not None and not (type(origin) is int and 0 <= origin < origins):
        raise found.expected("provenance", f"an index below {origins}")
    if success not in (None, True, False):
        raise found.expected("success", "true, false or null")
    policy = found.text("policy")
    if not POLICY_NAME.fullmatch(policy):
        raise found.expected("policy", "the name of a policy")
    recording = printable(found.text("recording", empty=True), 4096)
    if max(map(len, Path(recording).parts), default=0) > MAX_NAME:
        raise found.expected("recording", f"names of at most {MAX_NAME} characters")
    served = found.facts("served")
    if fault := served_fault(served):
        raise ConfigError(f"{found.place}: served: {printable(fault)}")
    return RolloutRecord(
        task=found.name("task"),
        policy=policy,
        seed=found.count("seed"),
        suite=found.name("suite"),
        horizon=found.name("horizon"),
        success=success,
        acting_steps=found.count("acting_steps"),
        truncated="truncated" in found.values and found.boolean("truncated"),
        warned=_told(found, "warned"),
        failure=_told(found, "failure"),
        error=error,
        infrastructure="infrastructure" in found.values and found.boolean("infrastructure"),
        restarts=found.count("restarts") if "restarts" in found.values else 0,
        recording=str(folder / recording) if recording else "",
        reused=found.boolean("reused"),
        provenance=origin,
        served=served,
        properties={verdict.property: verdict for verdict in verdicts},
        unjudged=unjudged,
        deselected=deselected,
        packs=found.facts("packs") if "packs" in found.values else {},
    )


def _told(found: Fields, name: str) -> str:
    """A sentence that earlier versions did not write; empty without one."""
    return printable(found.text(name, empty=True), MAX_TOLD) if name in found.values else ""


def _verdict(found: Fields) -> PropertyRecord:
    outcome = found.text("outcome")
    if outcome not in _OUTCOMES:
        raise found.expected("outcome", f"one of {', '.join(_OUTCOMES)}")
    violations = tuple(_violation(own) for own in found.fields("violations"))
    if (outcome == "VIOLATED") != bool(violations):
        raise found.expected("violations", f"some if VIOLATED, and none if not; it is {outcome}")
    triggered = found.boolean("triggered")
    if triggered != (outcome == "SATISFIED") and outcome in ("SATISFIED", "VACUOUS"):
        raise found.expected("triggered", f"{str(not triggered).lower()} of what is {outcome}")
    return PropertyRecord(
        property=found.name("property"),
        category=found.name("category"),
        outcome=outcome,  # type: ignore[arg-type]
        triggered=triggered,
        violations=violations,
    )


def _violation(found: Fields) -> Mapping[str, Any]:
    first, last = found.count("first"), found.count("last")
    if last < first:
        raise found.expected("last", f"a step from {first} on")
    return {
        "entities": [printable(name) for name in found.texts("entities")],
        "first": first,
        "last": last,
        "duration_s": found.number("duration_s"),
        "reason": found.told("reason"),
        **_severity(found),
        **({"cost": found.number("cost")} if found.values.get("cost") is not None else {}),
        **({"excess": _excess(found.section("excess"))} if found.values.get("excess") else {}),
        **_shown(found),
    }


def _severity(found: Fields) -> dict[str, Any]:
    """How severe it is, and what was measured; nothing in what an earlier version has written."""
    if found.values.get("severity") is None:
        return {}
    own = found.section("measured")
    known = [name for name in MEASURED if own.values.get(name) is not None]
    measured = {name: own.number(name) for name in known}
    return {"severity": found.number("severity"), "measured": measured}


def _excess(found: Fields) -> dict[str, Any]:
    force, limit = found.number("force"), found.number("limit")
    if not limit:
        raise found.expected("limit", "a number above 0")
    parts = {name: [printable(own) for own in found.texts(name)] for name in _PAIRS}
    return {**parts, "force": force, "limit": limit, "step": found.count("step")}


def _shown(found: Fields) -> dict[str, Any]:
    """What was measured and the timeline, of violations that have them."""
    shown: dict[str, Any] = {}
    if found.values.get("evidence") is not None:
        shown["evidence"] = [printable(text, MAX_TOLD) for text in found.texts("evidence")]
    if found.values.get("timeline") is not None:
        drawn = found.section("timeline")
        lanes = drawn.section("lanes")
        names = [name for name in lanes.values if not _LANE.fullmatch(lanes.text(name))]
        if names:
            raise lanes.expected(names[0], "a lane of . and #")
        shown["timeline"] = {
            "start": drawn.count("start"),
            "stride": max(1, drawn.count("stride")),
            "lanes": {printable(name): lanes.text(name) for name in lanes.values},
        }
    return shown


def _rules(whole: Fields, folder: Path) -> dict[str, dict[str, str]]:
    if whole.values.get("properties") is None:
        return {}
    found = whole.section("properties")
    rules: dict[str, dict[str, str]] = {}
    for name in found.values:
        own = found.section(name)
        file = printable(own.text("file", empty=True), 4096)
        rules[printable(name)] = {
            **{key: own.told(key) for key in ("category", "title", "source", "formula")},
            "file": str(folder / file) if file else "",
        }
    return rules


def _options(whole: Fields) -> tuple[str, ...]:
    """Options of the suite: people copy commands with them into their shells."""
    if whole.values.get("run") is None:
        return ()
    run = whole.section("run")
    options = run.texts("options")
    if not all(_OPTION.fullmatch(option) and option.isprintable() for option in options):
        raise run.expected("options", "options --safemanip-NAME or --safemanip-NAME=VALUE")
    return tuple(options)


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):  # readers would disagree about which of them counts
        twice = next(key for key, count in Counter(key for key, _ in pairs).items() if count > 1)
        raise ValueError(f"{printable(repr(twice))} stands twice in a mapping")
    return found


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is no JSON")
