"""Few values that alone keep a trace in allowed states, on automata small enough to draw.

Atom ``a`` is bit 0 of a letter, ``b`` bit 1; a set of states has bit s for state s.
"""

from __future__ import annotations

import pytest

from pytest_safemanip.ltlf import StateClass, compile_formula, witness
from pytest_safemanip.ltlf.witness import Search, image

NEVER = compile_formula("G !(a & b)")
ONCE = compile_formula("F a", atoms=("a", "b"))
HOLDS = compile_formula("a W b")
ANSWERS = compile_formula("G (a -> F b)")


def states(dfa, *classes):
    """The set of states of some classes."""
    return sum(1 << s for s, found in enumerate(dfa.classes) if found in classes)


def everything(dfa):
    return (1 << len(dfa)) - 1


def bad(dfa):
    return states(dfa, StateClass.FALSE)


def decided(dfa, letters, last=None, allowed=None):
    """Atoms fixed by the smallest and by the greedy search; the last step decides unless told."""
    goals = allowed or [everything(dfa)] * (len(letters) - 1) + [bad(dfa) if last is None else last]
    search = Search(dfa, letters, goals)
    return search.smallest(), search.greedy()


@pytest.mark.parametrize(
    ("letter", "fixed", "reached"),
    [
        (0b11, 0b11, {"bad"}),  # both are known to hold
        (0b11, 0b01, {"start", "bad"}),  # b may hold or not
        (0b11, 0b00, {"start", "bad"}),
        (0b01, 0b10, {"start"}),  # b is known not to hold: whatever a is
        (0b01, 0b01, {"start", "bad"}),
        (0b00, 0b01, {"start"}),
    ],
)
def test_what_is_not_fixed_may_be_anything(letter, fixed, reached):
    names = {"start": 1, "bad": bad(NEVER)}
    assert image(NEVER, 1, letter, fixed) == sum(names[name] for name in reached)


def test_from_several_states_all_that_any_of_them_reaches():
    # From the bad state there is no way out.
    assert image(NEVER, 1 | bad(NEVER), 0b00, 0b11) == 1 | bad(NEVER)
    assert image(NEVER, bad(NEVER), 0b00, 0b11) == bad(NEVER)
    assert image(NEVER, 0, 0b11, 0b11) == 0


def test_both_values_of_a_bad_step_decide_and_none_of_the_steps_before():
    assert decided(NEVER, [0b00, 0b01, 0b11]) == ([0, 0, 0b11],) * 2


def test_a_bad_step_decides_for_all_later_ones():
    assert decided(NEVER, [0b11, 0b00]) == ([0b11, 0],) * 2


def test_of_two_bad_steps_one_will_do():
    smallest, greedy = decided(NEVER, [0b11, 0b11])
    assert sorted(smallest) == [0, 0b11]
    assert greedy == [0, 0b11]  # late values are kept


def test_what_never_happened_is_fixed_at_every_step():
    rejecting = everything(ONCE) & ~states(ONCE, StateClass.TRUE, StateClass.CURRENTLY_TRUE)
    assert decided(ONCE, [0b00, 0b10, 0b00], rejecting) == ([0b01] * 3,) * 2


def test_an_obligation_ends_where_one_of_its_values_is_false():
    # `a W b` with a at two steps and neither at the third: b has to be absent throughout.
    assert decided(HOLDS, [0b01, 0b01, 0b00]) == ([0b10, 0b10, 0b11],) * 2


def test_one_value_at_the_first_step_can_spare_several_later():
    # `a -> F b`: that a held at step 1 opens what b never closes.
    rejecting = states(ANSWERS, StateClass.CURRENTLY_FALSE)
    assert decided(ANSWERS, [0b00, 0b01, 0b00, 0b00], rejecting)[0] == [0, 0b11, 0b10, 0b10]
    # Later ones of the same kind are cheaper: only the last has to be kept.
    assert decided(ANSWERS, [0b01, 0b01, 0b01], rejecting)[0] == [0, 0, 0b11]


def test_every_step_may_have_its_own_goal():
    # After each of the last two steps the obligation has to be open.
    owed = states(ANSWERS, StateClass.CURRENTLY_FALSE)
    allowed = [everything(ANSWERS), owed, owed]
    assert decided(ANSWERS, [0b01, 0b00, 0b01], allowed=allowed) == ([0b11, 0b10, 0b10],) * 2
    allowed = [everything(ANSWERS)] * 2 + [owed]
    assert decided(ANSWERS, [0b01, 0b00, 0b01], allowed=allowed)[0] == [0, 0, 0b11]


def test_a_long_trace_of_one_letter_costs_the_same_at_every_step():
    rejecting = states(ANSWERS, StateClass.CURRENTLY_FALSE)
    letters = [0b00] * 40 + [0b01] + [0b00] * 60
    wanted = [0] * 40 + [0b11] + [0b10] * 60
    assert decided(ANSWERS, letters, rejecting) == (wanted, wanted)


def test_a_long_trace_of_one_letter_is_not_much_to_try(monkeypatch):
    monkeypatch.setattr(witness, "_MAX_WORK", 1000)
    guarded = compile_formula("G (g -> (s W r))")
    smallest, _ = decided(guarded, [0b000] + [0b001] * 600)
    assert sorted(smallest) == [0] * 600 + [0b111]


def test_alike_steps_may_matter_differently():
    # Never a three times in a row, and not at the last of five steps: without it at the third and
    # the last, whatever is at the others.
    thrice = compile_formula("F (a & X a & X X a)", atoms=("a", "b"))
    smallest, _ = decided(thrice, [0b00] * 5, last=1)
    assert smallest == [0, 0, 0b01, 0, 0b01]


def test_with_too_many_atoms_or_too_much_to_try_there_is_no_smallest(monkeypatch):
    seven = compile_formula("G !(a & b)", atoms=tuple("abcdefg"))
    assert Search(seven, [0b11], [bad(seven)]).smallest() is None
    assert Search(seven, [0b11], [bad(seven)]).greedy() == [0b11]
    six = compile_formula("G !(a & b)", atoms=tuple("abcdef"))
    assert Search(six, [0b11], [bad(six)]).smallest() == [0b11]
    # Sixty-four ways to fix six atoms and one set of states: sixty-five.
    monkeypatch.setattr(witness, "_MAX_WORK", 65)
    search = Search(six, [0b11], [bad(six)])
    work = 64 + len({image(six, 1, 0b11, fixed) for fixed in range(64)} - {0b11}) ** 2
    assert work == 65
    assert search.smallest() == [0b11]
    monkeypatch.setattr(witness, "_MAX_WORK", 64)
    assert search.smallest() is None
