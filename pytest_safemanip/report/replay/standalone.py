"""One recording's replay as a file of its own, which needs nothing else, nor a server."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

SCRIPTS = ("three.min.js", "replay.js")
"""In their order."""
_PARTS = {"replay.js": ("reading.js", "colours.js", "solids.js", "panel.js", "replay.js")}
STYLE = "replay.css"
_START = """\
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const element = document.getElementById("replay");
  window.replay = SafemanipReplay.mount(element, data, {wheel: true});
})();
"""
_WHOLE = "html, body { margin: 0; height: 100%; } #replay { height: 100vh; height: 100dvh; }\n"


def browser_file(name: str) -> str:
    """The text of a script or style: ``three.min.js``, ``replay.js`` or ``replay.css``."""
    folder = resources.files("pytest_safemanip.report.replay") / "browser"
    parts = _PARTS.get(name, (name,))
    return "\n".join((folder / part).read_text(encoding="utf-8") for part in parts)


def script_json(data: Any) -> str:
    """JSON that can stand in a script element: nothing in it ends the element, or opens another."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def page(data: Mapping[str, Any]) -> str:
    """The HTML of a replay.

    It may run its own scripts, by their digests, and nothing else; it asks for nothing.

    Args:
        data: what :func:`~pytest_safemanip.report.replay.packing.pack` gives.
    """
    scripts = [*map(browser_file, SCRIPTS), _START]
    style = browser_file(STYLE) + _WHOLE
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, scripts))}; "
        f"style-src {_digest(style)}; img-src data:; base-uri 'none'; form-action 'none'"
    )
    title = f"{data['task']}, {data['policy']}, seed {data['seed']}: replay"
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        '<link rel="icon" href="data:,">',
        f"<title>{html.escape(title)}</title><style>{style}</style></head><body>",
        '<div id="replay"></div>',
        "<noscript>The replay needs JavaScript.</noscript>",
        f'<script id="replay-data" type="application/json">{script_json(data)}</script>',
        *(f"<script>{script}</script>" for script in scripts),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _digest(text: str) -> str:
    """A source of a content security policy: the digest of an element's content."""
    found = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
    return f"'sha256-{found}'"
