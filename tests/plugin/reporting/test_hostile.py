"""Names that somebody chose to do harm: nowhere do they become more than text."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import CONFTEST, PROPERTY, set_up

NAME = "<script>alert('x')</script> \"q\" ]]> | `c` [a](https://e.x) ::error::no %0A {0}"
WORLD = """
import dataclasses
from tests.toy import SCENE

NAME = {name!r}

class Named(World):
    def reset(self, request):
        start = super().reset(request)
        return dataclasses.replace(start, scene=renamed(SCENE))

def renamed(found):
    if found == "mug":
        return NAME
    if isinstance(found, (tuple, list)):
        return type(found)(map(renamed, found))
    if isinstance(found, dict):
        return {{key: renamed(value) for key, value in found.items()}}
    if not dataclasses.is_dataclass(found):
        return found
    values = {{f.name: getattr(found, f.name) for f in dataclasses.fields(found)}}
    kept = {{"category": found.category}} if hasattr(found, "category") else {{}}
    return dataclasses.replace(found, **{{**{{k: renamed(v) for k, v in values.items()}}, **kept}})

def pytest_safemanip_backends():
    return {{"toy": simulator(lambda options: Named(succeeds_at=None))}}
"""
TITLE = 'title: "A title <b> ::error::forged %0A"\n'


@pytest.fixture
def hostile(suite: Suite, monkeypatch: pytest.MonkeyPatch) -> Suite:
    set_up(suite)
    folder = suite.pytester.path
    suite.pytester.makeconftest(CONFTEST + WORLD.format(name=NAME))
    text = re.sub("title: .*\n", lambda _: TITLE, PROPERTY)
    (folder / "mine" / "properties" / "own.yaml").write_text(text)
    monkeypatch.setenv("CI", "true")
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(folder / "step.md"))
    return suite


def test_they_are_text_in_all_outputs(hostile: Suite) -> None:
    result = hostile.run("--junitxml=all.xml", "--safemanip-report=markdown,sarif", "-rA")
    folder = hostile.pytester.path
    said = result.stdout.str()
    assert f"VIOLATED for {NAME} (mug) at step 5" in said
    assert "A title <b> ::error::forged %0A" in said
    steps = (folder / "step.md").read_text()
    texts = [said, steps, *(path.read_text() for path in files(hostile.out))]
    for text in [*texts, (folder / "all.xml").read_text()]:
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u202a-\u202e]", text)
    commands = [line for line in result.outlines if line.startswith("::")]
    assert len(commands) == 1
    assert commands[0].startswith("::error file=mine/properties/own.yaml,line=1,title=stays_near")
    failure = ET.parse(folder / "all.xml").find(".//failure")
    assert failure is not None
    assert NAME in (failure.text or "")
    assert "<script>" not in steps


def files(out: Path) -> list[Path]:
    found = [out / "summary.md", out / "summary.sarif", out / "summary.json"]
    return [*found, *(out / "timelines").glob("*.svg")]


SHOUTS = """
class Shouts:
    def act(self, observation):
        raise ValueError("\\x1b[31mred\\x1b[0m \\u202eleft \\x9b2J")

def pytest_safemanip_policies():
    return {"shouts": Shouts}
"""


def test_what_a_policy_raises_is_text_too(hostile: Suite) -> None:
    with (hostile.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(SHOUTS)
    reports = "--safemanip-report=markdown,sarif"
    result = hostile.run("--safemanip-policy=shouts", "--junitxml=all.xml", reports, "-rA")
    said = result.stdout.str()
    assert r"ValueError: \x1b[31mred\x1b[0m \u202eleft \x9b2J" in said
    texts = [said, (hostile.pytester.path / "all.xml").read_text()]
    texts += [path.read_text() for path in files(hostile.out)]
    for text in texts:
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e]", text)


@pytest.mark.parametrize("name", ["two\nlines", "\x1b[2J", "\u202eleft", "\x85"])
def test_a_name_that_moves_the_cursor_is_refused_with_the_recording(
    one_suite: Suite, name: str
) -> None:
    set_up(one_suite)
    one_suite.pytester.makeconftest(CONFTEST + WORLD.format(name=name))
    result = one_suite.run()
    result.assert_outcomes(errors=2)
    said = result.stdout.str()
    assert "entities[3]: name must be a printable text" in said
    assert name not in said
    assert json.loads((one_suite.out / "summary.json").read_text())["rollouts"][0]["error"]
