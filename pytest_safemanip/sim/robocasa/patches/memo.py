"""Caches the results of pure functions that RoboCasa calls at every control step.

Its fixtures parse the same attributes of their XML, build the same rotations and compare the names
of all geoms in contact, step after step: a quarter of a step once the controllers are cheap.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pairs = Sequence[Sequence[int]]

_KEPT = 4096
"""Answers kept of each function; the fixtures of RoboCasa's largest kitchens ask for some 500."""


def install() -> None:
    """Install caches of pure functions in the imported modules of robosuite and RoboCasa."""
    from robocasa.utils import object_utils
    from robosuite.models.robots import RobotModel
    from robosuite.utils import mjcf_utils, transform_utils

    texts, apart = mjcf_utils.string_to_array, object_utils.objs_intersect
    turns = {
        transform_utils.euler2mat: (3,),
        transform_utils.quat2mat: (4,),
        transform_utils.mat2euler: (3, 3),
        transform_utils.mat2quat: (3, 3),
    }
    _replace({texts: _texts(texts), apart: _intersect(apart)})
    _replace({function: _numbers(function, shape) for function, shape in turns.items()})
    RobotModel.set_mujoco_model = keep_model


def _replace(functions: dict[Any, Any]) -> None:
    """Replace functions wherever a module has them, by whatever name."""
    for name, module in list(sys.modules.items()):
        if name.startswith(("robosuite.", "robocasa.")):
            for attribute, value in list(vars(module).items()):
                if callable(value) and getattr(value, "__hash__", None) and value in functions:
                    setattr(module, attribute, functions[value])


def _texts(function: Callable[[str], NDArray[Any]]) -> Callable[[str], NDArray[Any]]:
    known = functools.lru_cache(_KEPT)(function)

    @functools.wraps(function)
    def answer(string: str) -> NDArray[Any]:
        return known(string).copy()  # RoboCasa changes some of them

    return answer


def _numbers(
    function: Callable[[Any], NDArray[Any]], shape: tuple[int, ...]
) -> Callable[..., NDArray[Any]]:
    # By their bytes: 0.0 and -0.0 are equal and lead to different bits.
    known = functools.lru_cache(_KEPT)(lambda raw: function(np.frombuffer(raw).reshape(shape)))

    @functools.wraps(function)
    def answer(numbers: Any, *others: Any, **named: Any) -> NDArray[Any]:
        array = np.asarray(numbers, dtype=np.float64)
        if others or named or array.shape != shape:
            return function(numbers, *others, **named)
        return known(array.tobytes()).copy()

    return answer


def _intersect(function: Callable[..., bool]) -> Callable[..., bool]:
    from robocasa.models.fixtures import Fixture
    from robocasa.models.objects.objects import MJCFObject

    @functools.wraps(function)
    def answer(
        obj: Any,
        obj_pos: Any,
        obj_quat: Any,
        other_obj: Any,
        other_obj_pos: Any,
        other_obj_quat: Any,
    ) -> bool:
        if not all(isinstance(one, (MJCFObject, Fixture)) for one in (obj, other_obj)):
            return function(obj, obj_pos, obj_quat, other_obj, other_obj_pos, other_obj_quat)
        boxes = [
            obj.get_bbox_points(trans=obj_pos, rot=obj_quat),
            other_obj.get_bbox_points(trans=other_obj_pos, rot=other_obj_quat),
        ]
        for box in boxes:
            for corner in box[1:4]:
                normal = corner - box[0]
                normal = normal / np.linalg.norm(normal)
                # Few numbers: Python finds their extremes sooner than numpy.
                one, two = ([np.dot(point, normal) for point in points] for points in boxes)
                if min(two) > max(one) or min(one) > max(two):
                    return False
        return True

    return answer


def keep_model(robot: Any, mujoco_model: Any = None) -> None:
    """Stands for a robot model's ``set_mujoco_model``, which compiles the robot alone."""
    robot.mujoco_model = mujoco_model


class ContactCheck:
    """Answers as an environment's ``check_contact``, comparing numbers instead of names.

    Args:
        sim: robosuite's simulation, whose geoms do not change any more.
        carried: gives pairs of geoms that touch, although MuJoCo does not list them.
    """

    def __init__(self, sim: Any, carried: Callable[[], Pairs] = tuple) -> None:
        self._carried = carried
        self._data = sim.data._data
        self._number = sim.model._geom_name2id
        self._models: dict[int, tuple[Any, frozenset[int]]] = {}

    def __call__(self, geoms_1: Any, geoms_2: Any = None) -> bool:
        """Whether a geom of the first group touches one of the second, or any at all if None.

        Args:
            geoms_1: a geom's name, several names, or a robosuite model, for its contact geoms.
            geoms_2: likewise.
        """
        pairs = [*self._data.contact.geom.tolist(), *self._carried()]
        first = self._group(geoms_1)
        if geoms_2 is None:
            return any(a in first or b in first for a, b in pairs)
        second = self._group(geoms_2)
        return any((a in first and b in second) or (a in second and b in first) for a, b in pairs)

    def touching(self) -> tuple[bytes, Pairs]:
        """All that its answers depend on in a simulation."""
        return self._data.contact.geom.tobytes(), self._carried()

    def _group(self, geoms: Any) -> frozenset[int]:
        if isinstance(geoms, str):
            return self._numbers((geoms,))
        if id(geoms) in self._models:
            return self._models[id(geoms)][1]
        if not hasattr(geoms, "contact_geoms"):
            return self._numbers(geoms)
        # The model is kept too: its identity must not be given to another one.
        self._models[id(geoms)] = geoms, self._numbers(geoms.contact_geoms)
        return self._models[id(geoms)][1]

    def _numbers(self, names: Iterable[str]) -> frozenset[int]:
        known = self._number
        return frozenset(known[name] for name in names if name in known)


class Unchanged:
    """Answers as a method, which is asked again only when what it depends on has changed.

    Args:
        method: it changes nothing but what it would leave as it is if it were called again.
        seen: gives all that its answer depends on, besides its arguments.
    """

    def __init__(self, method: Callable[..., Any], seen: Callable[[], Any]) -> None:
        self._method, self._seen = method, seen
        self._last: Any = None
        self._answers: dict[Any, Any] = {}

    def __call__(self, *args: Any, **named: Any) -> Any:
        """What it answers, or a copy of what it has answered since a change."""
        seen, asked = self._seen(), (args, tuple(named.items()))
        if seen != self._last:
            self._last = seen
            self._answers.clear()
        if asked not in self._answers:
            self._answers[asked] = self._method(*args, **named)
        return _copied(self._answers[asked])


def _copied(answer: Any) -> Any:
    if isinstance(answer, dict):
        return {key: _copied(value) for key, value in answer.items()}
    if isinstance(answer, list):
        return [_copied(value) for value in answer]
    return answer.copy() if isinstance(answer, np.ndarray) else answer


class LastCorners:
    """Answers as an object's ``get_bbox_points``, which checks of one state ask for several times.

    Args:
        function: the object's.
    """

    def __init__(self, function: Callable[..., list[NDArray[Any]]]) -> None:
        self.__wrapped__ = getattr(function, "__wrapped__", function)
        self._known: tuple[Any, list[NDArray[Any]]] = None, []

    def __call__(self, trans: Any = None, rot: Any = None) -> list[NDArray[Any]]:
        """The corners (8 of (3,)) at a position and, if given, a quaternion (x, y, z, w)."""
        asked = tuple(None if x is None else np.asarray(x, float).tobytes() for x in (trans, rot))
        if asked != self._known[0]:
            self._known = asked, self.__wrapped__(trans, rot)
        return [corner.copy() for corner in self._known[1]]
