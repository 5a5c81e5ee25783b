"""Robustness of a formula: by how much a finite trace of margins satisfies it, or violates it.

Space robustness (Fainekos and Pappas 2009; Donzé and Maler 2010) over finite traces: a conjunction
has the least margin of its parts, a disjunction the greatest, a negation the other sign, and a
temporal operator those of the steps that it speaks about. What no margin decides is infinite, as an
eventuality after the last step is. The sign is that of acceptance: a positive robustness is that of
a trace which the automaton accepts, a negative one that of a trace which it does not, and 0 may be
either.
"""

from __future__ import annotations

from pytest_safemanip.ltlf.robustness.offline import robustness
from pytest_safemanip.ltlf.robustness.online import OnlineRobustness
from pytest_safemanip.ltlf.robustness.single import step_robustness

__all__ = ["OnlineRobustness", "robustness", "step_robustness"]
