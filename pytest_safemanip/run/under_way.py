"""The rollouts that are running, as far as somebody who waits wants to know."""

from __future__ import annotations

from dataclasses import dataclass, field

from pytest_safemanip.metrics.records import RolloutKey

PATIENCE = 1.0
"""Seconds without a step after which a rollout is said to wait for its policy's server."""


@dataclass
class Running:
    """A rollout that is running.

    Attributes:
        step: the last control step; 0 before the first.
        horizon: of the episode; 0 while it is set up.
        since: when that was told, in seconds.
        served: whether its policy is on a server.
    """

    step: int
    horizon: int
    since: float
    served: bool

    def waits(self, now: float) -> bool:
        """Whether it waits for a server, as far as one can tell from outside."""
        return self.served and self.horizon > 0 and now - self.since > PATIENCE


@dataclass
class UnderWay:
    """Counts of a run.

    Attributes:
        running: the rollouts that are running now.
        done: how many have ended, or had been recorded.
        run: how many of those this run has run.
        steps: control steps made so far.
    """

    running: dict[RolloutKey, Running] = field(default_factory=dict)
    done: int = 0
    run: int = 0
    steps: int = 0

    def note(self, rollout: RolloutKey, step: int, horizon: int, now: float, served: bool) -> None:
        """A rollout made a step, or is before its first."""
        self.running[rollout] = Running(step, horizon, now, served)
        self.steps += step > 0

    def end(self, rollout: RolloutKey) -> None:
        """A rollout ended, or there was one already."""
        self.done += 1
        self.run += self.running.pop(rollout, None) is not None

    def text(self, total: int, elapsed: float, now: float) -> str:
        """How many are done and running, how fast, and how long it will take if the others are like
        these; those that end at success before their horizon make it shorter.
        """
        begun = sum(r.step / r.horizon for r in self.running.values() if r.horizon)
        left = total - self.done - begun
        waiting = sum(r.waits(now) for r in self.running.values())
        text = f" {self.done} of {total} rollouts, {len(self.running)} running"
        if waiting:
            text += f", {waiting} at the server"
        if elapsed > 1.0 and self.steps and self.run + begun:
            text += f", {self.steps / elapsed:.0f} steps/s"
            text += f", {span(left * elapsed / (self.run + begun))} left"
        return text


def span(seconds: float) -> str:
    """A time that is left, in the unit that one thinks in."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
