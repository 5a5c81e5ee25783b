"""What pytest wants declared at the top level, and how the package's own tests are run."""

from __future__ import annotations

import pytest

pytest_plugins = ["pytester"]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let laws be tried at length: ``pytest tests --laws=500`` every night."""
    parser.addoption(
        "--laws", type=int, metavar="N", help="recordings that each law of propositions is tried on"
    )


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Run ``pytest tests`` on all cores; ``-n 0``, or naming a file, keeps it in one process.

    Not among the options of the ini file: a user of the suite need not have pytest-xdist.
    """
    whole = config.args in (["tests"], ["tests/"]) and not hasattr(config, "workerinput")
    chosen = config.option
    if whole and getattr(chosen, "numprocesses", 0) is None and chosen.dist == "no":
        chosen.numprocesses, chosen.dist = "auto", "worksteal"
