"""The table of what is changed in other people's code."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.patches import compat, table
from pytest_safemanip.sim.robocasa.patches.table import PATCHES, Patch

PAGE = Path(__file__).parents[3] / "docs" / "architecture.md"


@pytest.mark.parametrize("patch", PATCHES, ids=lambda patch: patch.name)
def test_the_installed_packages_need_every_patch(patch: Patch) -> None:
    assert patch.needed(), (
        f"{patch.target}: the patch {patch.name!r} is no longer needed; remove it"
    )


@pytest.mark.parametrize("patch", PATCHES, ids=lambda patch: patch.name)
def test_every_patch_names_what_exists(patch: Patch) -> None:
    assert importlib.util.find_spec(f"{table.__package__}.{patch.done}")
    for target in patch.target.split(", "):
        module, _, attribute = target.partition(":")
        if module.startswith(("robosuite.", "robocasa.")) and not module.endswith(
            (".macros_private", ".*")
        ):
            assert attribute.rpartition(".")[2] in table.source(module)


def test_the_source_of_what_is_not_there_is_empty() -> None:
    assert table.source("robosuite.no.such.module") == table.source("no_such_package.at.all") == ""


def test_patches_of_what_a_newer_package_has_itself_are_not_recorded() -> None:
    names = [patch.name for patch in PATCHES]
    assert table.active(compat.SUPPLIES) == tuple(names)
    assert table.active(["legacy_base"]) == tuple(
        name for name in names if name not in ("task_flags", "deferred_load")
    )


def test_loading_says_which_patches_are_made(assets_root: Path) -> None:
    assert loading.load(assets_root) == tuple(patch.name for patch in PATCHES)


def test_the_page_has_the_table() -> None:
    assert "\n".join(table.document()) in PAGE.read_text()
