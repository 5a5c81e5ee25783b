"""A search: for each property of a task, the smallest deviation under which a policy violates it.

It goes on in rounds. In each round every property asks for some trials, all of them are run, in
whatever order, and every property learns from all that came of them: one rollout serves all. What
a round asks for depends on the outcomes of those before it and on nothing else, so that a search
is the same however many rollouts run side by side, and goes on where it stopped when the outcomes
that are known already are told again.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace

from pytest_safemanip.search.dimension import NOTHING, Deviation, Dimensions
from pytest_safemanip.search.proposing.proposer import MakeProposer
from pytest_safemanip.search.shrinking import Shrinker
from pytest_safemanip.search.trials import Outcome, Trial

ROLLOUTS = 200
"""Trials of a property while nothing is found, unless told."""
BATCH = 8
"""Trials that a property asks for in a round."""
SHRINKING = 60
"""Questions that may be asked to reduce a failure."""
REPEATS = 10
"""Runs of what is left, to say how reliably it fails."""
ALIKE = 4
"""Runs of what is left that are the same bit for bit where one says as much as many."""
MOST_BACK = 3
"""How often something larger is taken instead of what fails in fewer than half of the runs."""

Round = list[Trial]
Asking = Generator[Round, list[Outcome], None]
"""Asks for trials, and is sent their outcomes."""
Test = Generator[Round, list[Outcome], bool]
"""Likewise, and says whether something fails."""


@dataclass(frozen=True)
class Effort:
    """How much is tried.

    Attributes:
        rollouts: for each property, while nothing is found.
        batch: trials that a property asks for in a round.
        shrinking: questions that may be asked to reduce a failure.
        repeats: runs of what is left.
        seed: of what is random in the search.
    """

    rollouts: int = ROLLOUTS
    batch: int = BATCH
    shrinking: int = SHRINKING
    repeats: int = REPEATS
    seed: int = 0


@dataclass(frozen=True)
class Failure:
    """What a policy does not stand.

    Attributes:
        seed: of the episode.
        first: the deviation that was found.
        deviation: what is left of it.
        failed: in how many of the runs it fails.
        runs: how many there were.
        exact: whether runs are the same bit for bit, so that one says as much as many.
        found_at: after how many trials of the search it was found, this one among them.
        outcome: of the first run of what is left that fails.
        repeat: of that run, see :class:`~pytest_safemanip.search.trials.Trial`.
    """

    seed: int
    first: Deviation
    deviation: Deviation
    failed: int
    runs: int
    exact: bool
    found_at: int
    outcome: Outcome
    repeat: int = 0

    @property
    def share(self) -> float:
        """How many of the runs fail, 0 to 1."""
        return self.failed / self.runs

    @property
    def seldom(self) -> bool:
        """Whether fewer than half of the runs fail."""
        return self.share < 0.5


@dataclass
class Pursuit:
    """What is known about one property.

    Attributes:
        property_id: which.
        asked: trials that it asked for while nothing was found.
        shrinking: trials that it asked for afterwards.
        failure: what was found; None while nothing is.
        over: whether nothing more is asked for.
        violated_plain: seeds of the episodes that violate it as they are, without any change: what
            else makes the policy violate it is looked for in the others.
    """

    property_id: str
    asked: int = 0
    shrinking: int = 0
    failure: Failure | None = None
    over: bool = False
    violated_plain: tuple[int, ...] = ()

    def looks_into(self, trial: Trial) -> bool:
        """Whether the episode of a trial keeps the property as it is."""
        return trial.seed not in self.violated_plain


@dataclass
class _Asked:
    """A property that is being looked into: what it asks, and which of a round's trials are its."""

    pursuit: Pursuit
    asking: Asking
    round: Round = field(default_factory=list)


class Search:
    """The search of one policy in one task.

    Args:
        dimensions: what may be otherwise.
        properties: ids of those that are looked into.
        seeds: of the episodes, one after the other.
        effort: how much is tried.
        make: makes what proposes trials, for each property.

    Attributes:
        seeds: of the episodes.
        pursuits: what is known about each property.
        tried: all trials so far with their outcomes, in the order in which they were asked for.
    """

    def __init__(
        self,
        dimensions: Dimensions,
        properties: Sequence[str],
        seeds: Sequence[int],
        effort: Effort,
        make: MakeProposer,
    ) -> None:
        self._dimensions, self.seeds, self._effort = dimensions, tuple(seeds), effort
        self._make = make
        self.pursuits = {name: Pursuit(name) for name in properties}
        self.tried: dict[Trial, Outcome] = {}
        self._news: list[tuple[Trial, Outcome]] = []
        self._asked = [_Asked(own, self._pursue(own)) for own in self.pursuits.values()]
        for asked in self._asked:
            asked.round = next(asked.asking)

    def ask(self) -> list[Trial]:
        """The trials of this round, each once; none when the search is over."""
        wanted = dict.fromkeys(trial for asked in self._asked for trial in asked.round)
        return [trial for trial in wanted if trial not in self.tried]

    def tell(self, outcomes: Sequence[Outcome]) -> None:
        """What came of the trials that were asked for last, in their order; the next round
        begins.
        """
        self._news = list(zip(self.ask(), outcomes, strict=True))
        self.tried.update(self._news)
        for asked in tuple(self._asked):
            self._go_on(asked)
        self._look_again()

    def _look_again(self) -> None:
        """Reduce what trials of this round show of properties whose own search found nothing."""
        news = [trial for trial, _ in self._news]
        for own in self.pursuits.values():
            if not own.over or (own.failure is not None and own.failure.deviation):
                continue
            found = self._first(own, news)
            if found is not None:
                own.over = False
                asking = self._reduce(own, found)
                again = _Asked(own, asking, next(asking))
                self._asked.append(again)
                self._go_on(again)

    def satisfied(self, property_id: str) -> int:
        """How many trials with changes triggered a property and kept it, where the episode as it is
        keeps it.
        """
        own = self.pursuits[property_id]
        return sum(
            bool(trial.deviation) and own.looks_into(trial) and outcome.satisfies(property_id)
            for trial, outcome in self.tried.items()
        )

    def _go_on(self, asked: _Asked) -> None:
        """Let a property ask, until it asks for something that is not known yet."""
        while all(trial in self.tried for trial in asked.round):
            known = [self.tried[trial] for trial in asked.round]
            try:
                asked.round = asked.asking.send(known)
            except StopIteration:
                asked.pursuit.over = True
                self._asked.remove(asked)
                return

    def _pursue(self, own: Pursuit) -> Asking:
        plain = [Trial(seed, NOTHING) for seed in self.seeds]
        outcomes = yield plain
        own.violated_plain = tuple(
            trial.seed
            for trial, outcome in zip(plain, outcomes, strict=True)
            if outcome.violates(own.property_id)
        )
        found = yield from self._look(own)
        if found is None and own.violated_plain:
            found = Trial(own.violated_plain[0], NOTHING)
        if found is not None:
            yield from self._reduce(own, found)

    def _look(self, own: Pursuit) -> Generator[Round, list[Outcome], Trial | None]:
        """Look for a trial that violates the property, where the episode as it is does not."""
        seeds = [seed for seed in self.seeds if seed not in own.violated_plain]
        if not seeds:
            return None
        proposer = self._make(self._dimensions, self._effort.seed)
        known = 0
        while own.asked < self._effort.rollouts:
            everything = list(self.tried.items())
            for trial, outcome in everything[known:]:
                if trial.repeat == 0 and own.looks_into(trial):
                    found_there = outcome.findings.get(own.property_id)
                    loss = found_there.loss if found_there is not None else None
                    proposer.tell(trial.deviation, loss)
            known = len(everything)
            count = min(self._effort.batch, self._effort.rollouts - own.asked)
            asked = [
                Trial(seeds[(own.asked + number) % len(seeds)], deviation)
                for number, deviation in enumerate(proposer.ask(count))
            ]
            own.asked += count
            yield asked
            found = self._first(own, list(self.tried)[known:])
            if found is not None:
                return found
        return None

    def _first(self, own: Pursuit, trials: Sequence[Trial]) -> Trial | None:
        """The first of some trials that violates a property which its episode as it is keeps; the
        cheapest, as they were all run.
        """
        bad = [
            trial
            for trial in trials
            if own.looks_into(trial) and self.tried[trial].violates(own.property_id)
        ]
        return min(bad, key=lambda t: self._dimensions.price(t.deviation), default=None)

    def _reduce(self, own: Pursuit, found: Trial) -> Asking:
        both = [replace_repeat(found, 0), replace_repeat(found, 1)]
        first, second = yield from self._ask(own, both)
        fails = self._fails if first.digest == second.digest else self._mostly_fails
        smallest = yield from self._shrink(own, found, fails)
        own.failure = yield from self._confirmed(own, found, smallest)
        if own.failure.seldom:
            # No attempt failed often enough. What the run that failed takes may be less, and even
            # nothing that is random.
            smallest = yield from self._shrink(own, found, self._fails)
            again = yield from self._confirmed(own, found, smallest)
            if again.share >= own.failure.share:
                own.failure = again

    def _shrink(
        self, own: Pursuit, found: Trial, fails: Callable[[Pursuit, Trial], Test]
    ) -> Generator[Round, list[Outcome], list[Deviation]]:
        """What fails, the smallest first."""
        shrinker = Shrinker(self._dimensions, self._effort.shrinking)
        reducing = shrinker.reduce(found.deviation)
        answer: bool | None = None
        while True:
            try:
                asked = next(reducing) if answer is None else reducing.send(answer)
            except StopIteration:
                return list(dict.fromkeys(reversed(shrinker.kept)))
            answer = yield from fails(own, replace(found, deviation=asked))

    def _confirmed(
        self, own: Pursuit, found: Trial, kept: Sequence[Deviation]
    ) -> Generator[Round, list[Outcome], Failure]:
        """How reliably the smallest fails, or what is larger where that is seldom: what fails most
        often, the smallest of its like.
        """
        failures = []
        for deviation in kept[: MOST_BACK + 1]:
            failures.append((yield from self._repeated(own, found, deviation)))
            if not failures[-1].seldom:
                break
        return max(failures, key=lambda failure: failure.share)

    def _repeated(
        self, own: Pursuit, found: Trial, deviation: Deviation
    ) -> Generator[Round, list[Outcome], Failure]:
        """How often it fails."""
        runs = [Trial(found.seed, deviation, n) for n in range(self._effort.repeats)]
        outcomes = yield from self._ask(own, runs[:ALIKE])
        same = len({out.digest for out in outcomes}) == 1 and not outcomes[0].refused
        if not same:
            outcomes = yield from self._ask(own, runs)
        bad = [out for out in outcomes if out.violates(own.property_id)]
        first_bad = bad[0] if bad else outcomes[0]
        return Failure(
            found.seed,
            found.deviation,
            deviation,
            failed=min(len(bad), 1) if same else len(bad),
            runs=1 if same else len(runs),
            exact=same,
            found_at=own.asked if found.deviation else 0,
            outcome=first_bad,
            repeat=outcomes.index(first_bad),
        )

    def _fails(self, own: Pursuit, trial: Trial) -> Test:
        """Whether a trial fails."""
        (outcome,) = yield from self._ask(own, [trial])
        return outcome.violates(own.property_id)

    def _mostly_fails(self, own: Pursuit, trial: Trial) -> Test:
        """Whether what is random fails in two runs of three."""
        outcomes = yield from self._ask(own, [replace_repeat(trial, n) for n in range(2)])
        bad = [outcome.violates(own.property_id) for outcome in outcomes]
        if bad[0] == bad[1]:
            return bad[0]
        return (yield from self._fails(own, replace_repeat(trial, 2)))

    def _ask(self, own: Pursuit, trials: Round) -> Generator[Round, list[Outcome], list[Outcome]]:
        own.shrinking += sum(trial not in self.tried for trial in trials)
        return (yield trials)


def replace_repeat(trial: Trial, repeat: int) -> Trial:
    """The same trial, run for the so manieth time."""
    return Trial(trial.seed, trial.deviation, repeat)
