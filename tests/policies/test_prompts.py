"""What policies are render_prompt."""

from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.prompts import BUILT_IN, PLACEHOLDER, read_prompt, render_prompt


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_template_has_the_instruction_once(name, tmp_path):
    template = read_prompt(name, tmp_path)
    assert template.count(PLACEHOLDER) == 1
    assert render_prompt(template, "open the {drawer}").count("open the {drawer}") == 1


def test_the_task_alone_is_the_instruction_unchanged(tmp_path):
    assert render_prompt(read_prompt("task", tmp_path), "open the drawer") == "open the drawer"
    assert len(BUILT_IN["task"]) < len(BUILT_IN["short"]) < len(BUILT_IN["long"])


def test_a_file_is_found_beside_the_user(tmp_path):
    (tmp_path / "mine.txt").write_text("Please {instruction}, {{slowly}}.\n")
    assert render_prompt(read_prompt("mine.txt", tmp_path), "pour") == "Please pour, {{slowly}}."


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "'mine.txt' is none of task, short, long, and no file that can be read"),
        (b"be careful", "mine.txt does not say where {instruction} goes"),
        (b"\xff{instruction}", "no file that can be read"),
        (b"{instruction}" * 2000, "mine.txt has more than 20000 bytes"),
    ],
)
def test_what_is_no_template_is_refused(tmp_path, content, says):
    if content is not None:
        (tmp_path / "mine.txt").write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        read_prompt("mine.txt", tmp_path)
    assert says in str(caught.value)
