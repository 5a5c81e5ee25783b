"""Spaces: which deviations are looked through, from YAML.

title: What a kitchen and a robot may have otherwise
tasks: [all]
dimensions:
forward: {move: objects, along: forward, limits: [-10 cm, 10 cm], price: 2 cm}
category: {object: obj, choices: [apple, can], price: 2}
late: {latency: actions, limits: [0 ms, 400 ms]}
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.search.dimension import Dimension, Dimensions
from pytest_safemanip.search.kinds.definition import FURTHER_KEYS, Kind
from pytest_safemanip.search.units import parse_size, show
from pytest_safemanip.sim.backend import BackendSpec
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.task import Task

EACH = {
    "objects": "object",
    "enclosures": "fixture",
    "mechanisms": "fixture",
    "operated": "fixture",
}
"""What stands for each of a task's roles of a kind: ``operated`` for fixtures that its skills
open, close, press, turn or slide.
"""
ROBOT = "robot"
MOST = 100
"""Dimensions of a space: more is none that 200 rollouts look through."""
MOST_STEPS = 1_000_000
"""Sizes of a dimension to either side."""
_OPTIONAL = ("limits", "choices", "price", "step")


@dataclass(frozen=True)
class Declared:
    """A dimension of a space, as it is declared, and where.

    Attributes:
        dimension: what is declared; roles may be named together, see :data:`EACH`.
        place: ``path:line``.
    """

    dimension: Dimension
    place: str


@dataclass(frozen=True)
class Space:
    """A space, before anybody knows the task.

    Attributes:
        title: what it is, in a line.
        tasks: selectors of the tasks that it is meant for.
        declared: its dimensions.
        place: its file.
    """

    title: str
    tasks: tuple[str, ...]
    declared: tuple[Declared, ...]
    place: str

    def joined(self, other: Space) -> Space:
        """Both together.

        Raises:
            ConfigError: if both have a dimension of the same name.
        """
        own = {one.dimension.name: one for one in self.declared}
        for one in other.declared:
            if one.dimension.name in own:
                first = own[one.dimension.name].place
                raise ConfigError(
                    f"{one.place}: dimension {one.dimension.name!r} is declared twice, "
                    f"first in {first}"
                )
        return replace(self, declared=(*self.declared, *other.declared))


def load_space(path: Path, kinds: Mapping[str, Kind]) -> Space:
    """Read a space from a YAML file.

    Raises:
        ConfigError: naming file, line and what is wrong there.
    """
    section = yamlfile.load(path)
    section.check_keys(("dimensions",), ("title", "tasks"))
    declared = section.section("dimensions")
    found = [Declared(_dimension(declared, name, kinds), declared.place(name)) for name in declared]
    if not 0 < len(found) <= MOST:
        raise section.error("dimensions", f"expected 1 to {MOST}, found {len(found)}")
    return Space(
        section.string("title") if "title" in section else path.stem,
        section.strings("tasks") if "tasks" in section else ("all",),
        tuple(found),
        str(path),
    )


def _dimension(section: yamlfile.Section, name: str, kinds: Mapping[str, Kind]) -> Dimension:
    if not name.isidentifier():
        raise section.error(name, "expected a name of letters, digits and '_'")
    own = section.section(name)
    kind = kind_of(own, kinds)
    own.check_keys(kind.keys, (*_OPTIONAL, *kind.details))
    about = about_of(own, kind)
    _check_each(own, kind, about)
    low, high = _limits(own, kind)
    return Dimension(
        name=name,
        kind=kind,
        about=about,
        low=low,
        high=high,
        choices=_choices(own, kind),
        price=_price(own, kind),
        step=_step(own, kind, (low, high)),
        details={
            key: _pair(own, key, detail.unit) if key in own else (detail.low, detail.high)
            for key, detail in kind.details.items()
        },
    )


def kind_of(section: yamlfile.Section, kinds: Mapping[str, Kind]) -> Kind:
    """The kind that a mapping names by one of its keys.

    Raises:
        ConfigError: if it names none, or two.
    """
    named = [key for key in section if key in kinds]
    place = f"{section.path}:{section.line}"
    if len(named) != 1:
        known = ", ".join(kinds)
        unknown = [k for k in section if k not in (*_OPTIONAL, *FURTHER_KEYS)]
        hint = did_you_mean(unknown[0], kinds) if unknown and not named else f"known: {known}"
        found = " and ".join(map(repr, named)) or "none"
        raise ConfigError(f"{place}: expected one key that is a kind, found {found}; {hint}")
    return kinds[named[0]]


def about_of(section: yamlfile.Section, kind: Kind) -> dict[str, str]:
    """What a mapping says that a dimension is about.

    Raises:
        ConfigError: if it says a direction that the kind does not have, or another thing than the
            one that the kind is about.
    """
    about = {key: section.string(key) for key in kind.keys}
    if kind.of and about[kind.name] != kind.of:
        raise section.error(kind.name, f"expected {kind.of!r}, found {about[kind.name]!r}")
    if kind.along and about["along"] not in kind.along:
        hint = did_you_mean(about["along"], kind.along)
        raise section.error("along", f"unknown direction {about['along']!r}; {hint}")
    return about


def _check_each(own: yamlfile.Section, kind: Kind, about: Mapping[str, str]) -> None:
    """Refuse a misspelt word for several roles, which no task would have."""
    text = about[kind.role_key]
    near = get_close_matches(text, EACH, n=1, cutoff=0.8)
    if (kind.role or kind.beside) and near and text not in EACH:
        raise own.error(kind.role_key, f"unknown {text!r}; did you mean {near[0]!r}?")


def check_drawn(
    kind: Kind, about: Mapping[str, str], choices: Iterable[object], known: Collection[str], at: str
) -> None:
    """Refuse a category that no object can be drawn from.

    Args:
        kind: what is changed.
        about: what it is about.
        choices: what is chosen from, where it chooses.
        known: categories and groups of the simulator.
        at: where it is said.

    Raises:
        ConfigError: naming the category.
    """
    named = [about["category"]] if kind.category else choices if kind.draws else []
    for name in named:
        if name not in known:
            raise ConfigError(f"{at}: unknown category {name!r}; {did_you_mean(str(name), known)}")


def _limits(own: yamlfile.Section, kind: Kind) -> tuple[float, float]:
    if not kind.unit:
        if "limits" in own:
            raise own.error("limits", f"{kind.name} has choices, and no size")
        return 0.0, 0.0
    low, high = _pair(own, "limits", kind.unit) if "limits" in own else (kind.low, kind.high)
    if not low <= 0.0 <= high or (kind.low == 0.0 and low < 0.0):
        sign = "0" if kind.low == 0.0 else "a size of at most 0"
        raise own.error("limits", f"expected {sign} first, then one above 0")
    for size in (low, high):
        check_size(own, "limits", kind, size)
    return low, high


def check_size(own: yamlfile.Section, key: str, kind: Kind, size: float) -> None:
    """Refuse a size that is beyond what a kind may have.

    Raises:
        ConfigError: naming the key.
    """
    low, high = kind.farthest
    if not low <= size <= high:
        least, most = show(low, kind.unit), show(high, kind.unit)
        raise own.error(key, f"expected {least} to {most} for {kind.name!r}")


def _step(own: yamlfile.Section, kind: Kind, limits: tuple[float, float]) -> float:
    """The step of sizes: one at least fits between nothing and a limit."""
    step = _size(own, "step", kind.unit, positive=True) if "step" in own else kind.step
    if kind.unit and not 1.0 <= max(-limits[0], limits[1]) / step <= MOST_STEPS:
        key = "step" if "step" in own or "limits" not in own else "limits"
        told = show(step, kind.unit)
        raise own.error(key, f"expected 1 to {MOST_STEPS:,} steps of {told} up to a limit")
    return step


def _pair(own: yamlfile.Section, key: str, unit: str) -> tuple[float, float]:
    texts = own.strings(key)
    if len(texts) != 2:
        raise own.error(key, f"expected two sizes, found {len(texts)}")
    low, high = (_parsed(own, key, text, unit) for text in texts)
    if not low < high:
        raise own.error(key, "expected the smaller size first")
    return low, high


def _parsed(own: yamlfile.Section, key: str, text: str, unit: str) -> float:
    try:
        return parse_size(text, unit)
    except ConfigError as error:
        raise own.error(key, str(error)) from None


def _size(own: yamlfile.Section, key: str, unit: str, positive: bool = False) -> float:
    if not unit:
        raise own.error(key, "what has choices has no step")
    value = _parsed(own, key, own.string(key), unit)
    if positive and value <= 0.0:
        raise own.error(key, f"expected a size above 0, found {own.string(key)!r}")
    return value


def _price(own: yamlfile.Section, kind: Kind) -> float:
    if "price" not in own:
        return kind.price
    if not kind.unit:
        return own.number("price", positive=True)
    return _size(own, "price", kind.unit, positive=True)


def _choices(own: yamlfile.Section, kind: Kind) -> tuple[str, ...]:
    if kind.unit:
        if "choices" in own:
            raise own.error("choices", f"{kind.name} has a size, and no choices")
        return ()
    if "choices" not in own:
        if kind.choices:
            return ()
        raise ConfigError(f"{own.path}:{own.line}: {kind.name} needs 'choices'")
    found = own.strings("choices")
    if not found:
        raise own.error("choices", "expected one or more")
    return found


@dataclass(frozen=True)
class Applicable:
    """What of a space a task, a backend and a policy have.

    Attributes:
        dimensions: those that they have.
        left_out: why others are left out, in a line each.
    """

    dimensions: Dimensions
    left_out: tuple[str, ...]


def applicable(
    space: Space, task: Task, spec: BackendSpec, scenes: str, senses: Collection[str]
) -> Applicable:
    """What of a space can be looked through.

    Args:
        space: the space.
        task: of the episodes.
        spec: the backend's declaration in the task.
        scenes: the family of scenes.
        senses: what the policy senses: ``images``, ``instruction``, ``hand``.

    Raises:
        ConfigError: if the space names a role that the task does not have, though it is meant for
            this task alone, or nothing is left.
    """
    found: list[Dimension] = []
    lacking: dict[str, list[str]] = {}
    for declared in space.declared:
        dimension = declared.dimension
        why = _lacks(dimension, spec, senses)
        own = list(_expanded(dimension, task, spec, scenes)) if not why else []
        if not why and not own:
            why = _nothing(declared, space, task)
        if why:
            lacking.setdefault(why, []).append(dimension.name)
        found += own
    left_out = tuple(f"{', '.join(names)}: {why}" for why, names in lacking.items())
    if not found:
        raise ConfigError(f"{space.place}: {task.name} has none of it ({'; '.join(left_out)})")
    return Applicable(Dimensions(tuple(found)), left_out)


def _lacks(dimension: Dimension, spec: BackendSpec, senses: Collection[str]) -> str:
    kind = dimension.kind
    if why := _unable(kind, spec):
        return why
    if kind.senses and kind.senses not in senses:
        return {
            "images": "the policy does not look",
            "instruction": "the policy reads no instruction",
            "hand": "the policy is not told where its hand is",
        }[kind.senses]
    return ""


def _unable(kind: Kind, spec: BackendSpec) -> str:
    """Why a backend cannot change something; empty if it can."""
    can = not kind.needs or kind.needs in spec.can
    return "" if can else f"the backend has no {kind.needs!r}"


def check_applicable(
    kind: Kind, about: Mapping[str, str], task: Task, spec: BackendSpec, place: str
) -> None:
    """Refuse what cannot be otherwise in a task.

    Args:
        kind: what it changes.
        about: what it is about.
        task: of the episodes.
        spec: the backend's declaration in the task.
        place: where it is said.

    Raises:
        ConfigError: if the backend cannot change it, or the task has no such role.
    """
    if why := _unable(kind, spec):
        raise ConfigError(f"{place}: {kind.name}: {why}")
    if kind.role or kind.beside:
        role, known = about[kind.role_key], _roles(task, kind.role or "object")
        if role not in known:
            raise ConfigError(f"{place}: {_no_role(task, role, known)}")


def _no_role(task: Task, role: str, known: Collection[str]) -> str:
    return f"{task.name} has no {role!r} to change; {did_you_mean(role, known)}"


def _nothing(declared: Declared, space: Space, task: Task) -> str:
    """Why a dimension has nothing to be about in a task.

    Raises:
        ConfigError: if the space is meant for this task alone.
    """
    dimension = declared.dimension
    about = dimension.about[dimension.kind.role_key]
    if about not in EACH and task.name in space.tasks:
        known = _roles(task, dimension.kind.role)
        raise ConfigError(f"{declared.place}: {_no_role(task, about, known)}")
    return "the task has none" if about in EACH else f"the task has no {about!r}"


def _expanded(
    dimension: Dimension, task: Task, spec: BackendSpec, scenes: str
) -> Iterator[Dimension]:
    """A dimension for each thing that it is about in a task."""
    kind = dimension.kind
    if kind.choices and not dimension.choices:
        there: Mapping[str, tuple[str, ...]] = getattr(spec, kind.choices)
        others = tuple(c for c in there.get(scenes, ()) if c != _usual(kind, task, scenes))
        if not others:
            return
        dimension = replace(dimension, choices=others)
    key = kind.role_key
    if not kind.role and not kind.beside:
        yield dimension
        return
    known = _roles(task, kind.role or "object")
    text = dimension.about[key]
    named = [role for role in known if role in _each(text, task)] if text in EACH else [text]
    for role in named:
        if role in known:
            name = f"{dimension.name}[{role}]" if text in EACH and len(named) > 1 else ""
            yield replace(
                dimension,
                name=name or dimension.name,
                about={**dimension.about, key: role},
            )


def _usual(kind: Kind, task: Task, scenes: str) -> str:
    """The choice that is made where nothing is otherwise."""
    return task.kitchen if kind.choices == "kitchens" and scenes == "compact" else ""


def _each(text: str, task: Task) -> Iterable[str]:
    if text == "operated":
        return [role for _, role in task.skills if role not in task.objects]
    roles: tuple[str, ...] = getattr(task, text)
    return roles


def _roles(task: Task, kind: str) -> tuple[str, ...]:
    """The roles of a task that a dimension may be about."""
    fixtures = dict.fromkeys((*task.enclosures, *task.mechanisms, *_each("operated", task)))
    if kind == "fixture":
        return tuple(fixtures)
    return (*task.objects, *((ROBOT,) if kind == "thing" else ()))
