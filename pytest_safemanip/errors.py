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


class PolicyServerError(RolloutError):
    """The server of a policy failed; names the endpoint, what happened and the remedy.

    Whatever of it: no failure of the policy at its task, and no verdict.
    """


class PolicyUnreachable(PolicyServerError):
    """No server that speaks the policy's protocol is at the endpoint.

    Nothing was asked of it; every further rollout would fail in the same way.
    """


class PolicyConnectionLost(PolicyServerError):
    """The connection broke or a deadline passed within an episode.

    The episode may be run again from its reset, with its seed; it must not go on, since nobody
    knows what the server made of the last request.
    """


class PolicyAnswerError(PolicyServerError):
    """The server answered, and the answer cannot be executed. Asking again does not help."""


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
