"""What is defined for a folder: tasks, properties and propositions, the shipped and the user's."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.sim.backend import DerivedTask, DerivesTasks, Options, Simulator
from pytest_safemanip.spec.objects import load_objects
from pytest_safemanip.spec.packs import Pack, check_no_packs, load_packs, task_folders
from pytest_safemanip.spec.properties import Property, load_properties
from pytest_safemanip.spec.ranges import FIXTURE, OBJECT, ZONES
from pytest_safemanip.spec.task import OBJECTS_FILE, Task
from pytest_safemanip.spec.tasks import derived_task, load_changes, load_staged, load_tasks
from pytest_safemanip.spec.yamlfile import Section
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.episode import Episode

FIRST_BACKEND = "robocasa"
"""The backend whose tasks are in no folder of its own."""


@dataclass(frozen=True)
class Definitions:
    """What is defined.

    Attributes:
        catalogue: the propositions.
        tasks: by name, those of all backends.
        properties: by id; those of packs, too.
        everywhere: those of the properties that apply to every task that has an instance of them:
            the user's and those of packs.
        attributes: of object categories; the user's rows take the place of shipped ones.
        runnable: those of the tasks that the chosen backend has; empty where none is to be run.
        elsewhere: of the others, by name, the backend that has it.
        changes: what the user's files change in tasks that backends derive, by task.
        packs: by name.
    """

    catalogue: Catalogue
    tasks: Mapping[str, Task]
    properties: Mapping[str, Property]
    everywhere: Mapping[str, Property]
    attributes: Mapping[str, frozenset[str]]
    runnable: Mapping[str, Task] = field(default_factory=dict)
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    changes: Mapping[str, Section] = field(default_factory=dict)
    packs: Mapping[str, Pack] = field(default_factory=dict)

    @property
    def unstaged(self) -> dict[str, Task]:
        """The tasks of the backend without those that stage the scene of another, by name: what
        `all` selects, and what tasks are counted of.
        """
        return {name: task for name, task in self.runnable.items() if not task.base}

    def of_backend(self, simulator: Simulator, options: Options) -> Definitions:
        """With the tasks of a backend, which are runnable then, if it derives them.

        Raises:
            ConfigError: if it cannot, or what the user changes in them is wrong.
        """
        factory: object = simulator.create
        if not isinstance(factory, DerivesTasks):
            return self
        derived = factory.derived_tasks(options)
        for name, change in self.changes.items():
            if name not in derived:
                hint = did_you_mean(name, derived, "safemanip tasks")
                raise ConfigError(f"{change.place('task')}: unknown task {name!r}; {hint}")
        tasks = {name: self._derived(name, task) for name, task in derived.items()}
        others = dict.fromkeys(self.runnable.keys() - tasks.keys(), FIRST_BACKEND)
        return replace(
            self,
            tasks={**self.tasks, **tasks},
            runnable=tasks,
            elsewhere={**self.elsewhere, **others},
        )

    def of_recordings(self, episodes: Iterable[Episode]) -> Definitions:
        """With the tasks of recordings that backends have derived: they carry their bindings.

        Raises:
            ConfigError: if a recording's is wrong, or what the user changes in it.
        """
        found: dict[str, Task] = {}
        for episode in episodes:
            if episode.binding and episode.task not in {*self.tasks, *found}:
                source = Path(f"the recorded binding of {episode.task}")
                found[episode.task] = self._derived(
                    episode.task, DerivedTask(source, episode.binding)
                )
        return replace(self, tasks={**self.tasks, **found}) if found else self

    def _derived(self, name: str, task: DerivedTask) -> Task:
        return derived_task(task.binding, task.source, self.changes.get(name))


def load_definitions(
    task_paths: Sequence[Path],
    property_paths: Sequence[Path],
    propositions: Iterable[Proposition],
    backend: str = FIRST_BACKEND,
) -> Definitions:
    """Read everything; a property may use any proposition that exists.

    The shipped tasks of a backend are in a folder of its name, and those of RoboCasa, which
    backends without such a folder have too, beside them. The user's go with any backend, and stand
    for another backend's of the same name.

    Args:
        task_paths: the user's folders of tasks.
        property_paths: the user's folders of properties.
        propositions: the user's.
        backend: the chosen one, ``NAME`` or ``NAME:VARIANT``.

    Raises:
        ConfigError: naming the file that is wrong, or the name that is taken.
    """
    catalogue = Catalogue(propositions)
    task_folder = resources.folder("tasks")
    objects, fixtures = _attributes([task_folder, *task_paths])
    attributes = objects | fixtures
    categories = dict.fromkeys(objects, OBJECT) | dict.fromkeys(fixtures, FIXTURE)
    properties = resources.folder("properties")
    shipped = load_properties([properties], propositions=catalogue)
    parameters = catalogue.parameters({})
    packs = load_packs(
        properties,
        propositions=catalogue,
        categories=categories,
        parameters=parameters,
    )
    shipped |= {id_: rule for pack in packs.values() for id_, rule in pack.rules.items()}
    for place in property_paths:
        check_no_packs(place, properties)
    own = load_properties(
        property_paths,
        propositions=catalogue,
        constants=(ROBOT,),
        categories=categories,
        parameters=parameters,
    )
    for name in sorted(set(shipped) & set(own)):
        raise ConfigError(f"{own[name].path}: property {name!r} is already shipped; rename it")
    for prop in own.values():
        prop.check()
    folders = {place.name: place for place in sorted(task_folder.iterdir()) if place.is_dir()}
    chosen = folders.pop(backend.partition(":")[0], task_folder)
    runnable = load_tasks([chosen, *task_paths])
    of_packs = task_folders(properties) if chosen == task_folder else []
    others = {name: load_tasks([place]) for name, place in folders.items()}
    if chosen != task_folder:
        others[FIRST_BACKEND] = load_tasks([task_folder])
    foreign = {task.name: task for tasks in others.values() for task in tasks.values()}
    for task in load_staged([*of_packs, *task_paths], {**foreign, **runnable}, of_packs).values():
        homes = (tasks for tasks in others.values() if task.base in tasks)
        home = runnable if task.base in runnable else next(homes)
        (home if home is runnable else foreign)[task.name] = home[task.name] = task
    changes = load_changes(task_paths)
    zones = {zone for task in (*foreign.values(), *runnable.values()) for zone in task.zones}
    zones.update(*(change.section("zones") for change in changes.values() if "zones" in change))
    _check_zones(own.values(), zones)
    return Definitions(
        catalogue=catalogue,
        tasks={**foreign, **runnable},
        runnable=runnable,
        elsewhere={
            task: name for name, tasks in others.items() for task in tasks if task not in runnable
        },
        properties={**shipped, **own},
        everywhere={id_: rule for id_, rule in shipped.items() if rule.pack} | own,
        packs=packs,
        attributes=attributes,
        changes=changes,
    )


def _check_zones(properties: Iterable[Property], known: Collection[str]) -> None:
    """Every zone that a property asks for by name is one of some task."""
    for prop in properties:
        for clause in prop.ranges:
            for name in clause.kinds if clause.relation == ZONES else ():
                if name not in known:
                    hint = did_you_mean(name, known)
                    raise ConfigError(f"{prop.path}: no task has a zone {name!r}; {hint}")


def _attributes(
    folders: Iterable[Path],
) -> tuple[dict[str, frozenset[str]], dict[str, frozenset[str]]]:
    """Of categories of objects and of kinds of fixtures, from the files in some folders that have
    one; the last one counts.
    """
    objects: dict[str, frozenset[str]] = {}
    fixtures: dict[str, frozenset[str]] = {}
    for path in (folder / OBJECTS_FILE for folder in folders):
        if path.is_file():
            of_objects, of_fixtures = load_objects(path)
            objects |= of_objects
            fixtures |= of_fixtures
    return objects, fixtures
