"""Writes the page of a run, and the files beside it that it loads when they are looked at."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics import summaries
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.release_gate import Ruling
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.headline import headline
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.report.page.details import details, worst_of_each
from pytest_safemanip.report.page.encoding import told
from pytest_safemanip.report.page.overview import overview
from pytest_safemanip.report.page.release import read_release
from pytest_safemanip.report.page.searches import searches
from pytest_safemanip.report.replay import standalone
from pytest_safemanip.report.replay.standalone import browser_file, script_json
from pytest_safemanip.report.severity import RANKED, Key, ranks
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.run.definitions import Definitions, load_definitions

NAME = "report.html"
OTHER_GATES = "the gates are those given to safemanip report, not those of the run"
BESIDE = "report"
"""The folder of the files beside the page."""
WITHIN = 8_000_000
"""Characters of details that are within the page; those of further rollouts are beside it."""
_HERE = Path(__file__).parent
_SETTINGS = (
    "semantics",
    "stop",
    "horizon_scale",
    "backend",
    "scenes",
    "stepping",
    "assets",
    "prompt",
    "seeds",
    "recordings",
    "shard",
)
STYLES = (
    "vendor/uplot/uPlot.min.css",
    "styles/page.css",
    "styles/tables.css",
    "styles/charts.css",
    "styles/rollout.css",
)
SCRIPTS = (
    "vendor/uplot/uPlot.iife.min.js",
    "scripts/dom.js",
    "scripts/address.js",
    "scripts/theme.js",
    "scripts/data.js",
    "scripts/figures.js",
    "scripts/charts.js",
    "scripts/table.js",
    "scripts/groups.js",
    "scripts/baseline.js",
    "scripts/searches.js",
    "scripts/overview.js",
    "scripts/lanes.js",
    "scripts/signals.js",
    "scripts/timeline.js",
    "scripts/violations.js",
    "scripts/rollout.js",
    "scripts/page.js",
)
"""In the order in which they are run."""


def write_page(
    folder: Path,
    definitions: Definitions | None = None,
    ruling: Ruling | None = None,
    tell: Callable[[str], None] = lambda line: None,
) -> Path:
    """Write ``report.html`` from what is in the folder of a run.

    Args:
        folder: with ``summary.json`` and the recordings that it names.
        definitions: tasks, properties and propositions; the shipped ones by default.
        ruling: what gates and a baseline decide; by default what the summary says about it.
        tell: is told what the page says about itself: whose gates it has, what cannot be read.

    Returns:
        The page.

    Raises:
        ConfigError: if there is no summary, or it is malformed; naming it and the place in it.
        OSError: if the folder cannot be written.
    """
    found = summaries.read(folder)
    about = _about(folder, found, ruling)
    defined = definitions or load_definitions([], [], [])
    beside = _Beside(folder / BESIDE)
    within: list[dict[str, Any]] = []
    room = WITHIN
    places: dict[int, str] = {}
    instructions: dict[int, str] = {}
    unreadable = 0
    for number, content in details(found, folder, defined):
        instructions[number] = content.get("instruction", "")
        unreadable += "violations" in content
        text = script_json(content)
        room -= len(text)
        if room >= 0:
            within.append({"number": number, "json": text})
            places[number] = ""
        else:
            places[number] = f"{BESIDE}/{beside.write(number, text)}"
    ranked = ranks(found.records)
    data = {
        **about,
        **overview(found),
        "ranked": RANKED,
        "details": places,
        "worst": told(worst_of_each(found.records, ranked)),
        "ranks": _by_rollout(ranked),
        "instructions": instructions,
    }
    notes = [OTHER_GATES] if ruling else []
    if unreadable:
        gone = counted(unreadable, "recording")
        notes.append(f"{gone} cannot be read: what the summary says is shown instead")
    data["notes"] += notes
    for note in notes:
        tell(f"{NAME}: {note}")
    page = write_whole(folder / NAME, _render(script_json(data), within))
    beside.clear()
    return page


def _about(folder: Path, found: Summary, ruling: Ruling | None) -> dict[str, Any]:
    """What the summary says beside its rollouts, and what was decided.

    Raises:
        ConfigError: if it is malformed.
    """
    file = folder / summaries.NAME
    try:
        document = json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file}: cannot be read: {error}") from None
    whole = Fields(str(file), document)
    decided = document.get("release") if ruling is None else ruling.to_json()
    came_to = headline(found, None if decided is None else Fields(f"{file}: release", decided))
    written = datetime.fromtimestamp(file.stat().st_mtime, UTC)
    return {
        "title": folder.resolve().name,
        "written": written.strftime("%Y-%m-%d %H:%M UTC"),
        "versions": whole.facts("versions"),
        "settings": {
            **_settings(whole.section("settings")),
            **_judged(found),
            **_rendered(found),
            **_ran(whole),
        },
        "headline": {"verdict": came_to.verdict, "text": came_to.text},
        "release": read_release(str(file), decided),
        "searches": searches(whole),
    }


def _settings(settings: Fields) -> dict[str, str]:
    """The settings that one wants to know."""
    values = {name: settings.values.get(name) for name in _SETTINGS}
    return {name: told(_in_words(value)) for name, value in values.items() if value is not None}


def _in_words(value: Any) -> str:
    """A setting; one of each policy where they differ."""
    if isinstance(value, dict):
        same = len({str(own) for own in value.values()}) == 1
        told_of = [f"{name}: {own}" for name, own in value.items()]
        return str(next(iter(value.values()))) if same else ", ".join(told_of)
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _judged(found: Summary) -> dict[str, str]:
    """The tasks, and the parameters that propositions were judged with."""
    tasks = dict.fromkeys(record.task for record in found.records)
    parameters = [
        f"{name.removeprefix('parameters.')} {value:g}"
        for name, value in found.decisive.items()
        if name.startswith("parameters.") and isinstance(value, int | float)
    ]
    shown = {"tasks": ", ".join(tasks), "parameters": ", ".join(parameters)}
    return {name: told(text) for name, text in shown.items() if text}


def _rendered(found: Summary) -> dict[str, str]:
    """The assets that rollouts were run with, whatever was asked for."""
    used = sorted({str(o["assets"]) for o in found.origins if o.get("assets")})
    used = [f"{name} stand-ins" if name == "primitive" else name for name in used]
    return {"assets": told(", ".join(used))} if used else {}


def _ran(whole: Fields) -> dict[str, str]:
    """The machine, and how long the run took; nothing of a merged run."""
    if whole.values.get("run") is None:
        return {}
    run = whole.section("run")
    lasted = timedelta(seconds=round(run.number("seconds")))
    return {"host": run.told("host", empty=True), "began": run.told("began"), "took": str(lasted)}


def _by_rollout(ranked: Mapping[Key, int]) -> dict[int, dict[str, list[int]]]:
    """Ranks of the violations of each rollout, by property id."""
    found: dict[int, dict[str, list[int]]] = {}
    for (number, id_, _), rank in sorted(ranked.items()):
        found.setdefault(number, {}).setdefault(id_, []).append(rank)
    return found


class _Beside:
    """The files of rollouts that are not within the page.

    Args:
        folder: where they are.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: set[str] = set()

    def write(self, number: int, text: str) -> str:
        """Write the details of a rollout as a script, which a browser loads from a disk, too.

        Returns:
            Its name.
        """
        if self._folder.is_symlink():
            raise ConfigError(f"{self._folder}: is a link; remove it")
        script = f"SafemanipReport.received({number}, {text});\n".encode()
        # Named by its content: a page that stays, since the next cannot be written, keeps its own.
        name = f"rollout-{number}-{hashlib.sha256(script).hexdigest()[:12]}.js"
        write_whole(self._folder / name, (script,))
        self._written.add(name)
        return name

    def clear(self) -> None:
        """Remove those of an earlier page."""
        if self._folder.is_symlink():
            return  # what is there is not ours
        for path in self._folder.glob("rollout-*.js"):
            if path.name not in self._written:
                path.unlink()


def _render(data: str, within: list[dict[str, Any]]) -> Iterator[str]:
    scripts = [_asset(name) for name in SCRIPTS]
    styles = [_asset(name) for name in STYLES]
    scripts[:0] = map(browser_file, standalone.SCRIPTS)
    styles.append(browser_file(standalone.STYLE))
    script, style = "\n".join(scripts), "\n".join(styles)
    policy = (
        "default-src 'none'; "
        f"script-src 'self' file: '{_digest(script)}'; "
        f"style-src '{_digest(style)}'; "
        "img-src data: blob:; media-src 'self' file:; base-uri 'none'; form-action 'none'"
    )
    environment = Environment(loader=FileSystemLoader(_HERE), autoescape=True)
    template = environment.get_template("page.html")
    return template.generate(policy=policy, style=style, script=script, data=data, within=within)


def _asset(name: str) -> str:
    return (_HERE / name).read_text("utf-8").strip()


def _digest(text: str) -> str:
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"sha256-{digest}"
