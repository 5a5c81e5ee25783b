"""Every command and every output in the documentation is what there is."""

from __future__ import annotations

import argparse
import os
import re
import shlex
from pathlib import Path

import platformdirs
import pytest

from pytest_safemanip.run.cases import select_tasks
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.option_values import parse_seeds
from tests.conftest import Rollouts
from tests.docs.blocks import Page, masked, parse, refreshed
from tests.warm import Warm

ROOT = Path(__file__).parents[2]
WRITTEN = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
)
CHECKED = {"sh", "python", "output", "yaml", "ini"}
SHOWN = {"text", "bibtex", "js"}
MAX_NOT_RUN = 36
EARLY = 6
"""Seeds, of a larger budget, that are shared: the rest the command runs if it needs them."""


class Earlier:
    """Rollouts that a page's commands find recorded, since all pages and tests share them."""

    def __init__(self, rollouts: Rollouts, folder: Path) -> None:
        self._rollouts, self._folder = rollouts, folder
        self._tasks = load_definitions([], [], []).runnable
        self._parser = argparse.ArgumentParser()
        for name, default in {
            "policy": "",
            "tasks": "all",
            "seeds": "1",
            "out": ".safemanip",
        }.items():
            self._parser.add_argument(f"--safemanip-{name}", dest=name, default=default)

    def __call__(self, script: str) -> None:
        """Put the recordings that a script would make where it would make them."""
        for line in script.splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] == ["pytest"]:
                stops_early = any("--safemanip-early-stop" in word for word in words)
                self._put(self._parser.parse_known_args(words)[0], stops_early)

    def _put(self, chosen: argparse.Namespace, stops_early: bool) -> None:
        names = {part for part in chosen.tasks.split(",") if part in {*self._tasks, "quick"}}
        if chosen.policy.partition(":")[0] != "scripted" or not names:
            return
        target = self._folder / chosen.out / "recordings"
        target.mkdir(parents=True, exist_ok=True)
        for task in select_tasks(self._tasks, sorted(names)):
            for seed in parse_seeds(chosen.seeds)[: EARLY if stops_early else None]:
                path = self._rollouts.get(task.name, chosen.policy, seed).path
                if not (target / path.name).exists():
                    os.link(path, target / path.name)


@pytest.mark.parametrize("page", WRITTEN)
def test_every_command_does_what_the_page_shows(
    page: str,
    tmp_path: Path,
    rollouts: Rollouts,
    warm: Warm,
    monkeypatch: pytest.MonkeyPatch,
    update: bool,
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", platformdirs.user_cache_dir())
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    text = (ROOT / page).read_text()
    shown, rest = "", 0
    for block, output in Page(text, folder, warm, Earlier(rollouts, folder)).run():
        if update:
            shown += text[rest : block.start] + refreshed(block.code, output)
            rest = block.end
        else:
            place = f"{page}:{block.line}; pytest tests/docs --update-docs writes it anew"
            assert masked(block.code).splitlines() == masked(output).splitlines(), place
    if update:
        (ROOT / page).write_text(shown + text[rest:])


def test_every_block_is_run_or_says_why_not() -> None:
    reasons = []
    for page in WRITTEN:
        for block in parse((ROOT / page).read_text()):
            place = f"{page}:{block.line}"
            assert block.language in CHECKED | SHOWN, f"{place}: a block of {block.language!r}"
            if block.language in {"yaml", "ini"}:
                assert block.path, f"{place}: the first line is no comment with the file's path"
            if "not run" in block.notes:
                assert len(block.notes["not run"]) > 10, place
                reasons.append(place)
    assert len(reasons) <= MAX_NOT_RUN, reasons


def test_links_lead_somewhere() -> None:
    for page in WRITTEN:
        text = re.sub(r"```.*?```", "", (ROOT / page).read_text(), flags=re.S)
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text):
            assert (ROOT / page).parent.joinpath(target).exists(), f"{page}: {target}"
