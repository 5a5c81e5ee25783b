from __future__ import annotations

import functools

import pytest
from hypothesis import given, settings

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import (
    Atom,
    FormulaError,
    Next,
    Not,
    Or,
    WeakNext,
    compile_formula,
    parse,
)


@settings(max_examples=500, deadline=None)
@given(formulas(4))
def test_printing_and_parsing_give_the_same_tree(formula):
    assert parse(str(formula)) == formula


@pytest.mark.parametrize(
    ("text", "grouped"),
    [
        ("!a & b", "(!a) & b"),
        ("a & b | c & d", "(a & b) | (c & d)"),
        ("a | b -> c | d", "(a | b) -> (c | d)"),
        ("a -> b <-> c -> d", "(a -> b) <-> (c -> d)"),
        ("a U b & c R d", "(a U b) & (c R d)"),
        ("G a U b", "(G a) U b"),
        ("X a W F b", "(X a) W (F b)"),
        ("a -> b -> c", "a -> (b -> c)"),
        ("a U b U c", "a U (b U c)"),
        ("a U b R c W d", "a U (b R (c W d))"),
        ("a & b & c", "(a & b) & c"),
        ("a <-> b <-> c", "(a <-> b) <-> c"),
        ("G(a->F b)", "G (a -> (F b))"),
        ("WX X a", "WX (X a)"),
        ("!!a", "!(!a)"),
    ],
)
def test_binding(text, grouped):
    assert parse(text) == parse(grouped)


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("((a & (b)))", "a & b"),
        ("a & (b & c)", "a & (b & c)"),
        ("(a -> b) -> c", "(a -> b) -> c"),
        ("G ((a) -> (F (b)))", "G (a -> F b)"),
        ("!(a | b)", "!(a | b)"),
        ("X (WX (G a))", "X WX G a"),
        ("(a U b) U c", "(a U b) U c"),
        ("(!a) U (b & c)", "!a U (b & c)"),
    ],
)
def test_as_few_parentheses_as_the_grammar_allows(text, printed):
    assert str(parse(text)) == printed


@pytest.mark.parametrize(
    "name", ["last_contact", "lastly", "true_x", "trueish", "false_", "_a", "a1", "x", "u", "wx"]
)
def test_words_that_only_begin_like_a_keyword_are_atoms(name):
    assert parse(name) == Atom(name)


def test_next_is_strong_or_weak():
    assert parse("X a") == Next(Atom("a"))
    assert parse("WX a") == WeakNext(Atom("a"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "column 1: expected a formula, found the end of the formula"),
        ("a & )", "column 5: expected a formula after '&', found ')'"),
        ("a &", "column 4: expected a formula after '&', found the end of the formula"),
        ("a b", "column 3: expected an operator or the end after 'a', found 'b'"),
        ("(a & b", "column 7: expected ')' for the '(' at column 1, found the end of the formula"),
        ("a)", "column 2: expected an operator or the end after 'a', found ')'"),
        ("U a", "column 1: expected a formula, found 'U'; an operator needs a formula on both"),
        ("Ga", "column 1: expected a formula, found 'Ga'; an operator ends at a space: 'G a'"),
        ("G WXa", "an operator ends at a space: 'WX a'"),
        ("Settled", "found 'Settled'; atoms are written in lower case"),
        ("\n&", "column 1: expected a formula, found '&'"),
        ("a &\n  &", "line 2, column 3: expected a formula after '&', found '&'"),
        ("a && b", "column 4: expected a formula after '&', found '&'"),
        ("a # b", "column 3: unknown character '#'"),
        ("1a", "column 1: expected a formula, found '1a'"),
        ("G (a ->\n  F )", "line 2, column 5: expected a formula after 'F', found ')'"),
    ],
)
def test_an_error_says_where_and_what_was_expected(text, message):
    with pytest.raises(FormulaError) as caught:
        parse(text)
    assert message in str(caught.value)


def test_an_error_knows_its_column_and_is_a_config_error():
    with pytest.raises(ConfigError) as caught:
        parse("a & )")
    assert caught.value.column == 5


@pytest.mark.parametrize(
    "text",
    [
        "(" * 5000 + "a" + ")" * 4999,
        "!" * 101 + "a",
        "X " * 3000 + "a",
        "a" + " -> a" * 1900,
        "a" + " | a" * 150,
    ],
)
def test_deep_nesting_is_refused_before_it_exhausts_the_stack(text):
    with pytest.raises(FormulaError, match="nested"):
        parse(text)


def test_a_long_text_is_refused():
    with pytest.raises(FormulaError, match="at most 10000"):
        parse("a" * 10_001)


def test_a_deep_tree_built_by_hand_is_refused():
    deep = functools.reduce(Or, [Atom("a")] * 5000)
    with pytest.raises(FormulaError, match="nested more than 100"):
        compile_formula(deep)


def test_a_tree_of_a_hundred_operators_is_none_too_deep():
    assert len(compile_formula(functools.reduce(lambda f, _: Not(f), range(99), Atom("a")))) > 1
    with pytest.raises(FormulaError, match="nested more than 100"):
        compile_formula(functools.reduce(lambda f, _: Not(f), range(100), Atom("a")))


@pytest.mark.parametrize("name", ["Settled", "a b", "", "last", "true", "a-b", "1a"])
def test_an_atom_built_by_hand_obeys_the_grammar(name):
    with pytest.raises(FormulaError, match="cannot name an atom"):
        Atom(name)


def test_how_long_a_formula_is_does_not_matter_to_how_deep_it_is():
    # Nine groups of fifty: no more than fifty-nine operators inside each other.
    group = f"({' & '.join(['!a'] * 50)})"
    assert str(parse(" | ".join([group] * 9))).count("!a") == 450
