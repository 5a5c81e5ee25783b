"""``safemanip policies``."""

from __future__ import annotations

import argparse
import inspect
import pkgutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pytest_safemanip.cli.folder import Folder, read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.policies.registry import BUILT_IN
from pytest_safemanip.policies.remote.presets import PRESETS, SCHEMES, Preset
from pytest_safemanip.provenance import file_of
from pytest_safemanip.run.invocation import relative_path

EXAMPLE = "safemanip policies"
_WRITTEN = {"recording": "recording:DIR"}
"""How a built-in policy is written, where its name alone is not enough."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    folder = read_folder()
    rows = [*_own(folder), *_built_in(), *_served(folder.settings.servers)]
    if options.json:
        print_json([{"name": name, "runs": where, "about": about} for name, where, about in rows])
        return 0
    print_table(("policy", "runs", "about"), rows)
    print_wrapped(
        "\nMODULE:ATTRIBUTE is a policy of your own: a class, a factory, an object or a function. "
        "Another address: pi05=ws://host:8000, or SAFEMANIP_PI05 in the environment. "
        "safemanip faults lists the mistakes that scripted can make."
    )
    return 0


def _own(folder: Folder) -> list[tuple[str, str, str]]:
    return [(name, "here", _about(given)) for name, given in folder.extensions.policies.items()]


def _built_in() -> list[tuple[str, str, str]]:
    rows = [
        (_WRITTEN.get(name, name), "here", _first_line(pkgutil.resolve_name(str(given))))
        for name, given in BUILT_IN.items()
    ]
    scripted = (
        ("scripted:FAULT", "here", "The same with a mistake made on purpose."),
        ("scripted:FAULT@X", "here", "The same, so large: scripted:drop@0.04 lets go at 4 cm."),
        ("scripted:PLANS.yaml", "here", "The expert with plans of your own before the shipped."),
    )
    return [row for built in rows for row in (built, *(scripted if built[0] == "scripted" else ()))]


def _served(servers: Mapping[str, str]) -> list[tuple[str, str, str]]:
    return [(preset.name, "on a server", _server(preset, servers)) for preset in PRESETS.values()]


def _server(preset: Preset, servers: Mapping[str, str]) -> str:
    """Where it is asked for, what it is evaluated in, and which checkpoint it is."""
    address = f"{SCHEMES[preset.transport][0]}://127.0.0.1:{preset.port}"
    each = f", a server for each of {', '.join(preset.task_sets)}" if preset.task_sets else ""
    lines = [f"{servers.get(preset.name, address)} ({preset.transport}){each}"]
    if preset.split:
        lines.append(f"{preset.split} scenes")
        lines.append(next(iter(preset.checkpoints.values())))
    return "\n".join(lines)


def _about(given: Any) -> str:
    """What a user's hook gives: where it is from and what it says of itself."""
    if isinstance(given, str):
        return given
    path = file_of(given)
    place = str(relative_path(path, Path.cwd())) if path else ""
    named = inspect.isclass(given) or inspect.isfunction(given)
    return "\n".join(line for line in (_first_line(given) if named else "", place) if line)


def _first_line(target: Any) -> str:
    return (inspect.getdoc(target) or "").partition("\n")[0]
