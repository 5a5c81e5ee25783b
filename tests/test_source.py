"""Which source code a policy is recognised by."""

from __future__ import annotations

import functools
import shutil
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip import provenance as source
from pytest_safemanip.policies.registry import resolve

FILES = {
    "digest_policy.py": "from digest_pack import inner\nimport json, numpy, not_there_at_all\n",
    "digest_helper.py": "GAIN = 1\n",
    "digest_late.py": "LATE = 1\n",
    "digest_other.py": "OTHER = 1\n",
    "digest_pack/__init__.py": "",
    "digest_pack/inner.py": "from . import near\nfrom .deep.far import FAR\nimport digest_helper\n",
    "digest_pack/near.py": "def now():\n    import digest_late\n",
    "digest_pack/deep/far.py": "from ..near import now\nFAR = 1\n",
    "digest_pack/unused.py": "UNUSED = 1\n",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name, text in FILES.items():
        path = tmp_path / "mine" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(tmp_path / "mine")
    return tmp_path / "mine"


def digest(folder):
    return source.closure_digest([(folder / "digest_policy.py").resolve()])


@pytest.mark.parametrize("edited", FILES)
def test_an_edit_changes_it_if_the_policy_imports_what_was_edited(folder, edited):
    before = digest(folder)
    with (folder / edited).open("a") as file:
        file.write("# edited\n")
    unused = edited in ("digest_other.py", "digest_pack/unused.py")
    assert (digest(folder) == before) == unused


@pytest.mark.parametrize("root", ["digest_gains/mod.py", "digest_gains/sub/deep.py"])
def test_an_edited_init_of_a_package_around_a_file_changes_it(folder, root):
    (folder / "digest_gains" / "sub").mkdir(parents=True)
    (folder / "digest_gains" / "sub" / "__init__.py").write_text("")
    (folder / "digest_gains" / "mod.py").write_text("from . import GAIN\n")
    (folder / "digest_gains" / "sub" / "deep.py").write_text("from .. import GAIN\n")
    init, path = folder / "digest_gains" / "__init__.py", (folder / root).resolve()
    init.write_text("GAIN = 1\n")
    before = source.closure_digest([path])
    init.write_text("GAIN = 2\n")
    assert source.closure_digest([path]) != before


def test_it_is_the_same_wherever_the_files_lie(folder, tmp_path, monkeypatch):
    before = digest(folder)
    shutil.copytree(folder, tmp_path / "elsewhere")
    shutil.rmtree(folder)
    monkeypatch.syspath_prepend(tmp_path / "elsewhere")
    assert digest(tmp_path / "elsewhere") == before


def test_of_what_is_installed_the_policys_own_package_is_followed(tmp_path, monkeypatch):
    installed = tmp_path / "lib" / "site-packages"
    for name in ("digest_mine", "digest_theirs"):
        (installed / name).mkdir(parents=True)
        (installed / name / "__init__.py").write_text("")
        (installed / name / "part.py").write_text("A = 1\n")
    root = installed / "digest_mine" / "policy.py"
    root.write_text("from digest_mine import part\nimport digest_theirs.part\n")
    monkeypatch.syspath_prepend(installed)
    before = source.closure_digest([root])
    (installed / "digest_theirs" / "part.py").write_text("A = 2\n")
    assert source.closure_digest([root]) == before
    (installed / "digest_mine" / "part.py").write_text("A = 2\n")
    assert source.closure_digest([root]) != before


def test_an_import_of_a_module_without_a_file_cannot_be_recognised(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "digest_typed", types.ModuleType("digest_typed"))
    (folder / "digest_late.py").write_text("import digest_typed\n")
    assert digest(folder) is None


def test_an_import_of_a_module_that_was_loaded_from_a_file_follows_the_file(folder, monkeypatch):
    loaded = types.ModuleType("digest_loaded")
    loaded.__file__ = str(folder / "digest_other.py")
    monkeypatch.setitem(sys.modules, "digest_loaded", loaded)
    (folder / "digest_late.py").write_text("import digest_loaded\n")
    before = digest(folder)
    (folder / "digest_other.py").write_text("OTHER = 2\n")
    assert before is not None
    assert digest(folder) not in (None, before)


@pytest.mark.parametrize(
    "line",
    [
        "import importlib; importlib.import_module('digest_other')",
        "from importlib import import_module as load; load('digest_other')",
    ],
)
def test_an_import_by_a_literal_name_is_followed(folder, line):
    (folder / "digest_late.py").write_text(line)
    before = digest(folder)
    (folder / "digest_other.py").write_text("OTHER = 2\n")
    assert before is not None
    assert digest(folder) not in (None, before)


@pytest.mark.parametrize(
    "line",
    [
        "import importlib; importlib.import_module('digest_' + 'other')",
        "import importlib as i; load = i.import_module",
        "from importlib import import_module; import_module(name)",
        "import importlib.util; importlib.util.spec_from_file_location('x', path)",
        "import runpy; runpy.run_path('digest_other.py')",
        "from runpy import run_module; run_module('digest_other')",
        "__import__('digest_other')",
        "exec(open('digest_other.py').read())",
    ],
)
def test_a_file_that_hides_what_it_runs_cannot_be_recognised(folder, line):
    (folder / "digest_late.py").write_text(line)
    assert digest(folder) is None


@pytest.mark.parametrize("line", ["model.eval()", "app.exec()", "import importlib.util"])
def test_a_file_that_uses_what_sounds_alike_is_recognised(folder, line):
    (folder / "digest_late.py").write_text(line)
    assert digest(folder) is not None


class Acts:
    fingerprint = "1"

    def act(self, observation):
        return np.zeros(12)


HERE = Path(__file__).resolve()


@pytest.mark.parametrize(
    "target",
    [Acts, Acts(), Acts().act, Acts.act, lambda: 1, functools.partial(Acts.act, None),
     functools.lru_cache(Acts.act)],
)  # fmt: skip
def test_a_policy_is_found_in_the_file_that_defines_it(target):
    assert source.file_of(target) == HERE


def test_what_was_typed_into_an_interpreter_or_compiled_is_never_recognised():
    members = {"__module__": "typed_in", "fingerprint": "1", "act": lambda self, seen: 0}
    typed = type("Typed", (), members)
    assert source.file_of(typed) is source.file_of(np.zeros) is None
    assert resolve("mine", {"mine": typed}).fingerprint is None
    assert resolve("mine", {"mine": Acts}).fingerprint is not None
    assert resolve("mine", {"mine": Acts}, sources=(None,)).fingerprint is None
