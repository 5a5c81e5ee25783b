"""Kinds of dimensions, and values of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pytest_safemanip.search.situation import Situation

About = Mapping[str, str]
"""What a dimension is about, by the keys that it has in YAML."""
FURTHER_KEYS = ("along", "beside", "category")
"""Keys that a dimension may have beside its kind's own, each named like the field of
:class:`Kind` that says whether it has it.
"""
Named = Callable[[str], str]
"""What people call what plays a role: ``obj (mug)``."""


@dataclass(frozen=True)
class Setting:
    """The value of a dimension.

    Attributes:
        size: in the unit of its kind, never 0; or one of some choices.
        details: more numbers that a kind has, in their own units.
    """

    size: float | str
    details: tuple[tuple[str, float], ...] = ()

    @property
    def amount(self) -> float:
        """The size as a number; of a choice 1."""
        return 1.0 if isinstance(self.size, str) else self.size

    def detail(self, name: str) -> float:
        """One of the details."""
        return dict(self.details)[name]


@dataclass(frozen=True)
class Detail:
    """A number that matters as soon as a dimension has a size, and has no price.

    Attributes:
        unit: of it.
        low: usual limits.
        high: likewise.
        step: what it is rounded to where it is told.
    """

    unit: str
    low: float
    high: float
    step: float


@dataclass(frozen=True)
class Kind:
    """What a dimension changes.

    Attributes:
        name: the key in YAML that says that a dimension is of this kind; its value is what it is
            about.
        doc: what it changes, in a sentence.
        unit: of its sizes; empty where one chooses.
        apply: changes a situation, given what the dimension is about and its value.
        say: what that means, after "when": ``obj (mug) stands 4 cm nearer the robot``.
        role: what its own key names: ``object``, ``fixture`` or ``thing`` (an object, or
            ``robot``) of the task; empty if it names nothing of it.
        of: what its own key says where it names no role, such as ``actions``; empty for anything.
        along: directions that it may have, by the key ``along``; none if it has no direction.
        beside: whether the key ``beside`` names an object of the task.
        category: whether the key ``category`` says what something is drawn from.
        draws: whether its choices are categories or groups that objects are drawn from.
        low: usual limits of its size.
        high: likewise.
        price: the size that costs 1; of a choice its price.
        step: size that it is reduced by at least.
        details: more numbers that it has.
        needs: what a backend must declare for it, see
            :class:`~pytest_safemanip.sim.backend.BackendSpec`; empty for nothing.
        senses: what a policy must sense for it to matter: ``images``, ``instruction`` or ``hand``;
            empty for nothing.
        choices: which of the backend's own it chooses from, unless told: ``kitchens`` or
            ``styles``; empty if the space has to say.
    """

    name: str
    doc: str
    unit: str
    apply: Callable[[Situation, About, Setting], Situation]
    say: Callable[[About, Setting, Named], str]
    role: str = ""
    of: str = ""
    along: tuple[str, ...] = ()
    beside: bool = False
    category: bool = False
    draws: bool = False
    low: float = 0.0
    high: float = 0.0
    price: float = 1.0
    step: float = 0.0
    details: Mapping[str, Detail] = field(default_factory=dict)
    needs: str = ""
    senses: str = ""
    choices: str = ""

    @property
    def farthest(self) -> tuple[float, float]:
        """The least and the largest size that a file may give: a hundred times the usual limits,
        and of a share at most 100 %.
        """
        most = 100.0 * self.high
        if self.unit == "%" and self.low == 0.0:
            most = min(most, 100.0)
        return 100.0 * self.low, most

    @property
    def role_key(self) -> str:
        """The key whose value is a role of the task, where there is one."""
        return "beside" if self.beside else self.name

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that say what a dimension is about."""
        return (self.name, *(key for key in FURTHER_KEYS if getattr(self, key)))
