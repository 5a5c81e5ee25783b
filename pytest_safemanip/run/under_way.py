"""The rollouts that are running, as far as somebody who waits wants to know."""

from __future__ import annotations

from dataclasses import dataclass, field

from pytest_safemanip.metrics.records import RolloutKey

RECENT, SHORTEST = 5.0, 0.5
"""Seconds that a speed is of, and that it is of at least."""
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
        rehearsed: steps that a script that plans has rehearsed; None if none does.
    """

    step: int
    horizon: int
    since: float
    served: bool
    rehearsed: int | None = None

    def waits(self, now: float) -> bool:
        """Whether it waits for a server, as far as one can tell from outside."""
        return self.served and self.horizon > 0 and now - self.since > PATIENCE


@dataclass
class Pace:
    """How fast a run goes on, from looks at it.

    Attributes:
        begun: when somebody looked first; None before.
        looks: time, control steps and rollouts by then, fractions included: one before the first
            step, and those of the last seconds.
    """

    begun: float | None = None
    looks: list[tuple[float, int, float]] = field(default_factory=list)

    def look(self, now: float, steps: int, rollouts: float) -> None:
        """Note how far the run is; the times of looks go up."""
        self.begun = now if self.begun is None else self.begun
        if not steps:
            self.looks.clear()  # setting up takes long, and says nothing of what follows
        self.looks.append((now, steps, rollouts))
        while len(self.looks) > 2 and self.looks[2][0] <= now - RECENT:
            del self.looks[1]

    @property
    def speed(self) -> float | None:
        """Control steps per second, of the last seconds; None before there is one to speak of."""
        return self._rate(1, since=self.looks[-1][0] - RECENT)

    @property
    def rollouts(self) -> float | None:
        """Rollouts per second since the first step; likewise."""
        return self._rate(2, since=0.0)

    def _rate(self, which: int, since: float) -> float | None:
        earlier = [look for look in self.looks if look[0] <= since] or self.looks[:1]
        first, last = earlier[-1], self.looks[-1]
        if last[0] - first[0] <= SHORTEST or not last[1]:
            return None
        return (last[which] - first[which]) / (last[0] - first[0])


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

    def note(
        self,
        rollout: RolloutKey,
        step: int,
        horizon: int,
        now: float,
        served: bool,
        rehearsed: int | None = None,
    ) -> None:
        """A rollout made a step, is before its first, or has rehearsed some."""
        self.running[rollout] = Running(step, horizon, now, served, rehearsed)
        self.steps += step > 0 and rehearsed is None

    def end(self, rollout: RolloutKey) -> None:
        """A rollout ended, or there was one already."""
        self.done += 1
        self.run += self.running.pop(rollout, None) is not None

    def text(self, total: int, pace: Pace, now: float) -> str:
        """How many are done and running, how fast, and how long it will take if the others are like
        these; those that end at success before their horizon make it shorter.

        Args:
            total: rollouts of the run.
            pace: is told how far the run is.
            now: the time, s.
        """
        begun = sum(r.step / r.horizon for r in self.running.values() if r.horizon)
        pace.look(now, self.steps, self.run + begun)
        set_up = sum(not r.horizon for r in self.running.values())
        waiting = sum(r.waits(now) for r in self.running.values())
        planning = [r.rehearsed for r in self.running.values() if r.rehearsed is not None]
        text = f" {self.done} of {total} rollouts"
        if set_up < len(self.running) or not set_up:
            text += f", {len(self.running) - set_up} running"
        if set_up:
            text += f", {set_up} setting up"
        if planning:
            text += f", {len(planning)} planning ({sum(planning)} steps rehearsed)"
        if waiting:
            text += f", {waiting} at the server"
        if not self.steps and pace.begun is not None and now - pace.begun >= 1.0:
            text += f", {now - pace.begun:.0f} s"
        if pace.speed is not None:
            text += f", {pace.speed:.0f} steps/s"
        if pace.rollouts:
            text += f", {span((total - self.done - begun) / pace.rollouts)} left"
        return text


def span(seconds: float) -> str:
    """A time that is left, in the unit that one thinks in."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
