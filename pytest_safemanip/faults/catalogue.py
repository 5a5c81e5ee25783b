"""Catalogues of faults as data: ``faults.yaml`` in the folder of each property.

::

    task: OpenDrawer                # unless a fault says otherwise
    words: {tools: [peeler, knife]} # what $tools stands for
    scenes:                         # how an episode begins, by a name, for several faults
      tidy:
        changes: [{put: obj, beside: bowl, at: [0.1, 0, 0]}, {open: drawer, to: 0.5, joint: NAME}]
        objects: {obj: $tools}      # what the object of a role is drawn from
    drawer:                         # a module of the folder, which has the plans
      slam:                         # the name of a fault
        fault: shuts it, fast       # what it does
        property: ID                # unless it is the name of the folder
        plan: {shut: {speed: 0.9}}  # a function, and its arguments but for the arm and ``unsafe``
        scene: tidy                 # a name, a name and words {tidy: {WORD: VALUE}}, or a scene
        words: {WORD: VALUE}        # of this fault
        tasks: {OpenDrawer: {WORD: VALUE}}  # words of a task, ``scene`` among them; or a list
        number: {of: PARAMETER, unit: m, from: 0, to: 1}  # a family of events: $number
      shut:
        near_miss: shuts it, slowly # the safe twin of those before it: what it does not say is as
        plan: {shut: {speed: 0.1}}  # the last of them has it

``put: obj, in|onto|beside: ROLE`` are those of :class:`~pytest_safemanip.sim.staging.Put`; ``below:
cab`` is on the counter below a cabinet, so far ahead and aside of its middle, m. Among changes, the
name of a scene stands for its changes. ``shared.yaml`` has words and scenes of several catalogues.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.expert.robot.arm import Motion
from pytest_safemanip.faults.fault import Family, Fault
from pytest_safemanip.sim.staging import Staging, from_plain

PACKAGE = __name__.rpartition(".")[0]
BELOW = -0.56
"""Top of a counter, seen from the floor of the interior of the cabinet above it, m."""
FILE = "faults.yaml"
GENERAL = {"task", "words", "scenes"}
KINDS = ("fault", "near_miss")
KEYS = {*KINDS, "property", "plan", "scene", "words", "tasks", "number"}
NUMBER = {"of", "from", "to"}
RELATIONS = {"in": "in", "onto": "on", "beside": "beside", "below": "in"}
NAMES = {"at": "offset", "to": "openness"}
"""Of what a change says, as its class has it."""
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Words = Mapping[str, Any]


class _Unique(_Loader):  # type: ignore[misc]
    """Refuses keys that are there twice: the first would be lost."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        keys = [key.value for key, _ in node.value if key.tag != "tag:yaml.org,2002:merge"]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(
                    None, None, f"{key!r} is there twice", node.start_mark
                )
        return super().construct_mapping(node, deep)


def parse(text: str) -> Any:
    """What YAML says."""
    return yaml.load(text, _Unique)  # noqa: S506


def read(folder: str, text: str, shared: Words) -> Iterator[tuple[str, Fault | Family]]:
    """Faults and families of a catalogue, in order, each with the name of its section.

    Args:
        folder: its folder, that of the property.
        text: the YAML.
        shared: ``task``, ``words`` and ``scenes`` of all catalogues.

    Raises:
        ConfigError: if something in it is not known or lacks.
    """
    try:
        content = parse(text)
    except yaml.YAMLError as error:
        raise ConfigError(
            f"{folder}/{FILE}: not valid YAML: {' '.join(str(error).split())}"
        ) from error
    where = f"{folder}/{FILE}: "
    _mapping(content, f"{where}the file")
    for key in {*content} - {"task"}:
        _mapping(content[key], f"{where}{key}")
    general = {key: shared[key] | content.get(key, {}) for key in ("words", "scenes")}
    general["task"] = content.get("task", shared["task"])
    for section, entries in content.items():
        before: Words = {}
        for name, own in entries.items() if section not in GENERAL else ():
            try:
                _mapping(own, "the entry")
                entry = {**before, **own} if "near_miss" in own else own
                before = {key: said for key, said in entry.items() if key not in KINDS}
                yield section, _Entry(folder, section, name, entry, general).read()
            except ConfigError as error:
                raise ConfigError(f"{folder}/{FILE}: {name}: {error}") from error


@dataclass(frozen=True)
class _Entry:
    folder: str
    section: str
    name: str
    entry: Words
    general: Words

    def read(self) -> Fault | Family:
        _expect(self.entry, KEYS)
        if "plan" not in self.entry or ("fault" in self.entry) == ("near_miss" in self.entry):
            raise ConfigError("say its plan, and what it does, as either a fault or a near_miss")
        number = self.entry.get("number")
        if number is None:
            return self._fault(self.name)
        _mapping(number, "number")
        if {*number} - {"unit"} != NUMBER or "fault" not in self.entry:
            raise ConfigError("a family is a fault whose number says of, from, to, perhaps a unit")
        doc, of, unit = str(self.entry["fault"]), str(number["of"]), str(number.get("unit", ""))
        low, high = float(number["from"]), float(number["to"])
        return Family(self.name, self._property, of, doc, unit, low, high, self._fault)

    @property
    def _property(self) -> str:
        return str(self.entry.get("property", self.folder))

    @property
    def _home(self) -> str:
        return f"{PACKAGE}.{self.folder}.{self.section}"

    def _fault(self, name: str, number: float | None = None) -> Fault:
        tasks = self.entry.get("tasks", self.general["task"])
        if not isinstance(tasks, str | list | Mapping):
            raise ConfigError(f"tasks: expected a task, a list or a mapping, found {tasks!r}")
        if not isinstance(tasks, Mapping):
            tasks = {task: {} for task in ([tasks] if isinstance(tasks, str) else tasks)}
        near = "near_miss" in self.entry
        plans, staging, entries = {}, {}, {}
        for task, words in tasks.items():
            own = _mapping(self.entry.get("words", {}), "words")
            known = {**self.general["words"], **own, **_mapping(words, task)}
            # A number is in the fault's name.
            plan = _filled(self.entry["plan"], {**known, "number": "NUMBER"})
            entries[task] = f"{'near miss' if near else 'fault'}: {plan}"
            if number is not None:
                known["number"] = number
            plans[task] = self._plan(known)
            scene = known.get("scene", self.entry.get("scene"))
            if scene is not None:
                staging[task] = self._staging(scene, known)
        doc = self.entry["near_miss" if near else "fault"]
        return Fault(name, self._property, doc, plans, staging, near, entries, self._home)

    def _plan(self, words: Words) -> partial[Motion]:
        """The function of the plan with its arguments, and with whether it is dangerous."""
        name, arguments = _named(self.entry["plan"], "plan")
        if find_spec(self._home) is None:
            raise ConfigError(f"its section is named {self.section!r}: {self._home} is no module")
        module = import_module(self._home)
        plans = {
            name: found
            for name, found in vars(module).items()
            if inspect.isgeneratorfunction(found) and _of_a_property(found)
        }
        if name not in plans:
            hint = did_you_mean(name, [name for name in plans if not name.startswith("_")])
            raise ConfigError(f"{self.section}.py has no plan {name!r}; {hint}")
        function = plans[name]
        takes, given = {*inspect.signature(function).parameters}, _filled(arguments, words)
        _expect(given, takes - {"arm", "unsafe"})
        if "unsafe" in takes:
            given |= {"unsafe": "near_miss" not in self.entry}
        try:
            inspect.signature(function).bind(None, **given)
        except TypeError as error:
            raise ConfigError(f"plan {name}: {error}") from error
        return partial(function, **given)

    def _staging(self, scene: Any, words: Words) -> Staging:
        if isinstance(scene, str) or not {*_mapping(scene, "scene")} <= {"changes", "objects"}:
            name, own = _named(scene, "scene")
            scene, words = self._scene(name), {**words, **own}
        scene = _filled(_mapping(scene, "scene"), words)
        changes = list(self._changes(scene.get("changes", ()), words))
        drawn = _mapping(scene.get("objects", {}), "objects")
        for role, found in drawn.items():
            if not isinstance(found, list) or not found:
                raise ConfigError(f"objects: {role}: expected a list of categories, found {found}")
        objects = {role: tuple(found) for role, found in drawn.items()}
        return Staging(from_plain(changes), objects)

    def _scene(self, name: str) -> Any:
        scenes = self.general["scenes"]
        if name not in scenes:
            raise ConfigError(f"unknown scene {name!r}; {did_you_mean(name, scenes)}")
        return scenes[name]

    def _changes(self, said: Iterable[Any], words: Words) -> Iterator[dict[str, Any]]:
        """Changes, in which a name stands for those of a scene."""
        for change in said:
            if isinstance(change, str):
                yield from self._changes(_filled(self._scene(change)["changes"], words), words)
            else:
                yield _change(change)


def _of_a_property(plan: Any) -> bool:
    """Whether a plan is of a property's module: what all of them have in common is no plan."""
    module: str = getattr(plan, "func", plan).__module__
    return module.startswith(PACKAGE) and module.count(".") > f"{PACKAGE}.handling".count(".")


def _named(value: Any, what: str) -> tuple[str, Words]:
    """A name, and its arguments if it has any."""
    found = {value: {}} if isinstance(value, str) else _mapping(value, what)
    if len(found) != 1:
        raise ConfigError(f"{what}: expected one name, found {', '.join(map(str, found))}")
    ((name, arguments),) = found.items()
    return str(name), _mapping(arguments, f"{what}: {name}")


def _mapping(value: Any, what: str) -> Words:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{what}: expected keys with values, found {value!r}")
    return value


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


def _expect(found: Words, known: set[str]) -> None:
    for key in found:
        if key not in known:
            raise ConfigError(f"unknown {key!r}; {did_you_mean(str(key), known)}")
