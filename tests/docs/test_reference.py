"""Pages that are printed from code are current, and what pages name exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from pytest_safemanip.metrics.gates import load_gates, parse_gate
from pytest_safemanip.plugin.options import OPTIONS
from tests.docs.blocks import parse
from tests.docs.reference import PAGES, REGIONS

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "pytest_safemanip"
TEXTS = {
    path.relative_to(ROOT).as_posix(): path.read_text()
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")]
}


@pytest.mark.parametrize("page", PAGES)
def test_the_page_says_what_the_code_says(page: str, update: bool) -> None:
    if update:
        (ROOT / page).write_text(PAGES[page]())
    assert (ROOT / page).read_text() == PAGES[page](), "pytest tests/docs --update-docs writes it"


@pytest.mark.parametrize(("page", "name"), REGIONS)
def test_the_part_of_the_page_says_what_the_code_says(page: str, name: str, update: bool) -> None:
    before, begin, rest = (ROOT / page).read_text().partition(f"<!-- {name} -->\n")
    shown, end, after = rest.partition("<!-- end -->")
    printed = REGIONS[page, name]() + "\n"
    if update:
        (ROOT / page).write_text(before + begin + printed + end + after)
    assert update or shown == printed, "pytest tests/docs --update-docs writes it"


def test_every_option_that_a_page_names_exists() -> None:
    flags = {option.flag for option in OPTIONS}
    for page, text in TEXTS.items():
        assert set(re.findall(r"(--safemanip-[a-z-]+)", text)) <= flags, page


def test_every_file_that_a_developers_page_names_exists() -> None:
    for page in ("docs/architecture.md", "CONTRIBUTING.md"):
        named = re.findall(r"`([\w./]+(?:\.py|\.yaml|/))`", TEXTS[page])
        assert len(named) > 10
        # The folder of a run is the reader's.
        missing = [n for n in named if not n.startswith(".safemanip/") and not _is_there(n)]
        assert missing == [], page


def _is_there(name: str) -> bool:
    """Whether a path is one of the repository or of the package; a mere name, of any folder."""
    if "/" not in name.rstrip("/"):
        return any(PACKAGE.rglob(name.rstrip("/"))) or (ROOT / name).exists()
    return any((base / name).exists() for base in (ROOT, PACKAGE))


def test_the_properties_of_junit_are_all_named() -> None:
    code = (PACKAGE / "report" / "junit.py").read_text()
    names = set(re.findall(r'"safemanip(\.\w+)"', code))
    assert len(names) > 20
    shown = set(re.findall(r"`(?:safemanip)?(\.\w+)`", TEXTS["docs/ci.md"]))
    assert names <= shown


def test_the_gates_in_pages_are_gates(tmp_path: Path) -> None:
    for page, text in TEXTS.items():
        for gate in re.findall(r"--safemanip-gate='([^']*)'", text):
            parse_gate(gate)
        for block in parse(text):
            if block.path == "gates.yaml":
                (tmp_path / "gates.yaml").write_text(block.code)
                found = load_gates(tmp_path / "gates.yaml")
                assert [gate.required for gate in found.gates] == [True, False], page


def test_the_yaml_of_pages_is_yaml() -> None:
    blocks = {(page, b.path): b for page in TEXTS for b in parse(TEXTS[page])}
    read = {
        place: yaml.safe_load(block.code)
        for place, block in blocks.items()
        if block.language == "yaml"
    }
    for place, content in read.items():
        assert isinstance(content, dict), place
    assert read["docs/clusters.md", "raycluster.yaml"]["kind"] == "RayCluster"
    assert read["docs/gate-pi05.md", ".gitlab-ci.yml"]["gate-pi05"]["script"]
    for workflow in (c for (_, path), c in read.items() if str(path).startswith(".github/")):
        for job in workflow["jobs"].values():
            assert all(("uses" in step) != ("run" in step) for step in job["steps"])
            assert job["runs-on"]
            assert "pytest " in str(job) or "safemanip report " in str(job)


def test_no_page_offers_to_install_from_an_index_what_is_on_none() -> None:
    sources = {path.name: path.read_text() for path in PACKAGE.rglob("*.py")}
    for place, text in {**TEXTS, **sources}.items():
        assert not re.search(r"pip install '?pytest-safemanip", text), place
