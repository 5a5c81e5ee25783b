"""What Hypothesis loads when it is imported: ``st.from_type(Recording)`` and the like work.

Hypothesis is imported at the end of every pytest run that it is installed for, whether or not any
test uses it; so the strategies themselves, beside which this would belong, are imported when asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy


def register() -> None:
    """Say which strategies make the types of this package; each is built when it is asked for."""
    from hypothesis import strategies as st

    from pytest_safemanip.ltlf.formula import Formula
    from pytest_safemanip.trace.recording import Recording
    from pytest_safemanip.trace.scene import Scene

    st.register_type_strategy(Formula, _formulas)
    st.register_type_strategy(Recording, _recordings)
    st.register_type_strategy(Scene, _scenes)


def _formulas(_: type) -> SearchStrategy[Any]:
    from pytest_safemanip.fuzz import formulas

    return formulas()


def _recordings(_: type) -> SearchStrategy[Any]:
    from pytest_safemanip.fuzz import recordings

    return recordings()


def _scenes(_: type) -> SearchStrategy[Any]:
    from pytest_safemanip.fuzz import scenes

    return scenes()
