"""Reading dictionaries out of Python source without running it."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError


def dictionaries(
    sources: Mapping[Path, str], names: Collection[str], ignored: Collection[str] = ()
) -> dict[str, dict[str, Any]]:
    """The module-level dictionaries of these names.

    Args:
        sources: text of each file.
        names: of the variables.
        ignored: keywords of ``dict(...)`` whose values are not wanted and may be computed.

    Raises:
        ConfigError: if a dictionary is not written as a literal.
    """
    found = {}
    for path, text in sources.items():
        if not any(f"\n{name} = " in text for name in names):
            continue
        for statement in ast.parse(text).body:
            if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
                name = statement.targets[0].id
                if name in names:
                    found[name] = _literal(statement.value, path, ignored)
    return found


def _literal(node: ast.expr, path: Path, ignored: Collection[str]) -> Any:
    """The value of a literal; ``dict(a=1)`` and ``os.path.join(ROOT, "b")`` count as such."""

    def read(inner: ast.expr) -> Any:
        return _literal(inner, path, ignored)

    match node:
        case ast.Constant():
            return node.value
        case ast.Tuple() | ast.List():
            return [read(element) for element in node.elts]
        case ast.Dict() if None not in node.keys:
            keys = [read(key) for key in node.keys if key is not None]
            return dict(zip(keys, map(read, node.values), strict=True))
        case ast.UnaryOp(op=ast.USub()):
            return -read(node.operand)
        case ast.Call(func=ast.Name(id="dict"), args=[]):
            return {w.arg: read(w.value) for w in node.keywords if w.arg not in ignored}
        case ast.Call(func=ast.Attribute(attr="join")):
            # Everything is below the folder of objects, which is the first argument.
            return "/".join(map(read, node.args[1:]))
        case _:
            raise ConfigError(
                f"{path}:{node.lineno}: cannot read {ast.unparse(node)!r} without running it"
            )
