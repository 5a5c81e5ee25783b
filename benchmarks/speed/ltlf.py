"""Speed of the LTLf engine, beside other monitors on the same machine in the same run.

    python -m benchmarks.speed.ltlf

ltlf2dfa (with MONA), RTAMT and reelay are measured if they are installed. An event is one step of
one property of one instance; all systems read the same random steps. RTAMT has no unbounded future
online and reelay no future at all, so those rows monitor the past form of the formula.
"""

from __future__ import annotations

import platform
import random
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.speed import ltlf_rivals as rivals
from benchmarks.speed.ltlf_rivals import per_second
from pytest_safemanip.ltlf import Dfa, Monitor, Step, compile_formula
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.properties import Property, load_properties

RELEASE = "G (released -> F settled)"
BOUNDED = "G (released -> F[<=5] settled)"
ONSET = "G (onset -> safe)"
GRASP = "G (grasped -> (stable W released))"

RTAMT_RELEASE = "always((released >= 0.5) implies eventually(settled >= 0.5))"
RTAMT_ONSET = "historically((onset >= 0.5) implies (safe >= 0.5))"
REELAY_ONSET = "historically({onset: true} -> {safe: true})"
REELAY_GRASP = (
    "historically(!(!{stable: true} and !{released: true} and "
    "(!{released: true} since ({grasped: true} and !{released: true}))))"
)

STEPS = 600  # 30 s at 20 Hz
DT = 0.05

# How often a proposition holds in the recordings of the batch: rollouts that are mostly safe.
TRIGGERS = {"obj_released", "contaminated", "skill_onset", "mech_hit", "transfer", "reach_in"}
TRIGGERS |= {"obj_grasped", "item_in_enclosure", "place_in_onset"}
HAZARDS = {"collision", "bad_contact", "clean_contact", "insert_item"}
CONDITIONS = {"stable_grasp", "pre_safe", "fix_open"}


def random_steps(formula: str, count: int) -> list[dict[str, bool]]:
    """Random values of the atoms of a formula."""
    draw = random.Random(0)  # noqa: S311 (no secret)
    return [
        {atom: draw.random() < 0.3 for atom in compile_formula(formula).atoms} for _ in range(count)
    ]


def compile_rows(properties: Sequence[Property]) -> list[tuple[str, float | None]]:
    """Milliseconds to compile the ten templates, or for ltlf2dfa, which lacks `W`, the paper's."""

    def ours() -> None:
        for template in properties:
            compile_formula(template.formula, atoms=tuple(template.atoms), cache=False)

    began = time.perf_counter()
    ours()
    cold = time.perf_counter() - began
    theirs = rivals.ltlf2dfa_compile([str(template.paper_formula) for template in properties])
    return [
        ("this engine, first time in the process", cold * 1e3),
        ("this engine, again without its cache", 1e3 / per_second(1, ours)),
        ("ltlf2dfa and MONA, to DOT, second time", theirs),
    ]


def online_rows() -> list[tuple[str, str, float | None]]:
    """Events per second step by step: what is measured, formula, speed."""
    dfa = compile_formula(RELEASE)
    steps = random_steps(RELEASE, 200_000)
    letters = [dfa.letter(step) for step in steps]
    bounded = compile_formula(BOUNDED, dt=DT)
    onset, grasp = random_steps(ONSET, 50_000), random_steps(GRASP, 50_000)
    guards = rivals.ltlf2dfa_online
    return [
        ("this engine, loop over Dfa.rows", RELEASE, with_table(dfa, letters)),
        ("this engine, Dfa.stepper()", RELEASE, with_stepper(dfa, letters)),
        ("this engine, Monitor.step, letters", RELEASE, with_monitor(dfa, letters[:50_000])),
        ("this engine, stepper()", BOUNDED, with_stepper(bounded, letters)),
        ("this engine, Monitor.step", BOUNDED, with_monitor(bounded, letters[:50_000], None)),
        ("this engine, Monitor.step, dicts", RELEASE, with_monitor(dfa, steps[:50_000])),
        (
            "ltlf2dfa's DFA, compiled guards",
            RELEASE,
            guards(RELEASE, steps[:50_000], compiled=True),
        ),
        ("ltlf2dfa's DFA, guards as text", RELEASE, guards(RELEASE, steps[:5_000], compiled=False)),
        ("RTAMT, whole trace", RELEASE, rivals.rtamt_offline(RTAMT_RELEASE, steps[:20_000])),
        ("RTAMT", ONSET, rivals.rtamt_online(RTAMT_ONSET, onset[:10_000])),
        ("reelay", ONSET, rivals.reelay_online(REELAY_ONSET, onset)),
        ("reelay", GRASP, rivals.reelay_online(REELAY_GRASP, grasp)),
    ]


def with_table(dfa: Dfa, letters: Sequence[int]) -> float:
    """A loop of the user's own: next state and its class, for every letter."""

    def work() -> None:
        rows, classes, state = dfa.rows, dfa.classes, 0
        for letter in letters:
            state = rows[state][letter]
            _verdict = classes[state]

    return per_second(len(letters), work)


def with_stepper(dfa: Dfa, letters: Sequence[int]) -> float:
    """The function that the engine gives for live use: state and class for every letter."""

    def work() -> None:
        step = dfa.stepper()
        for letter in letters:
            step(letter)

    return per_second(len(letters), work)


def with_monitor(dfa: Dfa, steps: Sequence[Step], deadline_s: float | None = 5.0) -> float:
    """The full monitor: checks, deadline, restart, trigger, history."""

    def work() -> None:
        monitor = Monitor(dfa, dt=DT, deadline_s=deadline_s)
        for step in steps:
            monitor.step([step])

    return per_second(len(steps), work, 3)


def batch_rows(properties: Sequence[Property]) -> list[tuple[str, int, float]]:
    """Property-events per second over whole recordings: method, instances, speed."""
    rows = []
    for instances in (10_000, 1_000, 5):
        work = [(t.monitor(instances, dt=DT), recording(t, instances)) for t in properties]
        for name in ("judge", "run"):
            calls = [(getattr(monitor, name), values) for monitor, values in work]
            speed = per_second(STEPS * instances * len(work), partial(judge_all, calls))
            rows.append((f"this engine, Monitor.{name}", instances, speed))
    return rows


def bounded_rows() -> list[tuple[str, int, float]]:
    """As `batch_rows`, for one property with its time as a deadline or as a bound."""
    rows = []
    for instances in (10_000, 1_000, 5):
        draw = np.random.default_rng(0).random((STEPS, instances, 2))
        values = draw < (0.005, 0.1)
        unbounded, bounded = compile_formula(RELEASE), compile_formula(BOUNDED, dt=DT)
        for name, dfa, deadline_s in (("deadline_s", unbounded, 5.0), ("F[<=5]", bounded, None)):
            monitor = Monitor(dfa, instances, dt=DT, deadline_s=deadline_s)
            speed = per_second(STEPS * instances, partial(monitor.judge, values))
            rows.append((f"judge, 5 s as {name}", instances, speed))
    return rows


def judge_all(calls: Sequence[tuple[Any, npt.NDArray[np.bool_]]]) -> None:
    """Judge the recording of each template."""
    for call, values in calls:
        call(values)


def recording(template: Property, instances: int) -> npt.NDArray[np.bool_]:
    """Random values of a template's atoms: bool[STEPS, instances, atoms]."""
    rates = [rate(proposition.name) for proposition in template.atoms.values()]
    return np.random.default_rng(0).random((STEPS, instances, len(rates))) < np.array(rates)


def rate(proposition: str) -> float:
    """Share of the steps at which a proposition holds."""
    for names, share in ((TRIGGERS, 0.005), (HAZARDS, 0.0001), (CONDITIONS, 0.999)):
        if proposition in names:
            return share
    return 0.1  # what meets an obligation


def main() -> None:
    """Measure and print."""
    properties = list(load_properties([folder("properties")]).values())
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}\n")
    print(f"{'ten templates compiled':<38}          ms")
    for name, milliseconds in compile_rows(properties):
        print(f"{name:<38}  {shown(milliseconds, 1)}")
    rows = online_rows()
    ours = next(speed for name, _, speed in rows if "stepper" in name)
    print(f"\n{'one property, one instance':<38}   million/s  stepper() is")
    for name, formula, speed in rows:
        times = f"{ours / speed:9.1f} x" if speed and ours else " " * 11
        print(f"{name:<38}  {shown(speed and speed / 1e6, 3)}  {times}   {formula}")
    print(f"\n{f'ten templates, {STEPS} steps':<27}instances     million/s")
    for name, instances, speed in batch_rows(properties) + bounded_rows():
        print(f"{name:<27}{instances:>9}    {shown(speed / 1e6, 0)}")


def shown(number: float | None, digits: int) -> str:
    """A number, or that the system is not installed."""
    return f"{'missing' if number is None else format(number, f'.{digits}f'):>10}"


if __name__ == "__main__":
    main()
