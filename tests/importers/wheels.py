"""robosuite's wheels with human demonstrations in them, kept between test runs.

``python -m tests.importers.wheels`` fetches them before the tests, which several processes run.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import filelock
import platformdirs

SHA256 = {
    "0.1.0": "167940101c37b2a590676d60659a0a1ca59a71cc583ab5e6b9c025c23ebcec7c",
    "1.0.0": "3d833ef789e12f40ce3fe44269f0984456310f94d72d807147d8b124b9c630c9",
    "1.4.0": "aba065e7b36745738cede259457b2cb349427f3608728d867ef3a2034cb62994",
}
"""Of the wheels; 0.3.0 has the demonstrations of 0.1.0, and 1.4.1 those of 1.4.0."""
FOLDER = platformdirs.user_cache_path("safemanip-tests")


class NoWheel(Exception):
    """No index has it, or none can be reached."""


def wheel(version: str) -> Path:
    """The wheel of a version, from the cache or from the package index.

    Raises:
        NoWheel: if it cannot be had.
    """
    path = FOLDER / f"robosuite-{version}-py3-none-any.whl"
    FOLDER.mkdir(parents=True, exist_ok=True)
    with filelock.FileLock(path.with_suffix(".lock")):
        if not path.exists():
            _fetch(version)
        if hashlib.sha256(path.read_bytes()).hexdigest() != SHA256[version]:
            path.unlink()
            raise NoWheel(f"{path.name} is not the one that is known")
    return path


def _fetch(version: str) -> None:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-input"]
    command += ["--disable-pip-version-check", "--retries=1", f"--dest={FOLDER}"]
    command += [f"robosuite=={version}"]
    found = subprocess.run(command, check=False, capture_output=True, text=True, timeout=600)
    if found.returncode:
        raise NoWheel(found.stderr.strip().splitlines()[-1])


if __name__ == "__main__":
    for version in SHA256:
        wheel(version)
