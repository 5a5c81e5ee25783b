"""Paths as CI servers read them: relative to the folder that the repository was checked out to."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

ROOTS = ("GITHUB_WORKSPACE", "CI_PROJECT_DIR", "WORKSPACE")
"""Variables of GitHub, GitLab and Jenkins that name that folder."""


def source_root(environ: Mapping[str, str] = os.environ) -> Path:
    """The folder of the checkout: as the CI server says, if we are in it, else the working one."""
    here = Path.cwd()
    for name in ROOTS:
        given = environ.get(name, "")
        if given and here.is_relative_to(Path(given).absolute()):
            return Path(given).absolute()
    return here


def below(path: Path, root: Path) -> PurePosixPath | None:
    """A path relative to a folder, with slashes; None if it is not below it."""
    found = Path(os.path.normpath(Path.cwd() / path))
    return PurePosixPath(found.relative_to(root)) if found.is_relative_to(root) else None
