"""Rules that decide nothing: formulas that no trace or every trace satisfies, dead triggers."""

from __future__ import annotations

from pytest_safemanip.ltlf import Dfa, Formula, Next, StateClass
from pytest_safemanip.ltlf.formula import atoms_of, subformulas
from pytest_safemanip.ltlf.letters import truth_table

_ALWAYS = (
    "'{}' is always true: every rollout would pass; expected a formula that something can break"
)
_NEVER = "'{}' is never true: every rollout would violate it; expected one that can be kept"
_STRONG = "; 'X p' asks for a next step, which the last one has not: 'WX p' is true there"


def decided_fault(dfa: Dfa) -> str:
    """What is wrong with a formula that decides nothing, which its automaton shows; else empty.

    The start is in no trace, and is merged with a state that goes on alike: its class is final only
    where that of every state is.
    """
    start = dfa.classes[0]
    if start is StateClass.TRUE:
        return _ALWAYS.format(dfa.formula)
    if start is StateClass.FALSE:
        strong = any(isinstance(node, Next) for node in subformulas(dfa.formula))
        return _NEVER.format(dfa.formula) + (_STRONG if strong else "")
    return ""


def trigger_fault(trigger: Formula) -> str:
    """What is wrong with a trigger that holds at no step; empty if nothing is.

    Args:
        trigger: a formula without temporal operators, of few atoms.
    """
    if any(truth_table(trigger, atoms_of(trigger))):
        return ""
    return f"the trigger '{trigger}' never holds: the property would never be put to the test"
