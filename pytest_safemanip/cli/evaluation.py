"""Judging one recording outside pytest."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.cli.folder import Folder, read_folder
from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.run.cases import applicable, select_properties
from pytest_safemanip.run.option_values import parse_names, parse_params
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording


@dataclass(frozen=True)
class Evaluation:
    """A recording with its verdicts.

    Attributes:
        recording: what happened.
        folder: the working folder.
        task: of the recording.
        properties: those that were judged, by id.
        verdicts: by id.
        errors: why there is no verdict, by id.
        judge: who judged them; has the values of propositions.
    """

    recording: Recording
    folder: Folder
    task: Task
    properties: Mapping[str, Property]
    verdicts: Mapping[str, Verdict]
    errors: Mapping[str, str]
    judge: Judge


def add_judging(parser: argparse.ArgumentParser) -> None:
    """Declare the options that decide verdicts."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="a .rollout file")
    parser.add_argument(
        "--property",
        action="append",
        default=[],
        metavar="ID[,...]",
        help="as --safemanip-properties: ids, globs, category:NAME, pack:NAME; default",
    )
    parser.add_argument(
        "--params",
        action="append",
        default=[],
        metavar="NAME=VALUE[,...]",
        help="a proposition's parameter, for example settled.speed=0.05; as in the ini file",
    )
    parser.add_argument(
        "--semantics", choices=("timed", "paper"), help="of formulas; as in the ini file, or timed"
    )


def evaluate(options: argparse.Namespace, folder: Folder | None = None) -> Evaluation:
    """Judge a recording on every property that applies to its task and is selected.

    Args:
        options: those of :func:`add_judging`.
        folder: the working folder, if it was read before.

    Raises:
        TraceError: if the recording cannot be read, or is none of its task.
        ConfigError: if an option is wrong, or the task is unknown.
    """
    recording = files.load(options.recording)
    folder = folder or read_folder()
    found = folder.definitions.of_recordings([recording.episode])
    name = recording.episode.task
    if name not in found.tasks:
        raise ConfigError(
            f"{options.recording}: unknown task {name!r}; name its folder in the ini file, "
            "as safemanip_task_paths"
        )
    task = found.tasks[name]
    asked = parse_names(",".join(options.property))
    wanted = select_properties(found.properties, asked, "--property")
    ids = applicable(task, found.everywhere, wanted)
    if not ids:
        raise ConfigError(f"--property: none of {', '.join(sorted(wanted))} applies to {name}")
    params = (
        parse_params(parse_names(",".join(options.params)), "--params") or folder.settings.params
    )
    semantics = options.semantics or folder.settings.semantics
    parameters = found.catalogue.parameters(params)
    try:
        judge = Judge(recording, task, found.attributes, found.catalogue, parameters, semantics)
    except TraceError as error:
        raise TraceError(f"{options.recording}: {error}") from error
    properties = {id_: found.properties[id_] for id_ in ids}
    verdicts, errors = {}, {}
    for id_, prop in properties.items():
        try:
            verdicts[id_] = judge.judge(prop)
        except Exception as error:  # a user's proposition may raise anything
            errors[id_] = f"{type(error).__name__}: {error}"
    return Evaluation(recording, folder, task, properties, verdicts, errors, judge)
