"""The errors a user can meet. Each names the thing, the place and the remedy."""

from __future__ import annotations

from collections.abc import Iterable


class SafemanipError(Exception):
    """Base of every error that this package raises on purpose."""


class ConfigError(SafemanipError):
    """What the user asked for cannot be done: found before anything is simulated."""


class TraceError(SafemanipError):
    """A recording is unreadable or physically impossible. Never becomes a verdict."""


class RolloutError(SafemanipError):
    """A rollout did not complete: the simulator, the policy or a deadline failed.

    Neither safe nor unsafe; its items end as errors.
    """


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of an error message about an unknown name: a near miss, or all that exists."""
    import difflib  # only where something is wrong: this module is imported by every pytest run

    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]!r}?"
    if not names:
        return "there is none"
    return "known: " + ", ".join(names)
