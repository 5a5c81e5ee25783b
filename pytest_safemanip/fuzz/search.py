"""Looks for a recording on which a proposition breaks a law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import JudgementError
from pytest_safemanip.fuzz.laws import Law
from pytest_safemanip.fuzz.recordings import recordings
from pytest_safemanip.fuzz.trial import Trial
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.trace.recording import Recording

_RECORDINGS, _DATA = recordings(), st.data()


@dataclass(frozen=True)
class Counterexample:
    """The smallest recording that was found.

    Attributes:
        error: LawBroken, or what the proposition raised.
        recording: on which it does.
    """

    error: Exception
    recording: Recording


def find_counterexample(
    proposition: Proposition,
    law: Law,
    catalogue: Catalogue,
    parameters: Mapping[str, float],
    examples: int | None = None,
) -> Counterexample | None:
    """Try a law on generated recordings.

    Args:
        proposition: what is tried.
        law: what it has to obey.
        catalogue: all propositions.
        parameters: values of all parameters.
        examples: recordings to try; None for what Hypothesis's profile says.

    Returns:
        A counterexample, or None if none was found.
    """
    failed: list[Counterexample] = []

    def test(recording: Recording, data: st.DataObject) -> None:
        try:
            law.check(Trial(proposition, recording, catalogue, parameters), data.draw)
        except Exception as error:  # a proposition may raise anything
            cause = error.__cause__ if isinstance(error, JudgementError) else None
            raised = cause if isinstance(cause, Exception) else error
            failed.append(Counterexample(raised, getattr(error, "recording", None) or recording))
            raise

    # Hypothesis keeps the failures of a test under a key that its name is part of.
    test.__name__ = test.__qualname__ = f"{proposition.name}_{law.name}"
    chosen = settings() if examples is None else settings(max_examples=examples)
    quiet = settings(
        chosen,
        deadline=None,
        print_blob=False,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    try:
        quiet(given(_RECORDINGS, _DATA)(test))()
    except Exception:  # what the law raised, or Hypothesis's word on it
        if not failed:
            raise
    return failed[-1] if failed else None
