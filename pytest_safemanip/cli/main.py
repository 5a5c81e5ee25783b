"""The entry point: finds the subcommand, and turns what happens into an exit status.

Nothing but argparse is imported before a subcommand is chosen.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Any, NoReturn

from pytest_safemanip import __version__
from pytest_safemanip.errors import ConfigError, SafemanipError, TraceError, did_you_mean

FINE, FAILED, INTERRUPTED, INTERNAL_ERROR, USAGE_ERROR = range(5)
"""Exit statuses, those of pytest."""
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
BROKEN_PIPE = 141
"""Exit status where the reader of the output went away: what a shell reports for SIGPIPE."""

COMMANDS = {
    "tasks": "list the tasks, the shipped and your own",
    "task": "describe a task: roles, parts, what may be touched, properties",
    "properties": "list the safety properties with their formulas",
    "propositions": "list the propositions that properties are made of",
    "rule": "make a property of a sentence, with examples to review",
    "policies": "list the policies that --safemanip-policy takes",
    "faults": "list the mistakes that the expert can make on purpose",
    "search": "list the failures that searches kept, or make scenes of them",
    "show": "say what happened in a recording, and what it violates",
    "import": "make recordings of demonstrations and data sets",
    "export": "write recordings as a dataset that policies are trained on",
    "video": "draw a recording as a video, MP4 or GIF",
    "replay": "write a recording as a page that shows it in 3D",
    "rrd": "write a recording as a file for Rerun",
    "pictures": "draw tasks as they begin on contact sheets",
    "report": "print the summary of a run, and decide gates on it",
    "merge": "merge the summaries of several runs or machines into one",
    "serve": "serve a policy of your own over openpi's protocol",
    "verify": "compare the automaton of every property with MONA's",
}
"""Subcommands, each a module of this package, with what it is for."""
MODULES = {
    "export": "recordings.exporting",
    "import": "recordings.importing",
    "replay": "recordings.replay",
    "rrd": "recordings.rrd",
    "show": "recordings.show",
    "video": "recordings.video",
}
"""The modules of some of them; of the others, as they are called."""
EXIT_STATUS = """\
exit status, as pytest's: 0 fine; 1 something failed (a property is violated, a
gate does not pass, the simulator breaks off); 2 interrupted; 3 an error of
safemanip itself; 4 wrong usage, or a file that cannot be read or written; of
gates also 10: verdicts are missing, since a server or the simulator failed; and
11: they are not comparable, since they are on stand-in assets"""


class Parser(argparse.ArgumentParser):
    """Reports wrong usage in one line, with pytest's exit status."""

    def error(self, message: str) -> NoReturn:
        """Print the message and exit."""
        self.exit(USAGE_ERROR, f"{self.prog}: error: {message} (see {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; without them, those of this process.

    Returns:
        The exit status.
    """
    given = sys.argv[1:] if arguments is None else list(arguments)
    name = "safemanip"
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names need not fit the terminal's code
    try:
        if not given or given[0].startswith("-"):
            _overview().parse_args(given)
            _overview().print_help()
            return FINE
        if given[0] not in COMMANDS:
            hint = did_you_mean(given[0], COMMANDS)
            raise ConfigError(f"unknown command {given[0]!r}; {hint}")
        name += f" {given[0]}"
        status = _run(given[0], given[1:])
        if sys.stdout is not None:  # closed by who started this
            sys.stdout.flush()
        return status
    except SystemExit as error:  # argparse printed help or refused the arguments
        return int(error.code or FINE)
    except (ConfigError, TraceError) as error:
        return _failed(name, str(error), USAGE_ERROR)
    except SafemanipError as error:
        return _failed(name, str(error), FAILED)
    except KeyboardInterrupt:
        return _failed(name, "interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The interpreter flushes what is left in the buffer when it ends: to nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        if error.filename is None and error.errno not in _NO_ROOM:
            return _internal(name)
        where = error.filename or "the output cannot be written"
        return _failed(name, f"{where}: {error.strerror}", USAGE_ERROR)
    except Exception:
        return _internal(name)


def load(name: str) -> Any:
    """The module of a subcommand."""
    return importlib.import_module(f"pytest_safemanip.cli.{MODULES.get(name, name)}")


def _run(name: str, arguments: Sequence[str]) -> int:
    command = load(name)
    parser = Parser(
        prog=f"safemanip {name}",
        description=f"{COMMANDS[name][0].upper()}{COMMANDS[name][1:]}.",
        epilog=f"example:\n  {command.EXAMPLE}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    command.add_arguments(parser)
    status: int = command.run(parser.parse_args(arguments))
    return status


def _overview() -> Parser:
    """The parser of the command itself, whose help lists the subcommands."""
    width = max(map(len, COMMANDS))
    listed = "\n".join(f"  {name:<{width}}  {purpose}" for name, purpose in COMMANDS.items())
    parser = Parser(
        prog="safemanip",
        usage="safemanip COMMAND ...",
        description="Temporal safety of robot manipulation: what there is, and what happened.\n"
        "Tests are run by pytest:\n"
        "  pytest --safemanip-policy=scripted --safemanip-tasks=quick",
        epilog=f"commands:\n{listed}\n\nsafemanip COMMAND --help has the options and an example."
        f"\n\n{EXIT_STATUS}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"pytest-safemanip {__version__}")
    return parser


def _failed(name: str, message: str, status: int) -> int:
    print(f"{name}: {'' if status == INTERRUPTED else 'error: '}{message}", file=sys.stderr)
    return status


def _internal(name: str) -> int:
    traceback.print_exc()
    return _failed(name, "internal error, see above", INTERNAL_ERROR)
