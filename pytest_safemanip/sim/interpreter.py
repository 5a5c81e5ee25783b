"""Other Python interpreters, in which simulators run that cannot be installed beside this package.

Such an interpreter needs no installation of this package: its process imports this very folder, and
nothing else of what is installed here.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.provenance import PACKAGE

OLDEST = (3, 11)
"""The oldest Python that this package's code runs on."""
DEADLINE = 60.0
"""Seconds that an interpreter has to say what is installed: the first start reads cold disks."""

IMPORTABLE = (
    "import importlib.util, sys; "
    f"spec = importlib.util.spec_from_file_location({PACKAGE.name!r}, "
    f"{str(PACKAGE / '__init__.py')!r}, submodule_search_locations=[{str(PACKAGE)!r}]); "
    f"package = sys.modules[{PACKAGE.name!r}] = importlib.util.module_from_spec(spec); "
    "spec.loader.exec_module(package)"
)
"""Makes this package importable, but not what is installed beside it: that may be of another
version than the interpreter's own, or compiled for another Python."""

_LOOK = (
    "import importlib.metadata as m, importlib.util as u, json, sys\n"
    "def version(n):\n"
    "    try: return m.version(n)\n"
    "    except m.PackageNotFoundError: return ''\n"
    "def place(n):\n"
    "    s = u.find_spec(n)\n"
    "    return next(iter((s and s.submodule_search_locations) or ['']))\n"
    "print(json.dumps([sys.version_info[:2], {n: version(n) for n in json.loads(sys.argv[1])},"
    " {n: place(n) for n in json.loads(sys.argv[2])}]))"
)


@dataclass(frozen=True)
class Installed:
    """What an interpreter has.

    Attributes:
        python: its version, major and minor.
        versions: of distributions; empty for one that is not installed.
        folders: of packages; none for one that cannot be imported.
    """

    python: tuple[int, int]
    versions: Mapping[str, str]
    folders: Mapping[str, Path]


def clean_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """An environment without what this process's Python was told about paths."""
    return {k: v for k, v in environment.items() if k not in ("PYTHONPATH", "PYTHONHOME")}


@functools.cache
def installed(python: str, distributions: Sequence[str], packages: Sequence[str]) -> Installed:
    """Ask an interpreter what it has; nothing of it is imported.

    Args:
        python: its path.
        distributions: names whose versions are wanted.
        packages: names of importable packages whose folders are wanted.

    Raises:
        ConfigError: if it is no interpreter, or too old.
    """
    command = [python, "-P", "-c", _LOOK, json.dumps(distributions), json.dumps(packages)]
    what = f"safemanip_python: {python}"
    try:
        answer = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=DEADLINE,
            env=clean_environment(os.environ),
            check=True,
        )
        version, versions, folders = json.loads(answer.stdout)
    except FileNotFoundError:
        raise ConfigError(f"{what}: no such interpreter") from None
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        # -P itself is unknown before 3.11
        raise ConfigError(
            f"{what}: cannot be run, or is older than Python {OLDEST[0]}.{OLDEST[1]} ({error})"
        ) from error
    return Installed(
        (version[0], version[1]), versions, {name: Path(p) for name, p in folders.items() if p}
    )
