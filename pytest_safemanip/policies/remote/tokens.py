"""API tokens of policy servers: from the environment, and never into anything that is kept."""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pytest_safemanip.errors import ConfigError, PolicyServerError, did_you_mean, printable

HIDDEN = "(token)"
TELLING = 3
"""Fewer characters of a token than these are not worth hiding."""
MOST_TEXT = 20_000
"""Characters of an error; a server's traceback has fewer."""
MOST_NAME = 500
"""Characters of a text in what a server says of itself."""


VARIABLE = "SAFEMANIP_TOKEN_"


def check_variables(policies: Iterable[str], environment: Mapping[str, str]) -> None:
    """Refuse a token that no policy would send.

    Raises:
        ConfigError: naming the variable and the near miss.
    """
    known = [variable_of(policy) for policy in policies]
    for variable in environment:
        if variable.startswith(VARIABLE) and variable not in known:
            hint = did_you_mean(variable, known)
            raise ConfigError(f"{variable}: a token of no policy on a server; {hint}")


def variable_of(policy: str) -> str:
    """The environment variable with the token of a policy's servers."""
    return f"{VARIABLE}{policy.upper().replace('-', '_')}"


@dataclass(frozen=True)
class Token:
    """A token that does not show when it is printed; an empty one is none.

    Attributes:
        text: what is sent.
    """

    text: str = field(default="", repr=False)

    def __bool__(self) -> bool:
        return bool(self.text)

    @classmethod
    def of(cls, policy: str, environment: Mapping[str, str] = os.environ) -> Token:
        """The token of a policy's servers.

        Raises:
            ConfigError: if it cannot be sent; does not show it.
        """
        text = environment.get(variable_of(policy), "").strip()
        if not text.isascii() or any(not "!" <= letter <= "~" for letter in text):
            raise ConfigError(
                f"{variable_of(policy)}: a token has printable ASCII characters and no spaces"
            )
        return cls(text)

    def without(self, value: Any) -> Any:
        """What a server said, or was told, with its token taken out wherever it echoes it."""
        if not self:
            return value
        if isinstance(value, str):
            return self._cut_out(value)
        if isinstance(value, bytes):
            return value.replace(self.text.encode(), HIDDEN.encode())
        if isinstance(value, Mapping):
            return {self.without(key): self.without(inner) for key, inner in value.items()}
        return (
            [self.without(inner) for inner in value] if isinstance(value, list | tuple) else value
        )

    def _cut_out(self, text: str) -> str:
        """Without the token, as it is, as a literal has it, and where a cut has left its start."""
        for form in dict.fromkeys((self.text, repr(self.text)[1:-1])):
            text = text.replace(form, HIDDEN)
            for size in range(len(form) - 1, TELLING - 1, -1):
                text = text.replace(f"{form[:size]}...", f"{HIDDEN}...")
        return text

    @contextlib.contextmanager
    def hidden(self) -> Iterator[None]:
        """Errors that are raised inside do not show it, nor do their causes, nor anything of what
        a server said that is not :func:`~pytest_safemanip.errors.printable`.
        """
        try:
            yield
        except PolicyServerError as error:
            shown = self._shown(error)
            if shown == str(error) and not self._is_in_causes(error):
                raise
            raise type(error)(shown) from None

    def _shown(self, error: BaseException) -> str:
        return printable(str(self.without(str(error))), MOST_TEXT, lines=True)

    def _is_in_causes(self, error: BaseException) -> bool:
        cause = error.__cause__
        return cause is not None and (self._shown(cause) != str(cause) or self._is_in_causes(cause))

    def told(self, value: Any) -> Any:
        """What a server says of itself, without its token, and printable: it is shown and kept as
        a fact. What is too long ends in a digest, so that it still differs from any other.
        """
        return _told(self.without(value))


def _told(value: Any) -> Any:
    if isinstance(value, str):
        shown = printable(value, MOST_NAME)
        if len(shown) <= MOST_NAME:
            return shown
        digest = hashlib.sha256(value.encode("utf-8", "surrogatepass")).hexdigest()
        return f"{shown} ({digest[:16]})"
    if isinstance(value, Mapping):
        return {_told(key): _told(inner) for key, inner in value.items()}
    return [_told(inner) for inner in value] if isinstance(value, list | tuple) else value


NO_TOKEN = Token()
