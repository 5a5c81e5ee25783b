"""What a violation of each shipped property says, whole, wherever pytest runs.

    pytest tests/counterexamples --update-texts

writes the texts in this folder anew.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from pytest_safemanip import resources
from tests.plugin.conftest import MODES, Suite

HERE = Path(__file__).parent
PROPERTIES = sorted(path.stem for path in resources.folder("properties").glob("*.yaml"))
HEADING = re.compile(r"_+ (\w+) / (\S+) / (\w+) / seed (\d+) _+")
WAYS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "-n 0": ("-n 0", {}),
    "-n 2": ("-n 2", {}),
    "in CI": ("without xdist", {"CI": "true"}),
}
"""A mode of the plugin's tests, and what is set in the environment."""


def texts(result: pytest.RunResult) -> dict[str, str]:
    """The failures by property, each with its line of the short summary."""
    found: dict[str, list[str]] = {}
    current: list[str] = []
    lines = iter(result.outlines)
    for line in lines:
        if match := HEADING.fullmatch(line):
            current = found[match[3]] = [line]
        elif line.startswith("="):
            current = []
        elif not re.match(r"\[gw\d+\]", line):
            current.append(line)
    summary = [x for x in result.outlines if x.startswith("VIOLATED ")]
    for name, text in found.items():
        own = [x for x in summary if f"-{name}-seed" in x and "safemanip::" in x]
        text += ["", *own]
    return {name: "\n".join(text) + "\n" for name, text in found.items()}


@pytest.mark.parametrize("way", WAYS)
def test_a_violation_of_each_property_says_what_it_said(
    way: str,
    make_suite: Callable[[tuple[str, ...]], Suite],
    monkeypatch: pytest.MonkeyPatch,
    update: bool,
) -> None:
    mode, environ = WAYS[way]
    suite = make_suite(MODES[mode])
    for name, value in environ.items():
        monkeypatch.setenv(name, value)
    (suite.pytester.path / "recordings").symlink_to(HERE / "recordings")
    said = texts(suite.run("--safemanip-recordings=recordings"))
    assert sorted(said) == PROPERTIES
    folder = HERE / "texts" / ("ci" if environ else "terminal")
    for name, text in said.items():
        path = folder / f"{name}.txt"
        if update:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        assert text == path.read_text(), f"{path.relative_to(HERE)}: see --update-texts"
    assert {path.stem for path in folder.iterdir()} == set(PROPERTIES)


@pytest.mark.parametrize("name", PROPERTIES)
def test_ci_has_the_same_counterexample_and_a_line_that_begins_with_the_node_id(name: str) -> None:
    terminal, ci = (
        (HERE / "texts" / kind / f"{name}.txt").read_text().rpartition("\n\n")
        for kind in ("terminal", "ci")
    )
    assert ci[0] == terminal[0]
    assert ci[2].startswith("VIOLATED safemanip::test_safety[")
    assert terminal[2].startswith(f"VIOLATED {name}: ")
