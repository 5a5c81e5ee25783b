"""``python -m pytest_safemanip`` is the command ``safemanip``."""

from __future__ import annotations

import sys

from pytest_safemanip.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
