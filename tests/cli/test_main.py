"""What all subcommands have in common: help, exit statuses, one line for what is wrong."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_safemanip.cli import main as cli
from pytest_safemanip.errors import ConfigError, RolloutError, TraceError
from tests.cli.conftest import Command

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
every_command = pytest.mark.parametrize("name", cli.COMMANDS)


def module(name):
    return cli.load(name)


@pytest.mark.parametrize("arguments", [(), ("--help",), ("-h",)])
def test_alone_it_lists_all_commands(safemanip: Command, arguments):
    found = safemanip(*arguments)
    assert found.status == 0
    listed = re.findall(r"^  ([a-z]+)  ", found.out.split("commands:")[1], re.M)
    assert listed == list(cli.COMMANDS)
    assert max(map(len, found.out.splitlines())) <= 80


def test_the_version_is_told(safemanip: Command):
    assert re.fullmatch(r"pytest-safemanip \d+\.\d+\.\d+\n", safemanip("--version").out)


@every_command
def test_help_has_the_purpose_the_options_and_an_example(safemanip: Command, name):
    found = safemanip(name, "--help")
    assert found.status == 0
    assert found.out.startswith(f"usage: safemanip {name}")
    assert cli.COMMANDS[name][1:] in " ".join(found.out.split())
    assert f"example:\n  safemanip {name}" in found.out


@every_command
def test_the_example_is_understood(name):
    parser = cli.Parser()
    module(name).add_arguments(parser)
    words = shlex.split(module(name).EXAMPLE.partition(" && ")[0])
    assert words[:2] == ["safemanip", name]
    parser.parse_args(words[2:])


@every_command
def test_an_option_that_there_is_not_is_refused_in_one_line(safemanip: Command, name):
    line = safemanip(name, "--no-such-option").refusal
    assert line.startswith(f"safemanip {name}: error: ")
    assert line.endswith(f"(see safemanip {name} --help)")


def test_an_unknown_command_has_a_near_miss(safemanip: Command):
    expected = "safemanip: error: unknown command 'tsaks'; did you mean 'tasks'?"
    assert safemanip("tsaks").refusal == expected


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (ConfigError("no such thing"), 4, "safemanip tasks: error: no such thing\n"),
        (TraceError("torn.rollout: torn"), 4, "safemanip tasks: error: torn.rollout: torn\n"),
        (PermissionError(13, "Permission denied", "/x"), 4, "error: /x: Permission denied\n"),
        (RolloutError("the simulator died"), 1, "safemanip tasks: error: the simulator died\n"),
        (KeyboardInterrupt(), 2, "safemanip tasks: interrupted\n"),
    ],
)
def test_what_a_user_can_meet_is_one_line_with_pytests_exit_status(
    safemanip: Command, monkeypatch, error, status, said
):
    def fail(options):
        raise error

    monkeypatch.setattr(module("tasks"), "run", fail)
    found = safemanip("tasks")
    assert (found.status, found.out) == (status, "")
    assert found.err.endswith(said)
    assert found.err.count("\n") == 1


def test_a_mistake_of_its_own_has_a_traceback_and_status_3(safemanip: Command, monkeypatch):
    monkeypatch.setattr(module("tasks"), "run", lambda options: 1 // 0)
    found = safemanip("tasks")
    assert found.status == 3
    assert "ZeroDivisionError" in found.err
    assert found.err.endswith("safemanip tasks: error: internal error, see above\n")


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from pytest_safemanip.cli.main import main; main(['--help']); "
        "sys.exit(sum(name in sys.modules for name in ('numpy', 'yaml', 'pytest', 'scipy')))"
    )
    found = subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=False)
    assert found.returncode == 0


def test_a_reader_that_goes_away_is_no_error(tmp_path):
    command = [sys.executable, "-m", "pytest_safemanip", "faults"]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait(30) == cli.BROKEN_PIPE


def test_a_full_disk_is_one_line(tmp_path):
    command = [sys.executable, "-m", "pytest_safemanip", "faults"]
    with open("/dev/full", "w") as full:
        found = subprocess.run(
            command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    said = "safemanip faults: error: the output cannot be written: No space left on device\n"
    assert (found.returncode, found.stderr) == (4, said)


def test_a_closed_output_is_no_error(tmp_path):
    command = f"{shlex.quote(sys.executable)} -m pytest_safemanip faults >&-"
    found = subprocess.run(
        ["/bin/sh", "-c", command], cwd=tmp_path, stderr=subprocess.PIPE, text=True, check=False
    )
    assert (found.returncode, found.stderr) == (0, "")


def test_the_commands_in_the_documents_exist():
    for page in PAGES:
        text = page.read_text()
        assert "python -m pytest_safemanip." not in text, page
        named = re.findall(r"(?:^|`|\$ )safemanip ([a-z]+)(?![a-z.])", text, re.M)
        assert set(named) <= cli.COMMANDS.keys(), page
        for name, options in re.findall(
            r"(?:^|`|\$ )safemanip ([a-z]+)(?![a-z.])([^`\n]*)", text, re.M
        ):
            parser = cli.Parser()
            module(name).add_arguments(parser)
            known = {option for action in parser._actions for option in action.option_strings}
            assert set(re.findall(r" (--?[a-z]+)", options)) <= known, (page, name, options)
