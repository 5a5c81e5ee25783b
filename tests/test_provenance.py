from __future__ import annotations

import pytest

from pytest_safemanip import provenance
from pytest_safemanip.provenance import source_digest


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of one folder and one module."""
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "inner.py").write_text("a = 1\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "module.py").write_text("b = 2\n")
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    return tmp_path


@pytest.mark.parametrize("part", ["gone", "gone.py", "empty"])
def test_a_part_that_is_gone_is_an_error_that_names_it(package, part):
    with pytest.raises(FileNotFoundError, match=f"'{part}'"):
        source_digest("room", part)


@pytest.mark.parametrize("file", ["room/inner.py", "module.py"])
def test_a_digest_changes_with_each_file_of_its_parts(package, file):
    before = source_digest("room", "module.py")
    assert source_digest("module.py", "room") == before
    (package / file).write_text("c = 3\n")
    assert source_digest("room", "module.py") != before
