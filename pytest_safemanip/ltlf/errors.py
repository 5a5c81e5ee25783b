"""Errors in a formula, with their position."""

from __future__ import annotations

from pytest_safemanip.errors import ConfigError


class FormulaError(ConfigError):
    """A formula cannot be read, or compiling it would exceed a stated limit.

    Attributes:
        column: where in the text, counted from 1; None if the formula as a whole is meant.
    """

    def __init__(self, message: str, column: int | None = None) -> None:
        super().__init__(message)
        self.column = column
