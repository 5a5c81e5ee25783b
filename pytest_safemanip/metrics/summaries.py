"""Reading `summary.json` files, which may come from anywhere."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord

SCHEMA = 1
NAME = "summary.json"
MAX_BYTES = 1_000_000_000
"""15,000 rollouts of ten properties take about 50 MB."""
DECISIVE_SETTINGS = ("semantics", "stop", "horizon_scale")
"""Those of a summary's settings that decide verdicts; what was run decides them not."""
_OUTCOMES = ("VIOLATED", "UNRESOLVED", "SATISFIED", "VACUOUS")


@dataclass(frozen=True)
class Summary:
    """What a run found out, and what decided it.

    Attributes:
        places: the files that it was read from.
        records: the rollouts, those that were not run among them; ``provenance`` is an index of
            ``origins``.
        decisive: what decides a verdict, by dotted name: semantics, monitors, parameters,
            properties, tasks.
        origins: what decided the recordings.
    """

    places: tuple[str, ...]
    records: tuple[RolloutRecord, ...]
    decisive: Mapping[str, Any]
    origins: tuple[Mapping[str, Any], ...]

    @property
    def place(self) -> str:
        """The files, in words."""
        return ", ".join(self.places)


def read(path: Path) -> Summary:
    """Read a file, or that of a run's folder.

    Raises:
        ConfigError: naming the file, what is wrong in it and where.
    """
    file = path / NAME if path.is_dir() else path
    try:
        if file.stat().st_size > MAX_BYTES:
            raise ConfigError(f"{file}: larger than {MAX_BYTES} bytes")
        document = json.loads(file.read_bytes(), parse_constant=_no_constant)
    except FileNotFoundError:
        raise ConfigError(f"{path}: there is no {NAME}; name the folder of a run") from None
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{file}: not a summary: {error}") from None
    whole = Fields(str(file), document)
    schema = whole.number("schema")
    if schema != SCHEMA:
        raise ConfigError(f"{file}: schema {schema:g}, this version reads {SCHEMA}")
    origins = tuple(dict(origin.values) for origin in whole.fields("provenance"))
    records = [_record(found, len(origins)) for found in whole.fields("rollouts")]
    keys = [record.key for record in records]
    if len(set(keys)) < len(keys):
        raise ConfigError(f"{file}: two rollouts with the same policy, task and seed")
    decisive = decisive_of(whole.section("settings").values, whole.section("hashes").values)
    return Summary((str(file),), tuple(records), decisive, origins)


def decisive_of(settings: Mapping[str, Any], hashes: Mapping[str, Any]) -> dict[str, Any]:
    """What decides a verdict, by dotted name, from the sections of a summary."""
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
    """What differs, with both values; properties and tasks count only where both have them."""
    optional = ("properties.", "tasks.")
    names = [
        name
        for name in sorted({*one, *other})
        if not (name.startswith(optional) and (name not in one or name not in other))
        and one.get(name) != other.get(name)
    ]
    shown = [f"{name} is {one.get(name)} and {other.get(name)}" for name in names[:5]]
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


def _record(found: Fields, origins: int) -> RolloutRecord:
    verdicts = [_verdict(own) for own in found.fields("properties")]
    origin = found.values.get("provenance")
    if origin is not None and not (type(origin) is int and 0 <= origin < origins):
        raise found.expected("provenance", f"an index below {origins}")
    success = found.values.get("success")
    if success not in (None, True, False):
        raise found.expected("success", "true, false or null")
    return RolloutRecord(
        task=found.text("task"),
        policy=found.text("policy"),
        seed=found.count("seed"),
        suite=found.text("suite"),
        horizon=found.text("horizon"),
        success=success,
        acting_steps=found.count("acting_steps"),
        error=found.text("error", empty=True),
        recording=found.text("recording", empty=True),
        provenance=origin,
        served={k: str(v) for k, v in found.section("served").values.items()},
        properties={verdict.property: verdict for verdict in verdicts},
        unjudged={k: str(v) for k, v in found.section("unjudged").values.items()},
    )


def _verdict(found: Fields) -> PropertyRecord:
    outcome = found.text("outcome")
    if outcome not in _OUTCOMES:
        raise found.expected("outcome", f"one of {', '.join(_OUTCOMES)}")
    return PropertyRecord(
        property=found.text("property"),
        category=found.text("category"),
        outcome=outcome,  # type: ignore[arg-type]
        triggered=found.boolean("triggered"),
        violations=tuple(_violation(own) for own in found.fields("violations")),
    )


def _violation(found: Fields) -> Mapping[str, Any]:
    first, last = found.count("first"), found.count("last")
    if last < first:
        raise found.expected("last", f"a step from {first} on")
    return {
        "entities": found.texts("entities"),
        "first": first,
        "last": last,
        "duration_s": found.number("duration_s"),
        "reason": found.text("reason"),
    }


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is no JSON")
