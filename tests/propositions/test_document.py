from __future__ import annotations

from pathlib import Path

from pytest_safemanip.propositions.__main__ import document


def test_the_page_is_what_the_catalogue_says():
    page = Path(__file__).parents[2] / "docs" / "propositions.md"
    assert page.read_text() == document(), "python -m pytest_safemanip.propositions > docs/..."
