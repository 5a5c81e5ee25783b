"""The errors a user can meet. Each names the thing, the place and the remedy."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterable, Iterator

MOST_LISTED = 16
"""How many known names fit into a line."""
MOST_TOLD = 100_000
"""Characters of a message."""
NEAREST = 3
"""How many of more names are told: those that are least unlike."""


class SafemanipError(Exception):
    """Base of every error that this package raises on purpose.

    Attributes:
        infrastructure: whether a server or the simulator failed, and neither the policy nor what
            was asked for is to blame: the run says nothing, and may be run again.
    """

    infrastructure = False

    def __str__(self) -> str:
        """What went wrong; a stranger's file, server or code that is quoted moves no cursor."""
        return printable(super().__str__(), MOST_TOLD, lines=True)


class ConfigError(SafemanipError):
    """A request that cannot be fulfilled; raised before anything is simulated."""


class TraceError(SafemanipError):
    """A recording is unreadable or physically impossible. Never becomes a verdict."""


class DamagedRecording(TraceError):
    """A recording's file is not as it was written: no recording, cut off, or changed since."""

    remedy = "restore the file, or record the rollout again"


class RolloutError(SafemanipError):
    """A rollout did not complete: the simulator, the policy or a deadline failed.

    Neither safe nor unsafe; its items end as errors.

    Attributes:
        restarts: how often the episode was begun again before it was given up.
    """

    restarts = 0


class TaskError(RolloutError):
    """An episode cannot begin as its task's file asks: what it names is not there, or what it
    stages finds no place. The file is to blame, and the cases of this rollout are errors.
    """


class SimulatorFailed(RolloutError):
    """The simulator crashed, hung or raised."""

    infrastructure = True


class CannotStage(RolloutError):
    """The episode cannot begin as it was asked for: what was put somewhere does not stay there.

    Whoever asked is to blame, neither the policy nor the simulator.
    """


class WorkerDied(RolloutError):
    """The process that ran a rollout was killed or crashed; nobody is left to say why."""

    infrastructure = True


class JudgementError(SafemanipError):
    """A property has no verdict: the code of a proposition failed. Never becomes a verdict."""


class PolicyServerError(RolloutError):
    """The server of a policy failed; names the endpoint, what happened and the remedy.

    Whatever of it: no failure of the policy at its task, and no verdict.
    """


class PolicyUnreachable(PolicyServerError):
    """No server that speaks the policy's protocol is at the endpoint.

    Nothing was asked of it; every further rollout would fail in the same way.
    """

    infrastructure = True


class PolicyConnectionLost(PolicyServerError):
    """The connection broke or a deadline passed within an episode.

    The episode may be run again from its reset, with its seed; it must not go on, since nobody
    knows what the server made of the last request.
    """

    infrastructure = True


class PolicyAnswerError(PolicyServerError):
    """The server answered, and the answer cannot be executed. Asking again does not help."""


class PolicyMismatch(PolicyAnswerError):
    """The server answers, and its model does not fit the policy: every rollout would show it."""


def met_again(error: SafemanipError, text: str) -> RolloutError:
    """What a case raises that fails for the reason of another, in other words."""
    found = RolloutError(text)
    found.infrastructure = error.infrastructure
    return found


def ends_run(error: BaseException) -> bool:
    """Whether an exception of a user's code is meant to end the run: Ctrl-C and ``pytest.exit``.

    No other is, SystemExit and pytest's skips included: a policy does not decide on its outcome.
    """
    pytest = sys.modules.get("pytest")  # absent where a policy is served
    return isinstance(error, KeyboardInterrupt | GeneratorExit) or (
        pytest is not None and isinstance(error, pytest.exit.Exception)
    )


@contextlib.contextmanager
def raised_as(kind: type[SafemanipError], what: str) -> Iterator[None]:
    """Whatever a user's code raises inside becomes an error that says ``what`` failed; our own
    errors stay as they are, and so does what :func:`ends_run`.
    """
    try:
        yield
    except SafemanipError:
        raise
    except BaseException as error:  # SystemExit and pytest's skips too
        if ends_run(error):
            raise
        raise kind(f"{what}: {type(error).__name__}: {error}") from error


@contextlib.contextmanager
def judging(property_id: str) -> Iterator[None]:
    """Whatever a proposition raises inside becomes a :class:`JudgementError` that names the
    property; our own other errors stay as they are, and so does what :func:`ends_run`.
    """
    why = f"{property_id} cannot be judged"
    try:
        with raised_as(JudgementError, why):
            yield
    except JudgementError as error:
        if str(error).startswith(f"{why}: "):
            raise
        raise JudgementError(f"{why}: {error}") from error.__cause__


def first_line(error: BaseException) -> str:
    """The kind of an error and the first line of what it says."""
    return f"{type(error).__name__}: {error}".split("\n")[0]


def printable(text: str, most: int = 200, lines: bool = False) -> str:
    """Text of a stranger, for people: escapes instead of what moves a terminal's cursor, or turns
    the direction of reading.

    Args:
        text: from a server or a file.
        most: how many characters are kept; ``...`` stands for the others.
        lines: whether it may have several.
    """
    kept = "\n\t" if lines else ""
    shown = "".join(
        letter if letter.isprintable() or letter in kept else repr(letter)[1:-1]
        for letter in text[: most + 1]
    )
    return shown if len(text) <= most and len(shown) <= most else f"{shown[:most]}..."


def placed(place: object, error: object) -> str:
    """What an error says, with its place before it, once."""
    text = str(error)
    return text if text.startswith((f"{place}: ", f"{place}/")) else f"{place}: {text}"


def install_command(extra: str) -> str:
    """The command that installs the libraries of an extra."""
    return f"pip install '.[{extra}]' in a checkout of pytest-safemanip"


def _words(name: str) -> set[str]:
    """The words that a name consists of."""
    return {*re.split(r"[\W_]+", name.lower())} - {""}


def did_you_mean(name: str, known: Iterable[str], all_of_them: str = "") -> str:
    """The end of an error message about an unknown name: a near miss, or what exists.

    Args:
        name: what was given.
        known: what there is.
        all_of_them: the command that lists it, for more than fits into a line.
    """
    import difflib  # only where something is wrong: this module is imported by every pytest run

    names = sorted(known)
    words = _words(name)  # "hot" is meant by "hot_source", and not what has as many letters
    parts = [other for other in names if words <= _words(other) or _words(other) <= words]
    close = (
        difflib.get_close_matches(name, names, n=1, cutoff=0.8)
        or (parts if words and len(parts) == 1 else [])
        or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    )
    if close:
        return f"did you mean {close[0]!r}?"
    if not names:
        return "there is none"
    if len(names) <= MOST_LISTED:
        return "known: " + ", ".join(names)
    nearest = difflib.get_close_matches(name, names, n=NEAREST, cutoff=0.0)
    where = f"; {all_of_them!r} lists all" if all_of_them else ""
    return f"nearest of {len(names)}: {', '.join(nearest)}{where}"
