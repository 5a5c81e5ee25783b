from __future__ import annotations

import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given, settings

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import Not, compile_formula, mona, parse
from pytest_safemanip.ltlf import __main__ as command
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


@needs_mona
def test_verify_accepts_all_shipped_properties(capsys):
    assert command.main(["verify"]) == 0
    out = capsys.readouterr().out
    assert out.count(" equal\n") == 20
    assert "20 automata compared with" in out


@needs_mona
def test_verify_fails_with_a_trace_when_an_automaton_is_wrong(capsys, monkeypatch):
    monkeypatch.setattr(command, "compile_formula", lambda f: compile_formula(Not(f)))
    assert command.main(["verify"]) == 1
    out = capsys.readouterr().out
    assert out.count("DIFFERENT\n") == 20
    assert "G (obj_released -> F settled)\n  one accepts and one rejects:\n    step 0: " in out
    assert "20 different" in out


@needs_mona
def test_verify_reads_the_users_folder(tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(
        "id: mine\ncategory: own\ntitle: Mine\nsource: me\n"
        "formula: G !bump\natoms: {bump: collision}\n"
    )
    assert command.main(["verify", "--properties", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "\nmine      timed         2       2  equal\n" in out
    assert "2 automata compared" in out


def test_a_folder_that_is_missing_or_empty_is_an_error(tmp_path, capsys):
    assert command.main(["verify", "--properties", str(tmp_path / "nowhere")]) == 2
    assert "no such folder" in capsys.readouterr().err
    assert command.main(["verify", "--properties", str(tmp_path)]) == 2
    assert "no properties in" in capsys.readouterr().err


def test_a_missing_mona_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert command.main(["verify"]) == 2
    assert (
        "MONA is missing; install it, for example: apt-get install mona" in capsys.readouterr().err
    )


def test_another_program_called_mona_is_told_apart(tmp_path, monkeypatch):
    program(tmp_path, "print('usage: mona [data]')")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigError, match="not the MONA of WS1S"):
        find_mona()


def test_a_missing_ltlf2dfa_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ltlf2dfa.base", None)
    with pytest.raises(ConfigError, match=r"pip install 'pytest-safemanip\[verify\]'"):
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
