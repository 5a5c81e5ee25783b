"""The mode that writes the texts anew."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import make_suite

__all__ = ["make_suite"]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-texts", action="store_true", help="write the texts of counterexamples anew"
    )


@pytest.fixture
def update(pytestconfig: pytest.Config) -> bool:
    """Whether texts are written and not compared."""
    return bool(pytestconfig.getoption("--update-texts", default=False))
