"""Catalogues of faults as data: ``faults.yaml`` in the folder of each property.

::

    task: OpenDrawer                # unless a fault says otherwise
    variables: {tools: [peeler, knife]}  # what $tools stands for
    stagings:                       # how an episode begins, by a name, for several faults
      tidy:
        changes: [{put: obj, beside: bowl, at: [0.1, 0, 0]}, {open: drawer, to: 0.5, joint: NAME}]
        objects: {obj: $tools}      # what the object of a role is drawn from
    drawer:                         # a module of the folder, which has the plans
      slam:                         # the name of a fault
        fault: shuts it, fast       # what it does
        property: ID                # unless it is the name of the folder
        plan: {shut: {speed: 0.9}}  # a function, and its arguments but for the arm and ``unsafe``
        staging: tidy               # a name, with variables {tidy: {NAME: VALUE}}, or a staging
        variables: {NAME: VALUE}    # of this fault
        tasks: {OpenDrawer: {NAME: VALUE}}  # of a task, ``staging`` among them; or a list
        number: {of: PARAMETER, unit: m, from: 0, to: 1}  # a family of events: $number
      shut:
        near_miss: shuts it, slowly # the safe twin of those before it: what it does not say is as
        plan: {shut: {speed: 0.1}}  # the last of them has it

``put: obj, in|onto|beside: ROLE`` are those of :class:`~pytest_safemanip.sim.staging.Put`; ``below:
cab`` is on the counter below a cabinet, so far ahead and aside of its middle, m. Among changes, the
name of a staging stands for its changes. ``shared.yaml`` has variables and stagings of several
catalogues.
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
GENERAL = {"task", "variables", "stagings"}
KINDS = ("fault", "near_miss")
KEYS = {*KINDS, "property", "plan", "staging", "variables", "tasks", "number"}
NUMBER = {"of", "from", "to"}
RELATIONS = {"in": "in", "onto": "on", "beside": "beside", "below": "in"}
NAMES = {"at": "offset", "to": "openness"}
"""Of what a change says, as its class has it."""
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Values = Mapping[str, Any]


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


def read(folder: str, text: str, shared: Values) -> Iterator[tuple[str, Fault | Family]]:
    """Faults and families of a catalogue, in order, each with the name of its section.

    Args:
        folder: its folder, that of the property.
        text: the YAML.
        shared: ``task``, ``variables`` and ``stagings`` of all catalogues.

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
    general = {key: shared[key] | content.get(key, {}) for key in ("variables", "stagings")}
    general["task"] = content.get("task", shared["task"])
    for section, entries in content.items():
        before: Values = {}
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
    entry: Values
    general: Values

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
        plans, stagings, entries = {}, {}, {}
        for task, values in tasks.items():
            own = _mapping(self.entry.get("variables", {}), "variables")
            known = {**self.general["variables"], **own, **_mapping(values, task)}
            # A number is in the fault's name.
            plan = _filled(self.entry["plan"], {**known, "number": "NUMBER"})
            entries[task] = f"{'near miss' if near else 'fault'}: {plan}"
            if number is not None:
                known["number"] = number
            plans[task] = self._plan(known)
            begins = known.get("staging", self.entry.get("staging"))
            if begins is not None:
                stagings[task] = self._staging(begins, known)
        doc = self.entry["near_miss" if near else "fault"]
        return Fault(name, self._property, doc, plans, stagings, near, entries, self._home)

    def _plan(self, values: Values) -> partial[Motion]:
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
        takes, given = {*inspect.signature(function).parameters}, _filled(arguments, values)
        _expect(given, takes - {"arm", "unsafe"})
        if "unsafe" in takes:
            given |= {"unsafe": "near_miss" not in self.entry}
        try:
            inspect.signature(function).bind(None, **given)
        except TypeError as error:
            raise ConfigError(f"plan {name}: {error}") from error
        return partial(function, **given)

    def _staging(self, said: Any, values: Values) -> Staging:
        if isinstance(said, str) or not {*_mapping(said, "staging")} <= {"changes", "objects"}:
            name, own = _named(said, "staging")
            said, values = self._named_staging(name), {**values, **own}
        said = _filled(_mapping(said, "staging"), values)
        changes = list(self._changes(said.get("changes", ()), values))
        drawn = _mapping(said.get("objects", {}), "objects")
        for role, found in drawn.items():
            if not isinstance(found, list) or not found:
                raise ConfigError(f"objects: {role}: expected a list of categories, found {found}")
        objects = {role: tuple(found) for role, found in drawn.items()}
        return Staging(from_plain(changes), objects)

    def _named_staging(self, name: str) -> Any:
        known = self.general["stagings"]
        if name not in known:
            raise ConfigError(f"unknown staging {name!r}; {did_you_mean(name, known)}")
        return known[name]

    def _changes(self, said: Iterable[Any], values: Values) -> Iterator[dict[str, Any]]:
        """Changes, in which a name stands for those of a staging."""
        for change in said:
            if isinstance(change, str):
                yield from self._changes(
                    _filled(self._named_staging(change)["changes"], values), values
                )
            else:
                yield _change(change)


def _of_a_property(plan: Any) -> bool:
    """Whether a plan is of a property's module: what all of them have in common is no plan."""
    module: str = getattr(plan, "func", plan).__module__
    return module.startswith(PACKAGE) and module.count(".") > f"{PACKAGE}.handling".count(".")


def _named(value: Any, what: str) -> tuple[str, Values]:
    """A name, and its arguments if it has any."""
    found = {value: {}} if isinstance(value, str) else _mapping(value, what)
    if len(found) != 1:
        raise ConfigError(f"{what}: expected one name, found {', '.join(map(str, found))}")
    ((name, arguments),) = found.items()
    return str(name), _mapping(arguments, f"{what}: {name}")


def _mapping(value: Any, what: str) -> Values:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{what}: expected keys with values, found {value!r}")
    return value


def _filled(value: Any, values: Values) -> Any:
    """A value in which each ``$NAME`` is replaced by the variable of that name."""
    if isinstance(value, str) and value.startswith("$"):
        if value[1:] not in values:
            raise ConfigError(f"unknown variable {value}; {did_you_mean(value[1:], values)}")
        return _filled(values[value[1:]], values)
    if isinstance(value, Mapping):
        return {_filled(key, values): _filled(part, values) for key, part in value.items()}
    return [_filled(part, values) for part in value] if isinstance(value, list) else value


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


def _expect(found: Values, known: set[str]) -> None:
    for key in found:
        if key not in known:
            raise ConfigError(f"unknown {key!r}; {did_you_mean(str(key), known)}")
