"""`safemanip rule` writes what it prints, and nothing over another file."""

from __future__ import annotations

from pytest_safemanip.cli.main import FINE, USAGE_ERROR, main
from pytest_safemanip.spec.properties import load_property


def test_the_property_is_printed_and_written(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    said = ["rule", "never bump while holding the bowl", "--id", "hands_full", "-o", "full.yaml"]
    assert main(said) == FINE
    assert (tmp_path / "full.yaml").read_text() in capsys.readouterr().out
    assert load_property(tmp_path / "full.yaml").id == "hands_full"
    assert main(said) == USAGE_ERROR
    assert "full.yaml: exists" in capsys.readouterr().err


def test_a_file_that_no_folder_of_properties_would_read_is_refused(tmp_path, capsys) -> None:
    assert main(["rule", "never bump", "-o", str(tmp_path / "bump.txt")]) == USAGE_ERROR
    assert "expected a file that ends in .yaml" in capsys.readouterr().err


def test_a_wrong_id_is_refused_before_anything_is_written(tmp_path, capsys) -> None:
    path = tmp_path / "bump.yaml"
    assert main(["rule", "never bump", "--id", "No Bump", "-o", str(path)]) == USAGE_ERROR
    assert "No Bump" in capsys.readouterr().err
    assert not path.exists()


def test_a_rule_that_nothing_can_break_is_one_line(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["rule", "never obj_released until obj_released"]) == USAGE_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert "'!obj_released W obj_released' is always true: every rollout would pass" in line


def test_an_id_that_is_taken_is_refused_before_anything_is_written(
    tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pytest.ini").write_text("[pytest]\nsafemanip_property_paths = rules\n")
    (tmp_path / "rules").mkdir()
    assert main(["rule", "never bump", "-o", "rules/bump.yaml"]) == FINE
    assert main(["rule", "never bump", "-o", "rules/again.yaml"]) == USAGE_ERROR
    found = capsys.readouterr().err
    assert "property 'never_bump' is in" in found
    assert "bump.yaml already; give another with --id" in found
    assert not (tmp_path / "rules" / "again.yaml").exists()
