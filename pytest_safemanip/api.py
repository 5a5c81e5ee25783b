"""What a notebook needs: a recording from its file, its verdicts, signals, tables and figures."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pytest_safemanip.errors import ConfigError, SafemanipError, TraceError, did_you_mean
from pytest_safemanip.judge import Finding, Judge, Verdict
from pytest_safemanip.live import HandReading, LiveMonitor, Touch
from pytest_safemanip.ltlf import Profile
from pytest_safemanip.markup import table
from pytest_safemanip.metrics import frames, summaries
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.plots import over_time
from pytest_safemanip.plots.of_summary import plot_summary
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Bools, Proposition
from pytest_safemanip.propositions.definition import Floats as Margins
from pytest_safemanip.report.counterexample import violation_lines, worst_violation
from pytest_safemanip.report.lanes import label_of
from pytest_safemanip.run.cases import applicable, select_properties
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace import files
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Steps

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

__all__ = [
    "Binding",
    "HandReading",
    "LiveMonitor",
    "Rollout",
    "Touch",
    "Violation",
    "load",
    "plot_summary",
    "plot_timeline",
    "read_summary",
]


class Violation(NamedTuple):
    """One violation of one property.

    Attributes:
        property_id: of the property.
        finding: whose, when, why, and what proves it.
    """

    property_id: str
    finding: Finding

    def __str__(self) -> str:
        return f"{self.property_id}: {self.finding}"


class Rollout:
    """A recording with what is defined: its verdicts, propositions and figures.

    Args:
        recording: what happened.
        defined: tasks, properties and propositions.
        params: of propositions, those that differ from the defaults.
        semantics: ``timed`` or ``paper``.
        place: what errors call it.

    Raises:
        ConfigError: if its task or a parameter is unknown.
        TraceError: if it is none of its task, or impossible.
    """

    def __init__(
        self,
        recording: Recording,
        defined: Definitions,
        params: Mapping[str, float],
        semantics: Profile = "timed",
        place: str = "recording",
    ) -> None:
        task = recording.episode.task
        if task not in defined.tasks:
            hint = did_you_mean(task, defined.tasks, "safemanip tasks")
            raise ConfigError(f"{place}: unknown task {task!r}; {hint}; name its folder as tasks=")
        self.recording, self._defined, self._place = recording, defined, place
        parameters = defined.catalogue.parameters(params)
        try:
            self._judge = Judge(
                recording,
                defined.tasks[task],
                defined.attributes,
                defined.catalogue,
                parameters,
                semantics,
            )
        except TraceError as error:
            raise TraceError(f"{place}: {error}") from error

    def __repr__(self) -> str:
        return repr(self.recording).replace("<Recording", "<Rollout")

    @property
    def episode(self) -> Episode:
        """What was run."""
        return self.recording.episode

    @property
    def scene(self) -> Scene:
        """What stands there."""
        return self.recording.scene

    @property
    def steps(self) -> Steps:
        """What happened: arrays with time in front."""
        return self.recording.steps

    @property
    def success(self) -> bool:
        """Whether the task's own check held at the end of the acting part."""
        return self.recording.success

    @property
    def properties(self) -> tuple[str, ...]:
        """Ids of the properties that apply to the task."""
        task = self._defined.tasks[self.episode.task]
        wanted = select_properties(self._defined.properties, ())
        return tuple(applicable(task, self._defined.everywhere, wanted))

    def judge(self, property_id: str) -> Verdict:
        """The verdict on one property.

        Raises:
            ConfigError: if there is no such property.
            TraceError: if it has no instance here, or the recording lacks what it needs.
        """
        if property_id not in self._verdicts:
            self._verdicts[property_id] = self._judge.judge(self._property(property_id))
        return self._verdicts[property_id]

    def robustness(self, property_id: str) -> float:
        """By how much the rollout satisfies a property's formula, for the instance that is nearest
        to violating it, or violates it most; negative where it does.

        In the units of margins (see :meth:`margin`); a deadline beside the formula plays no part.

        Raises:
            ConfigError: if there is no such property.
            TraceError: if it has no instance here, or the recording lacks what it needs.
        """
        return min(self._judge.robustness(self._property(property_id)).values())

    @property
    def verdicts(self) -> dict[str, Verdict]:
        """The verdicts on all properties that apply, by id.

        Raises:
            TraceError: if the recording lacks what one needs.
        """
        return {id_: self.judge(id_) for id_ in self.properties}

    @property
    def violations(self) -> tuple[Violation, ...]:
        """The violations of all properties that apply, by first step."""
        found = [Violation(id_, f) for id_, v in self.verdicts.items() for f in v.findings]
        return tuple(sorted(found, key=lambda one: (one.finding.first, one.property_id)))

    def explain(self, property_id: str) -> str:
        """The rule, its violations and the steps that prove them, as in a test failure."""
        verdict = self.judge(property_id)
        prop = self._defined.properties[property_id]
        return "\n".join(violation_lines(prop, verdict, self.recording))

    def signal(self, proposition: str, *entities: str) -> Bools:
        """Truth values of a proposition (T,).

        Args:
            proposition: its name, such as ``settled``.
            entities: what it is about, such as ``obj``: names of the scene or roles of the task.

        Raises:
            ConfigError: if there is no such proposition.
            TraceError: if it has other arguments, or the recording lacks what it needs.
        """
        return self._judge.view(*self._call(proposition, entities))

    def margin(self, proposition: str, *entities: str) -> Margins:
        """How far a proposition is from its threshold (T,), in units of that: positive where it is
        true, 1 at twice the limit; see :meth:`signal`.

        Raises:
            ConfigError: if there is no such proposition.
            TraceError: if it has other arguments, or the recording lacks what it needs.
        """
        return self._judge.view.margin(*self._call(proposition, entities))

    def plot(self, proposition: str, *entities: str) -> Figure:
        """When a proposition holds, and what was measured, with thresholds; see :meth:`signal`.

        Returns:
            A figure of matplotlib's, which shows itself in a notebook; ``savefig`` writes it.

        Raises:
            ConfigError: if there is no such proposition, or matplotlib is not installed.
            TraceError: if it has other arguments, or the recording lacks what it needs.
        """
        name, *arguments = self._call(proposition, entities)
        return over_time.plot_proposition(self._judge, name, arguments, self._title)

    def plot_timeline(self, verdict: Verdict | str) -> Figure:
        """The propositions of a property over time; see :func:`plot_timeline`."""
        if isinstance(verdict, str):
            verdict = self.judge(verdict)
        prop = self._defined.properties.get(verdict.property_id)
        if prop is None:
            raise ConfigError(f"unknown property {verdict.property_id!r}")
        return over_time.plot_verdict(self._judge, prop, verdict, self._title)

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each step: ``time_s``, ``acting``, what the propositions of all properties say
        of each object and fixture, and ``unsafe: ID`` for each property.

        Raises:
            ConfigError: if pandas is not installed.
        """
        steps = np.arange(len(self.steps))
        columns: dict[str, object] = {
            "time_s": steps * self.scene.control_period,
            "acting": ~self.steps.tail,
        }
        for id_ in self.properties:
            prop = self._defined.properties[id_]
            rows = prop.rows(self._judge.view.binding)
            for call in (call for row in rows for call in prop.calls(row)):
                name = label_of(call)
                if name not in columns:
                    columns[name] = self._judge.view(*call)
        for id_, verdict in self.verdicts.items():
            spans = [(f.first, f.last) for f in verdict.findings]
            inside = [(steps >= first) & (steps <= last) for first, last in spans]
            columns[f"unsafe: {id_}"] = np.any([np.zeros(len(steps), bool), *inside], axis=0)
        found: pandas.DataFrame = frames.frame(columns, list(columns))
        found.index.name = "step"
        return found

    def _repr_html_(self) -> str:
        """The verdicts, for a notebook."""
        rows: list[Sequence[object]] = []
        for id_ in self.properties:
            try:
                verdict = self.judge(id_)
            except SafemanipError as error:
                rows.append((id_, "ERROR", "", str(error)))
                continue
            what = worst_violation(verdict, self.recording) if verdict.findings else ""
            triggered = f"{verdict.triggered} of {verdict.instances}"
            rows.append((id_, verdict.outcome.label, triggered, what))
        about = f"{self._title}: {'success' if self.success else 'no success'}"
        about += f", {len(self.steps)} steps\n{self.episode.instruction}"
        return table(about, ("property", "verdict", "triggered", "what"), rows)

    @cached_property
    def _verdicts(self) -> dict[str, Verdict]:
        return {}

    @property
    def _title(self) -> str:
        return f"{self.episode.task}, {self.episode.policy}, seed {self.episode.seed}"

    def _property(self, property_id: str) -> Property:
        known = self._defined.properties
        if property_id not in known:
            hint = did_you_mean(property_id, known, "safemanip properties")
            raise ConfigError(f"unknown property {property_id!r}; {hint}")
        return known[property_id]

    def _call(self, proposition: str, entities: Sequence[str]) -> tuple[str, ...]:
        """A proposition with the entities that names or roles stand for."""
        catalogue = self._defined.catalogue
        if proposition not in catalogue:
            hint = did_you_mean(proposition, catalogue, "safemanip propositions")
            raise ConfigError(f"unknown proposition {proposition!r}; {hint}")
        scene, wanted = self.scene, catalogue[proposition].arguments
        if len(entities) != len(wanted):
            asked = f"{', '.join(wanted)}" or "none"
            raise ConfigError(f"{proposition}: {len(entities)} arguments, expected {asked}")
        found = []
        for kind, name in zip(wanted, entities, strict=True):
            entity = name if name in scene.entity else scene.roles.get(name, name)
            zones = self._judge.view.binding.zones
            if kind != "skill" and entity not in {*scene.entity, *zones}:
                hint = did_you_mean(name, {*scene.entity, *scene.roles, *zones})
                raise ConfigError(f"{self._place}: no entity {name!r}; {hint}")
            found.append(entity)
        return proposition, *found


def load(
    path: str | os.PathLike[str],
    *,
    tasks: Iterable[str | os.PathLike[str]] = (),
    properties: Iterable[str | os.PathLike[str]] = (),
    propositions: Iterable[Proposition] = (),
    params: Mapping[str, float] | None = None,
    semantics: Profile = "timed",
) -> Rollout:
    """Read a recording, to be judged and drawn.

    Args:
        path: a ``.rollout`` file.
        tasks: folders of tasks of your own.
        properties: folders of properties of your own.
        propositions: of your own.
        params: of propositions, for example ``{"settled.speed": 0.05}``.
        semantics: of formulas, ``timed`` or ``paper``.

    Raises:
        TraceError: naming the file and what is wrong with it.
        ConfigError: if its task, a folder or a parameter is unknown.
    """
    file = Path(path)
    if file.is_dir():
        raise TraceError(f"{file}: a folder; name one of the .rollout files in it")
    recording = files.load(file)
    defined = load_definitions(
        [Path(folder) for folder in tasks], [Path(folder) for folder in properties], propositions
    )
    defined = defined.of_recordings([recording.episode])
    return Rollout(recording, defined, params or {}, semantics, str(file))


def read_summary(path: str | os.PathLike[str]) -> Summary:
    """Read the summary of a run.

    Args:
        path: ``summary.json``, or the folder of the run.

    Raises:
        ConfigError: naming the file and what is wrong in it.
    """
    return summaries.read(Path(path))


def plot_timeline(verdict: Verdict, rollout: Rollout) -> Figure:
    """The propositions of a property over time, as lanes: those of the first violated instance,
    with its unsafe steps and the end of the bad prefix; below, what was measured, with thresholds.

    Args:
        verdict: on one property, from :meth:`Rollout.judge`.
        rollout: that it is about.

    Returns:
        A figure of matplotlib's, which shows itself in a notebook; ``savefig`` writes it.

    Raises:
        ConfigError: if matplotlib is not installed.
    """
    return rollout.plot_timeline(verdict)
