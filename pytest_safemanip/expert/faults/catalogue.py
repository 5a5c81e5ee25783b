"""Catalogues of faults as data, ``faults.yaml`` in the folder of each property.

::

    task: OpenDrawer                # unless a fault says otherwise
    words: {tools: [peeler, knife]} # what $tools stands for
    scenes:                         # how an episode begins, by a name, for several faults
      tidy:
        changes: [{put: obj, beside: bowl, at: [0.1, 0, 0]}, {open: drawer, to: 0.5, joint: NAME}]
        objects: {obj: $tools}      # what the object of a role is drawn from
    drawer:                         # a module of the folder, which has the plans
      slam:                         # a fault, or, with near_miss instead, the safe twin of those
        fault: shuts it, fast       # before it; what it does
        property: ID                # unless it is the name of the folder
        plan: {shut: {speed: 0.9}}  # a function, and its arguments but for the arm and ``unsafe``
        scene: tidy                 # a name, a name and words {tidy: {WORD: VALUE}}, or a scene
        words: {WORD: VALUE}        # of this fault
        tasks: {OpenDrawer: {WORD: VALUE}}  # words of a task, ``scene`` among them; or a list
        number: {of: PARAMETER, unit: m, from: 0, to: 1}  # a family of events: $number

``below: cab`` puts on the counter below a cabinet, so far ahead and aside of its middle, m.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.resources import files
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.expert.faults.fault import Family, Fault
from pytest_safemanip.expert.robot.arm import Motion
from pytest_safemanip.sim.staging import Staging, from_plain

PACKAGE = __name__.rpartition(".")[0]
BELOW = -0.56
"""Top of a counter, seen from the floor of the interior of the cabinet above it, m."""
FILE = "faults.yaml"
GENERAL = {"task", "words", "scenes"}
KEYS = {"fault", "near_miss", "property", "plan", "scene", "words", "tasks", "number"}
RELATIONS = {"in": "in", "onto": "on", "beside": "beside", "below": "in"}
NAMES = {"at": "offset", "to": "openness"}
"""Of what a change says, as its class has it."""
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Words = Mapping[str, Any]


@dataclass(frozen=True)
class Catalogue:
    """The catalogue of a property.

    Attributes:
        folder: its name, that of the property.
        text: the YAML.
        shared: words and scenes of all catalogues.
    """

    folder: str
    text: str
    shared: Words

    def read(self) -> Iterator[tuple[str, Fault | Family]]:
        """Faults and families, with the module of their section, in order.

        Raises:
            ConfigError: if something in it is none, or is not known.
        """
        content = yaml.load(self.text, _Loader)  # noqa: S506
        general = {key: content.get(key) or self.shared.get(key, {}) for key in GENERAL}
        for key in ("words", "scenes"):
            general[key] = self.shared.get(key, {}) | general[key]
        for section, entries in content.items():
            if section not in GENERAL:
                for name, entry in entries.items():
                    yield section, _Entry(self.folder, section, name, entry, general).made()


@dataclass(frozen=True)
class _Entry:
    folder: str
    section: str
    name: str
    entry: Words
    general: Words

    def made(self) -> Fault | Family:
        _expect(self.where, self.entry, KEYS)
        number, doc = self.entry.get("number"), self._doc
        if number is None:
            return self._fault(self.name, {})
        of, unit, low, high = (number.get(key, "") for key in ("of", "unit", "from", "to"))
        made: Callable[[str, float], Fault] = lambda name, value: self._fault(  # noqa: E731
            name, {"number": value}
        )
        return Family(self.name, self._property, of, doc, unit, float(low), float(high), made)

    @property
    def where(self) -> str:
        return f"expert/faults/{self.folder}/{FILE}: {self.name}"

    @property
    def _doc(self) -> str:
        return str(self.entry.get("fault") or self.entry.get("near_miss"))

    @property
    def _property(self) -> str:
        return str(self.entry.get("property", self.folder))

    def _fault(self, name: str, words: Words) -> Fault:
        tasks = self.entry.get("tasks", self.general["task"])
        if not isinstance(tasks, Mapping):
            tasks = dict.fromkeys([tasks] if isinstance(tasks, str) else tasks)
        plans, staging = {}, {}
        for task, own in tasks.items():
            known = {**self.general["words"], **self.entry.get("words", {}), **words, **(own or {})}
            plans[task] = self._plan(known)
            scene = known.get("scene", self.entry.get("scene"))
            if scene is not None:
                staging[task] = self._staging(scene, known)
        entry = repr((self.entry["plan"], self.entry.get("words"), tasks))
        near = "near_miss" in self.entry
        return Fault(name, self._property, self._doc, plans, staging, near, entry)

    def _plan(self, words: Words) -> partial[Motion]:
        """The function of the plan with its arguments, and whether it is dangerous."""
        ((name, arguments),) = _named(self.entry["plan"]).items()
        module = import_module(f"{PACKAGE}.{self.folder}.{self.section}")
        function = getattr(module, name, None)
        if not callable(function):
            known = [n for n, f in vars(module).items() if inspect.isfunction(f)]
            raise ConfigError(
                f"{self.where}: {self.section}.py has no plan {name!r}; "
                f"{did_you_mean(name, known, module.__name__)}"
            )
        takes = inspect.signature(function).parameters
        given = _filled(arguments, words)
        _expect(f"{self.where}: arguments of {name}", given, {*takes} - {"arm", "unsafe"})
        if "unsafe" in takes and "near_miss" in self.entry:
            given["unsafe"] = False
        elif "unsafe" in takes:
            given["unsafe"] = True
        return partial(function, **given)

    def _staging(self, scene: Any, words: Words) -> Staging:
        if isinstance(scene, str) or not set(scene) <= {"changes", "objects"}:
            ((name, own),) = _named(scene).items()
            scene, words = self._scene(name), {**words, **own}
        scene = _filled(scene, words)
        changes = list(self._changes(scene, words))
        objects = {role: tuple(drawn) for role, drawn in scene.get("objects", {}).items()}
        try:
            return Staging(from_plain(changes), objects)
        except ConfigError as error:
            raise ConfigError(f"{self.where}: {error}") from error

    def _scene(self, name: str) -> Words:
        scenes = self.general["scenes"]
        if name not in scenes:
            raise ConfigError(f"{self.where}: unknown scene {name!r}; {did_you_mean(name, scenes)}")
        found: Words = scenes[name]
        return found

    def _changes(self, scene: Words, words: Words) -> Iterator[dict[str, Any]]:
        """Changes, in which a name stands for those of a scene."""
        for change in scene.get("changes", ()):
            if isinstance(change, str):
                yield from self._changes(_filled(self._scene(change), words), words)
            else:
                yield _change(change)


def load(folder: str, shared: Words) -> Catalogue:
    """The catalogue in a folder."""
    return Catalogue(folder, (files(PACKAGE) / folder / FILE).read_text("utf-8"), shared)


def _named(value: Any) -> Words:
    """A name, or a name with arguments, as the latter."""
    return {value: {}} if isinstance(value, str) else value


def _filled(value: Any, words: Words) -> Any:
    """A value in which words stand for what begins with a dollar."""
    if isinstance(value, str) and value.startswith("$"):
        if value[1:] not in words:
            raise ConfigError(f"unknown word {value}; {did_you_mean(value[1:], words)}")
        return _filled(words[value[1:]], words)
    if isinstance(value, Mapping):
        return {_filled(key, words): _filled(part, words) for key, part in value.items()}
    return [_filled(part, words) for part in value] if isinstance(value, list) else value


def _change(said: Any) -> dict[str, Any]:
    """A change as :func:`~pytest_safemanip.sim.staging.from_plain` reads it."""
    found: dict[str, Any] = {}
    for key, value in said.items():
        if key in ("put", "open", "push"):
            found |= {"kind": key, "role": value}
        elif key in RELATIONS:
            found |= {"relation": RELATIONS[key], "target": value}
        else:
            found[NAMES.get(key, key)] = _numbers(value)
    if "below" in said:
        found["offset"] = (*found.get("offset", (0.0, 0.0)), BELOW)
    return found


def _numbers(value: Any) -> Any:
    """A value with its numbers as floats, and its lists as tuples."""
    if isinstance(value, list):
        return tuple(map(_numbers, value))
    return float(value) if type(value) is int else value


def _expect(where: str, found: Words, known: set[str]) -> None:
    for key in found:
        if key not in known:
            raise ConfigError(f"{where}: unknown {key!r}; {did_you_mean(key, known)}")
