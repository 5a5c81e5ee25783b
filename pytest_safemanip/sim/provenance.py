"""Digests of what decides the content of a recording."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent


def source_digest(*parts: str) -> str:
    """Digest of the package's own code and data in some of its rooms.

    Args:
        parts: folders or files, relative to the package.
    """
    digest = hashlib.sha256()
    for part in sorted(parts):
        root = PACKAGE / part
        files = [root] if root.is_file() else sorted({*root.rglob("*.py"), *root.rglob("*.yaml")})
        for file in files:
            digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0")
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Installed versions; ``unknown`` for a package on the path that is not installed."""
    found = {}
    for package in packages:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "unknown"
    return found
