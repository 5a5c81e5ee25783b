"""Pages of the documentation, and the mode that writes them anew."""

from __future__ import annotations

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-docs",
        action="store_true",
        help="write the outputs that pages show, and the pages that are printed from code",
    )


@pytest.fixture
def update(pytestconfig: pytest.Config) -> bool:
    """Whether pages are written and not compared."""
    return bool(pytestconfig.getoption("--update-docs", default=False))
