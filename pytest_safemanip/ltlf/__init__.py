"""LTLf over finite traces: formulas, automata, running verdicts, explanations.

In five lines:

    from pytest_safemanip.ltlf import Monitor, compile_formula

    dfa = compile_formula("G (released -> F settled)")
    dfa.accepts([{"released": True, "settled": False}, {"released": False, "settled": True}])
    verdicts = Monitor(dfa, ["mug", "plate"], dt=0.05, deadline_s=5.0).run(values)

where `values` is bool[steps, instances, atoms]. Needs numpy and nothing else.
"""

from __future__ import annotations

from pytest_safemanip.ltlf.batch import Judgement
from pytest_safemanip.ltlf.compiler import Limits, compile_formula
from pytest_safemanip.ltlf.dfa import Dfa, StateClass, Step
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.excerpt import Excerpt, OmittedSteps, Row
from pytest_safemanip.ltlf.explain import Explanation, PathStep, explain
from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Last,
    Next,
    Not,
    Or,
    Release,
    Until,
    WeakNext,
    WeakUntil,
)
from pytest_safemanip.ltlf.monitor import Monitor
from pytest_safemanip.ltlf.parser import parse
from pytest_safemanip.ltlf.robustness import OnlineRobustness, robustness
from pytest_safemanip.ltlf.robustness.prediction import NOTHING, Prediction
from pytest_safemanip.ltlf.rules import DischargedBy, Profile
from pytest_safemanip.ltlf.verdicts import (
    InstanceVerdict,
    Outcome,
    PropertyOutcome,
    Reason,
    StepVerdict,
    Violation,
    worst,
)
from pytest_safemanip.ltlf.witness import DecidingValue

__all__ = [
    "NOTHING",
    "Always",
    "And",
    "Atom",
    "Constant",
    "DecidingValue",
    "Dfa",
    "DischargedBy",
    "Eventually",
    "Excerpt",
    "Explanation",
    "Formula",
    "FormulaError",
    "Iff",
    "Implies",
    "InstanceVerdict",
    "Judgement",
    "Last",
    "Limits",
    "Monitor",
    "Next",
    "Not",
    "OmittedSteps",
    "OnlineRobustness",
    "Or",
    "Outcome",
    "PathStep",
    "Prediction",
    "Profile",
    "PropertyOutcome",
    "Reason",
    "Release",
    "Row",
    "StateClass",
    "Step",
    "StepVerdict",
    "Until",
    "Violation",
    "WeakNext",
    "WeakUntil",
    "compile_formula",
    "explain",
    "parse",
    "robustness",
    "worst",
]
