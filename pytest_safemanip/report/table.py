"""The summary that a run ends with, as lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from textwrap import wrap

from pytest_safemanip.metrics.comparability import NOT_COMPARABLE
from pytest_safemanip.metrics.groups import Group, Metrics
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, by_policy, severity
from pytest_safemanip.report.floor import floor_lines
from pytest_safemanip.report.numbers import (
    MIN_WIDTH,
    aligned,
    counted,
    fitted,
    fraction,
    percent,
    share,
    spread,
)
from pytest_safemanip.report.questions import question_lines

MOST_TABLES = 4
"""Policies that have a table each; of more, one wants to see them side by side."""
MOST_FAILURES = 5
"""Rollouts in which the policy gave up that are listed with its reason."""
_ELSEWHERE = (
    "",
    f"a table for each policy: of up to {MOST_TABLES} policies, and in summary.json",
)
THESE_TASKS, NEW_TASKS = "95 % CI\n(these tasks)", "95 % CI\n(new tasks,\nclustered)"
LEGEND = (
    "95 % CI: Wilson's for these tasks; for new tasks like these, clustered by task",
    "(< x) beside a zero: the rate is below x at 95 %, for these tasks",
)
_SHARES = {
    "success": "success_rate",
    "violation": "violation_rate",
    "unsafe successes": "unsafe_share_of_successes",
    "exposure": "exposure",
}
_VERDICTS = {
    "VIOLATED": "violated",
    "UNRESOLVED": "unresolved",
    "SATISFIED": "kept",
    "VACUOUS": "never triggered",
}
_COLUMNS = ("category (tasks)", "triggered", "violated", "rate", "95 % CI", "exposure")


def summary_lines(
    records: Sequence[RolloutRecord],
    metrics: Mapping[str, Metrics],
    width: int = 80,
    elsewhere: Collection[str] = (),
    floor: Sequence[RolloutRecord] = (),
) -> list[str]:
    """Metrics of each policy, then all policies side by side.

    Args:
        records: the rollouts.
        metrics: of each policy.
        width: columns of the terminal; wider tables are shown in blocks.
        elsewhere: the policies whose rollouts are on stand-in assets.
        floor: demonstrations, beside whose rates each policy's are shown.
    """
    lines: list[str] = []
    policies = by_policy(records)
    few = len(policies) <= MOST_TABLES
    for policy, own in policies.items():
        head, *more = _policy_lines(policy, metrics[policy], own, few)
        more += floor_lines(metrics[policy], floor, width) if floor else []
        lines += [*fitted(_noted(head, policy, elsewhere), width, 2), *more, *([""] if few else [])]
    lines += [] if few else [*_ELSEWHERE, ""]
    if not any(found.total.complete > 1 for found in metrics.values()):
        return lines[:-1]
    return [*lines, *question_lines(metrics, width), *LEGEND, *_tail_line(records)]


def _tail_line(records: Sequence[RolloutRecord]) -> list[str]:
    """That exposure leaves steps out, where some of them are unsafe."""
    late = sum(
        violation["last"] >= record.acting_steps
        for record in records
        for verdict in record.properties.values()
        for violation in verdict.violations
    )
    whose = f"in which {counted(late, 'violation')} {'is or goes' if late == 1 else 'are or go'} on"
    return [f"exposure leaves out the settle tail, {whose}"] if late else []


def brief_lines(
    records: Sequence[RolloutRecord],
    metrics: Mapping[str, Metrics],
    elsewhere: Collection[str] = (),
) -> list[str]:
    """A line for each policy."""
    lines = []
    for policy, own in by_policy(records).items():
        total = metrics[policy].total
        violated = total.shares["violation_rate"]
        line = f"{policy}: {total.complete} of {counted(len(own), 'rollout')} complete"
        if total.complete == 1:
            line += f", {'successful' if total.shares['success_rate'].hits else 'no success'}"
            line += f", {'violated' if violated.hits else 'not violated'}"
        elif total.complete:
            line += f", {percent(total.shares['success_rate'].value)} successful"
            line += f", {percent(violated.value)} violated ({spread(violated.interval())})"
        stopped = sum(bool(record.warned) for record in own if record.complete)
        line += f", {stopped} stopped before a violation" if stopped else ""
        gave_up = [record.failure for record in own if record.complete and record.failure]
        if gave_up and total.complete == 1:
            line += f"; gave up: {gave_up[0]}"
        elif gave_up:
            line += f", {len(gave_up)} gave up"
        lines.append(_noted(line, policy, elsewhere))
    return lines


def _noted(line: str, policy: str, elsewhere: Collection[str]) -> str:
    return f"{line}; {NOT_COMPARABLE}" if policy in elsewhere else line


def _policy_lines(
    policy: str, metrics: Metrics, records: Sequence[RolloutRecord], tables: bool
) -> list[str]:
    total = metrics.total
    about = f" of {counted(total.tasks, 'task')}" if total.complete else ""
    lines = [f"{policy}: {counted(total.complete, 'complete rollout')}{about}{_others(records)}"]
    lines += _restart_lines(records)
    if total.complete <= 1:
        return [*lines, *_one_lines([r for r in records if r.complete and not r.unjudged])]
    served = [
        *_served_lines([record for record in records if "protocol" in record.served]),
        *_clipped_lines([record for record in records if "protocol" not in record.served]),
    ]
    served += [*_truncated_lines(records), *_warned_lines(records), *_failure_lines(records)]
    if not tables:
        rate = total.shares["violation_rate"]
        found = f"violated {fraction(rate)}, {share(rate)}, 95 % CI {spread(rate.interval())}"
        return [*lines, f"  {found}", *served, *_unresolved_line(metrics.categories)]
    counts = [f"{n} {name.replace('_', ' ')}" for name, n in total.outcomes.items()]
    return [
        *lines,
        *(f"  {line}" for line in _share_table(total)),
        f"  outcomes  {', '.join(counts[:2])},",
        f"            {', '.join(counts[2:])}",
        *_severity_lines(total, records),
        *served,
        "",
        *(f"  {line}" for line in _group_table(metrics.categories)),
        *_unresolved_line(metrics.categories),
    ]


def _severity_lines(total: Group, records: Sequence[RolloutRecord]) -> list[str]:
    """How severe violations are, if there are some of which that is known."""
    known = [
        (severity(violation), verdict.property)
        for record in records
        if record.complete and not record.unjudged
        for verdict in record.properties.values()
        for violation in verdict.violations
        if "severity" in violation
    ]
    if not known:
        return []
    worst, whose = max(known)
    middle = total.figures["median_severity"]
    rates = [
        f"{fraction(rate)} at {bound:g} or more"
        for bound, rate in total.severe.items()
        if rate.hits
    ]
    return [
        f"  severity  at worst {worst:.2f} ({whose}), median {middle:.2f}",
        *([f"            rollouts with {', '.join(rates)}"] if rates else []),
        *_cost_line(total),
    ]


def _cost_line(total: Group) -> list[str]:
    mean, most = total.figures["mean_cost"], total.figures["max_cost"]
    if mean is None or most is None:
        return []
    return [f"  cost      {mean:.2f} a rollout, {most:.2f} at most"]


def _told(verdict: PropertyRecord) -> str:
    """A property with the severity of its worst violation, if it has one."""
    found = max(map(severity, verdict.violations), default=0.0)
    return f"{verdict.property} ({found:.2f})" if found else verdict.property


def _one_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """What a single rollout came to: there is nothing to compute a rate from."""
    lines: list[str] = []
    for record in records:
        outcomes: dict[str, list[str]] = {}
        ranked = sorted(
            record.properties.values(),
            key=lambda verdict: -max(map(severity, verdict.violations), default=0.0),
        )
        for verdict in ranked:
            outcomes.setdefault(verdict.outcome, []).append(_told(verdict))
        success = "success" if record.success else "fail"
        safety = "unsafe" if "VIOLATED" in outcomes else "safe"
        joined = "and" if record.success == (safety == "safe") else "but"
        lines.append(f"  outcome          {success} {joined} {safety}")
        for name, label in _VERDICTS.items():
            names = ", ".join(outcomes.get(name, []))
            lines += fitted(f"  {label:<15}  {names}", MIN_WIDTH, 17) if names else []
        lines += _served_lines([record] if "protocol" in record.served else [])
        lines += _clipped_lines([] if "protocol" in record.served else [record])
        if record.warned:
            lines += fitted(f"  {'stopped before':<15}  {record.warned}", MIN_WIDTH, 19)
        if record.failure:
            lines += fitted(f"  {'gave up':<15}  {record.failure}", MIN_WIDTH, 19)
    return lines


def _others(records: Sequence[RolloutRecord]) -> str:
    """Rollouts that count in no rate."""
    failed = sum(bool(record.error) for record in records)
    left = sum(
        not record.error and not (record.complete and not record.unjudged) for record in records
    )
    failures = f", {failed} with errors" if failed else ""
    if blamed := sum(record.infrastructure for record in records):
        failures += f" ({blamed} for failures of the infrastructure)"
    return failures + (f", {left} not run to the end" if left else "")


def _restart_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """That a server failed on the way, though verdicts stand on whole episodes only."""
    restarts = sum(record.restarts for record in records)
    if not restarts:
        return []
    among = counted(sum(record.restarts > 0 for record in records), "rollout")
    times = counted(restarts, "time")
    return [f"  restarts   {among} begun again, {times} in all: the server was lost or too slow"]


def _share_table(total: Group) -> list[str]:
    rows = [("", "", "rate", THESE_TASKS, NEW_TASKS)]
    for label, name in _SHARES.items():
        rate = total.shares[name]
        defined = rate.value is not None
        counts = fraction(rate) if name != "exposure" else ""
        rows.append(
            (
                label,
                counts if defined else "undefined",
                share(rate) if defined else "",
                spread(rate.interval()) if defined else "",
                spread(rate.clustered()) if defined else "",
            )
        )
    return aligned(rows)


def _served_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """What was exchanged with a policy's server, and what is not known about it."""
    served = [record.served for record in records]
    if not served:
        return []
    protocols = ", ".join(dict.fromkeys(facts["protocol"] for facts in served))
    calls, actions, clipped = (
        sum(int(facts[name]) for facts in served) for name in ("calls", "actions", "clipped")
    )
    entries = sum(_width(facts) * int(facts["actions"]) for facts in served)
    lines = [
        f"  server     {protocols}; {counted(calls, 'call')}, {counted(actions, 'action')}, "
        f"{clipped} of their {entries} entries",
        "             outside [-1, 1] and clipped",
    ]
    if any(facts["seeded"] == "no" for facts in served):
        lines.append("  seeds      of the simulator only: the server takes none")
    return lines


def _width(served: Mapping[str, str]) -> int:
    """Entries of an action; of a recording that does not say it, RoboCasa's."""
    return int(served.get("entries", 12))


def _clipped_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """That a policy in this process asked for more than there is."""
    clipped = sum(int(record.served.get("clipped", 0)) for record in records)
    if not clipped:
        return []
    width = next(_width(record.served) for record in records if "clipped" in record.served)
    entries = width * sum(record.acting_steps - 1 for record in records if record.complete)
    return [f"  actions    {clipped} of {entries} entries outside [-1, 1] and clipped"]


def _truncated_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """How many recordings end without a settle tail."""
    truncated = sum(record.truncated for record in records if record.complete)
    if not truncated:
        return []
    return [f"  truncated  {counted(truncated, 'recording')} without a settle tail"]


def _warned_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """How many rollouts a warning ended, and what was near in how many of them."""
    warned = [record.warned for record in records if record.complete and record.warned]
    if not warned:
        return []
    near = Counter(text.partition(" ")[0] for text in warned)
    rules = ", ".join(f"{name} {count}" for name, count in near.most_common())
    stopped = counted(len(warned), "rollout")
    return fitted(f"  stopped    {stopped} before a violation: {rules}", MIN_WIDTH, 13)


def _failure_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """Of rollouts in which the policy gave up, the first few with the reason that it gave."""
    failed = [record for record in records if record.complete and record.failure]
    lines = [
        line
        for record in failed[:MOST_FAILURES]
        for line in fitted(
            f"  gave up    {record.task} seed {record.seed}: {record.failure}", MIN_WIDTH, 13
        )
    ]
    more = len(failed) - MOST_FAILURES
    return lines + ([f"  gave up    {more} more, see `safemanip show`"] if more > 0 else [])


def _group_table(groups: Mapping[str, Group]) -> list[str]:
    """One row per category; what was never triggered was not tested, and has no rate."""
    rows: list[tuple[str, ...]] = [_COLUMNS]
    for name, group in groups.items():
        label, triggered = f"{name} ({group.tasks})", group.shares["triggered_rate"]
        violated = group.shares["violation_rate"]
        if not group.triggered:
            rows.append((label, "never", *["-"] * (len(_COLUMNS) - 2)))
            continue
        rows.append(
            (
                label,
                fraction(triggered),
                fraction(violated),
                percent(violated.value),
                spread(violated.interval()),
                percent(group.shares["exposure"].value),
            )
        )
    return aligned(rows)


def _unresolved_line(groups: Mapping[str, Group]) -> list[str]:
    """How many verdicts were left open by the end of their rollouts, if some were."""
    counts = [f"{name} {group.unresolved}" for name, group in groups.items() if group.unresolved]
    return (
        wrap(
            f"unresolved: {', '.join(counts)}",
            MIN_WIDTH,
            initial_indent="  ",
            subsequent_indent="    ",
        )
        if counts
        else []
    )
