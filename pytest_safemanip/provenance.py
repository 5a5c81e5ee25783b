"""Versions and digests of the code that decides a recording or a verdict on it.

In the code of users, import statements are followed, wherever they stand in a file, into files that
are the user's own: not the standard library's, not this package's, and not those of installed
packages, except of the package that the policy or proposition itself is in.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import inspect
import os
import re
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import metadata
from importlib.machinery import all_suffixes
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

Named = tuple[str, ...]
"""A module's name, in its parts."""

PACKAGE = Path(__file__).resolve().parent
_LIBRARY = tuple(
    Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")
)  # fmt: skip
_INSTALLED = {"site-packages", "dist-packages"}
_RUNS_UNSEEN = re.compile(
    r"((builtins\.|__builtins__\.)?(exec|__import__)|runpy\..+|importlib\.(import_module|__import__)"
    r"|importlib\.util\.spec_from_file_location|importlib\.machinery\.SourceFileLoader)"
)
"""What runs code that the source of its user does not show."""


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Installed versions; ``unknown`` for a package on the path that is not installed."""
    found = {}
    for package in packages:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "unknown"
    return found


def source_digest(*parts: str) -> str:
    """Digest of the package's own code and data in some of its rooms.

    Args:
        parts: folders or files, relative to the package.

    Raises:
        FileNotFoundError: if a part does not exist or has no file, as after a rename.
    """
    digest = hashlib.sha256()
    for part in sorted(parts):
        root = PACKAGE / part
        files = [root] if root.is_file() else sorted({*root.rglob("*.py"), *root.rglob("*.yaml")})
        if not files:
            raise FileNotFoundError(f"source_digest: {part!r} has no file in {PACKAGE}")
        for file in files:
            digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0")
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def installed_digest(*packages: str) -> str:
    """Digest of the code of installed packages, see :func:`files_digest`."""
    specs = filter(None, map(importlib.util.find_spec, packages))
    places = [place for spec in specs for place in spec.submodule_search_locations or ()]
    return files_digest(*map(Path, places))


@functools.cache
def files_digest(*folders: Path, suffixes: tuple[str, ...] = (".py",)) -> str:
    """Digest of the files of some folders: a checkout has no version that tells its states apart.

    Args:
        folders: with all that is in them.
        suffixes: of the files that count.
    """
    digest = hashlib.sha256()
    for folder in folders:
        for file in sorted(folder.rglob("*")):
            if file.suffix in suffixes and file.is_file():
                digest.update(file.relative_to(folder).as_posix().encode() + b"\0")
                digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def file_of(target: Any) -> Path | None:
    """The Python file that defines a function, a class, or the class of an object.

    Returns:
        None where there is none: typed into an interpreter, or compiled.
    """
    while isinstance(target, functools.partial):
        target = target.func
    if not inspect.isclass(target) and not inspect.isroutine(target):
        wrapped = inspect.unwrap(target) if callable(target) else target
        target = wrapped if inspect.isroutine(wrapped) else type(target)
    try:
        return _python(inspect.getfile(inspect.unwrap(target)))
    except (TypeError, OSError):
        return None


def module_file(module: ModuleType) -> Path | None:
    """The Python file of a module; None where there is none."""
    return _python(getattr(module, "__file__", None) or "")


def closure_digest(roots: Iterable[Path]) -> str | None:
    """SHA-256 of the contents of some Python files and of all that they import.

    It does not depend on where the files lie.

    Args:
        roots: resolved paths.

    Returns:
        None if something imported has no file, or the source does not show what is run, as with
        ``exec``, ``runpy``, ``__import__`` and modules whose names are computed.
    """
    todo = list(roots)
    own = {_top_of(path) for path in todo}
    contents: dict[Path, bytes] = {}
    find = functools.cache(lambda parts: tuple(_absolute(parts)))
    while todo:
        path = todo.pop()
        if path in contents or not _is_followed(path, own):
            continue
        contents[path] = path.read_bytes()
        todo += _packages_of(path)
        try:
            todo += _imported(path, contents[path], find)
        except ValueError:
            return None
    parts = sorted(path.name.encode() + b"\0" + content for path, content in contents.items())
    digest = hashlib.sha256()
    for part in parts:
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


def functions_digest(functions: Iterable[Callable[..., Any]]) -> str | None:
    """Digest of the files that functions are written in, and of what these import.

    Returns:
        None if a function has no source file.
    """
    files = set()
    for function in functions:
        paths = [_python(f.__code__.co_filename) for f in _written(function)]
        if not paths or None in paths:
            return None
        files |= {path for path in paths if path}
    return closure_digest(files)


def _written(function: Callable[..., Any]) -> Iterator[FunctionType]:
    """The functions in Python behind a callable: what is decorated, and its decorators' own."""
    while isinstance(function, functools.partial):
        function = function.func
    wrapped = getattr(function, "__wrapped__", None)
    if wrapped is not None:
        yield from _written(wrapped)
    own: Any = function if inspect.isroutine(function) else type(function).__call__
    own = getattr(own, "__func__", own)
    if inspect.isfunction(own):
        yield own


def _python(name: str) -> Path | None:
    path = Path(name)
    return path.resolve() if path.suffix == ".py" and path.is_file() else None


def _packages_of(path: Path) -> list[Path]:
    """The ``__init__.py`` of the packages that a file is in, which its import runs too; the
    outermost is the last.
    """
    found = []
    for folder in path.parents:
        if not (folder / "__init__.py").is_file():
            break
        found.append(folder / "__init__.py")
    return found


def _top_of(path: Path) -> Path:
    """The folder of the outermost package that a file is in; the file itself outside packages."""
    packages = _packages_of(path)
    return packages[-1].parent if packages else path


def _is_followed(path: Path, own: Iterable[Path]) -> bool:
    if path.is_relative_to(PACKAGE):
        return False
    if any(path.is_relative_to(top) for top in own):
        return True
    in_library = any(path.is_relative_to(folder) for folder in _LIBRARY)
    return not in_library and _INSTALLED.isdisjoint(path.parts)


def _imported(
    path: Path, content: bytes, find: Callable[[Named], Iterable[Path]]
) -> Iterator[Path]:
    """Files that the imports of a file may mean.

    Args:
        path: of the file.
        content: of the file.
        find: the files of an absolute name.

    Raises:
        ValueError: if a module was put together without a file, or the file runs code that reading
            it does not show.
    """
    named = _names_imported(content) if path.suffix == ".py" else ()
    if named is None:
        raise ValueError(f"{path} runs code that its source does not show")
    for level, parts in named:
        yield from _files(path.parents[level - 1], parts) if level else find(parts)


@functools.lru_cache(maxsize=1024)  # a run asks for several digests of much the same files
def _names_imported(content: bytes) -> tuple[tuple[int, Named], ...] | None:
    """What a file in Python imports: names, each with how many dots stand before it.

    Returns:
        None if the file runs code that reading it does not show.
    """
    try:
        tree = ast.parse(content)
    except SyntaxError:  # of a file that is not imported yet, and then fails
        return ()
    bound = dict(_bound(tree))
    literal = set()  # the functions of calls whose module can be read
    found: dict[tuple[int, Named], None] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {(0, tuple(alias.name.split("."))): None for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module.split(".") if node.module else []
            found |= {(node.level, (*base, alias.name)): None for alias in node.names}
        elif isinstance(node, ast.Call) and _dotted(node.func, bound) == "importlib.import_module":
            match node.args:
                case [ast.Constant(value=str(name))] if not name.startswith("."):
                    literal.add(node.func)
                    found[0, tuple(name.split("."))] = None
        elif node not in literal and _RUNS_UNSEEN.fullmatch(_dotted(node, bound)):
            return None
    return tuple(found)


def _bound(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """The names that imports bind, with what they stand for."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.asname:
                    yield alias.asname, alias.name
        elif isinstance(node, ast.ImportFrom) and not node.level:
            for alias in node.names:
                yield alias.asname or alias.name, f"{node.module}.{alias.name}"


def _dotted(node: ast.AST, names: Mapping[str, str]) -> str:
    """A name with dots as it would be without aliases; empty for other expressions."""
    match node:
        case ast.Name(id=name):
            return names.get(name, name)
        case ast.Attribute(value=value, attr=attribute):
            return f"{_dotted(value, names)}.{attribute}"
    return ""


def _absolute(parts: Named) -> Iterator[Path]:
    try:
        spec = importlib.util.find_spec(parts[0])
    except ValueError:  # imported, but not by name
        file = module_file(sys.modules[parts[0]]) if parts[0] in sys.modules else None
        if file is None:
            raise
        yield file
        return
    if spec is None:  # not installed: an import that may fail
        return
    for place in spec.submodule_search_locations or ():
        yield from _files(Path(place).resolve().parent, parts)
    if spec.has_location and spec.origin:
        yield Path(spec.origin).resolve()


def _files(folder: Path, parts: Iterable[str]) -> Iterator[Path]:
    """The files of a module and of the packages around it, as far as there are any."""
    for part in parts:
        stems = (folder / part / "__init__", folder / part)
        for candidate in (f"{stem}{suffix}" for stem in stems for suffix in all_suffixes()):
            if os.path.isfile(candidate):  # far sooner than Path's, and asked of all names
                yield Path(candidate).resolve()
        folder /= part
