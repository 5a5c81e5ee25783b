from __future__ import annotations

import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given, settings

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import compile_formula, mona, parse
from pytest_safemanip.ltlf.mona import difference, find_mona, mona_dfa

from .bruteforce import holds

needs_mona = pytest.mark.skipif(shutil.which("mona") is None, reason="MONA is not installed")


def program(folder, text):
    """A program called mona, first on the path."""
    path = folder / "mona"
    path.write_text(f"#!{sys.executable}\nimport sys, time\n{text}\n")
    path.chmod(0o755)
    return path


@needs_mona
@settings(max_examples=60, deadline=None)
@given(formulas(3))
def test_mona_builds_the_same_language(formula):
    assert difference(compile_formula(formula), mona_dfa(formula, find_mona())) is None


@needs_mona
@pytest.mark.parametrize(
    "text",
    [
        "G (last_contact -> F true_x)",
        "_a W falsehood",
        "a -> b -> c",
        "(a <-> b) <-> c",
        "G (a -> WX b)",
        "F (last & a)",
        "a U b R c",
        "a & !a",
        "true",
        "false",
        "last",
    ],
)
def test_names_and_operators_that_ltlf2dfa_reads_otherwise(text):
    formula = parse(text)
    assert difference(compile_formula(formula), mona_dfa(formula, find_mona())) is None


@needs_mona
def test_a_difference_is_shown_by_a_shortest_trace():
    ours, theirs = parse("G (a -> F b)"), parse("G (a -> X b)")
    trace = difference(compile_formula(ours), mona_dfa(theirs, find_mona()))
    letters = [step["a"] + 2 * step["b"] for step in trace]
    assert len(letters) == 1
    assert holds(ours, letters, ("a", "b")) != holds(theirs, letters, ("a", "b"))
    ours, theirs = parse("X X (a & b)"), parse("X X (a | b)")
    trace = difference(compile_formula(ours), mona_dfa(theirs, find_mona()))
    assert len(trace) == 3
    assert trace[2]["a"] != trace[2]["b"]


@needs_mona
def test_eight_runs_at_once_do_not_disturb_each_other():
    texts = [
        "G (a -> F b)",
        "a U b",
        "X a & b",
        "F (a & X b)",
        "G a | b",
        "a R b",
        "a W b",
        "a <-> b",
    ]
    formulas_ = [parse(text) for text in texts * 2]
    with ThreadPoolExecutor(8) as pool:
        automata = list(pool.map(lambda formula: mona_dfa(formula, find_mona()), formulas_))
    for formula, automaton in zip(formulas_, automata, strict=True):
        assert difference(compile_formula(formula), automaton) is None


def test_another_program_called_mona_is_told_apart(tmp_path, monkeypatch):
    program(tmp_path, "print('usage: mona [data]')")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigError, match="not the MONA of WS1S"):
        find_mona()


def test_a_missing_ltlf2dfa_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ltlf2dfa.base", None)
    with pytest.raises(ConfigError, match=r"pip install '\.\[verify\]'"):
        mona_dfa(parse("a"), Path("/nowhere/mona"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sys.exit('out of memory')", r"MONA failed on 'a' \(exit code 1\): out of memory"),
        ("print('nothing')", "MONA failed on 'a'"),
        ("time.sleep(60)", "did not finish"),
        ("print('DFA for formula with free variables: P0')", "output is not understood"),
        (
            "print('DFA for formula with free variables: P0\\nAccepting states: 1\\n"
            "State 0: X -> state 1\\nState 1: 1 -> state 1')",
            "output is not understood",
        ),
    ],
)
def test_a_run_that_goes_wrong_is_no_automaton(tmp_path, monkeypatch, text, message):
    pytest.importorskip("ltlf2dfa", reason="ltlf2dfa is not installed")
    monkeypatch.setattr(mona, "_TIMEOUT_S", 1)
    with pytest.raises(ConfigError, match=message):
        mona_dfa(parse("a"), program(tmp_path, text))


def test_a_program_that_cannot_be_run_is_an_error(tmp_path):
    pytest.importorskip("ltlf2dfa", reason="ltlf2dfa is not installed")
    with pytest.raises(ConfigError, match="cannot be run"):
        mona_dfa(parse("a"), tmp_path / "mona")
