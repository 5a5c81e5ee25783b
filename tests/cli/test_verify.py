"""``safemanip verify``: our automata against MONA's."""

from __future__ import annotations

from pytest_safemanip import resources
from pytest_safemanip.cli import verify
from pytest_safemanip.ltlf import compile_formula
from pytest_safemanip.ltlf.formula import Not, is_bounded
from pytest_safemanip.run.definitions import load_definitions
from tests.ltlf.test_mona import needs_mona

SHIPPED = tuple(load_definitions([], [], []).properties.values())


def automata(properties):
    """How many there are of properties, in both profiles."""
    formulas = [f for prop in properties for f in (prop.formula, prop.paper_formula)]
    return sum(not is_bounded(formula) for formula in formulas)


@needs_mona
def test_verify_accepts_all_shipped_properties(safemanip):
    found = safemanip("verify")
    assert found.status == 0
    out = found.out
    assert out.count(" equal\n") == automata(SHIPPED)
    assert f"{automata(SHIPPED)} automata compared with" in out


@needs_mona
def test_verify_fails_with_a_trace_when_an_automaton_is_wrong(safemanip, monkeypatch):
    monkeypatch.setattr(verify, "compile_formula", lambda f: compile_formula(Not(f)))
    found = safemanip("verify", "--properties", resources.folder("properties"))
    assert found.status == 1
    out, without_packs = found.out, automata(prop for prop in SHIPPED if not prop.pack)
    assert out.count("DIFFERENT\n") == without_packs
    assert "G (obj_released -> F settled)\n  one accepts and one rejects:\n    step 0: " in out
    assert f"{without_packs} different" in out


@needs_mona
def test_verify_reads_the_users_folder(tmp_path, safemanip):
    (tmp_path / "mine.yaml").write_text(
        "id: mine\ncategory: own\ntitle: Mine\nsource: me\n"
        "formula: G !bump\natoms: {bump: collision}\n"
    )
    out = safemanip("verify", "--properties", tmp_path).out
    assert "\nmine      timed         2       2  equal\n" in out
    assert "2 automata compared" in out


def test_a_folder_that_is_missing_or_empty_is_an_error(tmp_path, safemanip):
    nowhere = safemanip("verify", "--properties", tmp_path / "nowhere").refusal
    assert "no such folder" in nowhere
    assert "no properties in" in safemanip("verify", "--properties", tmp_path).refusal


def test_a_missing_mona_says_what_to_install(tmp_path, monkeypatch, safemanip):
    monkeypatch.setenv("PATH", str(tmp_path))
    line = safemanip("verify").refusal
    assert "MONA is missing; install it, for example: apt-get install mona" in line
