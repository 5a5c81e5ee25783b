"""Calls within running environments that are listened to: nothing that they do changes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any


class Taps:
    """Calls of methods of objects that are listened to; :meth:`close` takes all taps off again.

    Attributes:
        action: what was heard last; None if nobody listens.
    """

    def __init__(self) -> None:
        self._taps = ExitStack()
        self.action: Any = None

    def hear(self, action: Any, *_: Any, **__: Any) -> None:
        """Take note of an action, as a tap on ``step`` does."""
        self.action = action

    def replace(self, target: Any, name: str, by: Callable[..., Any]) -> None:
        """Have a method of one object do something else."""
        own = vars(target).get(name)
        setattr(target, name, by)
        if own is None:
            self._taps.callback(delattr, target, name)
        else:
            self._taps.callback(setattr, target, name, own)

    def before(self, target: Any, name: str, call: Callable[..., None]) -> None:
        """Be told a method's arguments before each of its calls."""
        original = getattr(target, name)

        def tapped(*arguments: Any, **named: Any) -> Any:
            call(*arguments, **named)
            return original(*arguments, **named)

        self.replace(target, name, tapped)

    def after(self, target: Any, name: str, call: Callable[[], None]) -> None:
        """Be told after each call of a method."""
        original = getattr(target, name)

        def tapped(*arguments: Any, **named: Any) -> Any:
            found = original(*arguments, **named)
            call()
            return found

        self.replace(target, name, tapped)

    def close(self) -> None:
        """Take all taps off, the newest first."""
        self._taps.close()
        self.action = None
