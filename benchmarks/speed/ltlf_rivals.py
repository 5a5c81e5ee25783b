"""Other monitors on the formulas of `ltlf.py`, each None where the system is not installed."""

from __future__ import annotations

import importlib
import importlib.util
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

Steps = Sequence[dict[str, bool]]


def per_second(events: int, work: Callable[[], object], repeats: int = 5) -> float:
    """Events per second in the fastest of some runs."""
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - began)
    return events / best


def ltlf2dfa_compile(formulas: Sequence[str]) -> float | None:
    """Milliseconds to compile some formulas to DOT, after a first time that loads everything."""
    if not _ltlf2dfa_works():
        return None
    parser = importlib.import_module("ltlf2dfa.parser.ltlf").LTLfParser()

    def work() -> None:
        for formula in formulas:
            parser(formula).to_dfa()

    with _private_ltlf2dfa():
        work()
        return 1e3 / per_second(1, work, 2)


def ltlf2dfa_online(formula: str, steps: Steps, *, compiled: bool) -> float | None:
    """ltlf2dfa's automaton step by step: from each state, take the edge whose guard is true."""
    if not _ltlf2dfa_works():
        return None
    with _private_ltlf2dfa():
        dot = importlib.import_module("ltlf2dfa.parser.ltlf").LTLfParser()(formula).to_dfa()
    edges: dict[str, list[tuple[Any, str]]] = {}
    for source, target, guard in re.findall(r"^ (\d+) -> (\d+) \[label=\"(.*)\"\];", dot, re.M):
        text = guard.replace("~", " not ").replace("&", " and ").replace("|", " or ")
        text = re.sub(r"\btrue\b", "True", text).strip()
        code = compile(text, "guard", "eval") if compiled else text
        edges.setdefault(source, []).append((code, target))

    def work() -> None:
        state = "1"
        for step in steps:
            for guard, target in edges[state]:
                if eval(guard, {"__builtins__": {}}, step):  # noqa: S307 (what is measured)
                    state = target
                    break

    return per_second(len(steps), work, 3)


def _ltlf2dfa_works() -> bool:
    return importlib.util.find_spec("ltlf2dfa") is not None and shutil.which("mona") is not None


@contextmanager
def _private_ltlf2dfa() -> Iterator[None]:
    """Let ltlf2dfa write its file into a folder of ours instead of its installation."""
    module: Any = importlib.import_module("ltlf2dfa.ltlf2dfa")
    before = module.PACKAGE_DIR
    with tempfile.TemporaryDirectory() as folder:
        module.PACKAGE_DIR = folder
        try:
            yield
        finally:
            module.PACKAGE_DIR = before


def rtamt_offline(formula: str, steps: Steps) -> float | None:
    """RTAMT over a whole trace; online it has no unbounded future."""
    if importlib.util.find_spec("rtamt") is None:
        return None
    specification = _rtamt("StlDiscreteTimeOfflineSpecification", formula, steps)
    signals = {atom: [float(step[atom]) for step in steps] for atom in steps[0]}
    trace = {"time": list(range(len(steps))), **signals}
    return per_second(len(steps), lambda: specification.evaluate(trace), 3)


def rtamt_online(formula: str, steps: Steps) -> float | None:
    """RTAMT step by step."""
    if importlib.util.find_spec("rtamt") is None:
        return None
    signals = [[(atom, float(value)) for atom, value in step.items()] for step in steps]

    def work() -> None:
        specification = _rtamt("StlDiscreteTimeOnlineSpecification", formula, steps)
        for index, step in enumerate(signals):
            specification.update(index, step)

    return per_second(len(steps), work, 3)


def _rtamt(kind: str, formula: str, steps: Steps) -> Any:
    specification = getattr(importlib.import_module("rtamt"), kind)()
    for atom in steps[0]:
        specification.declare_var(atom, "float")
    specification.spec = formula
    specification.parse()
    return specification


def reelay_online(formula: str, steps: Steps) -> float | None:
    """Step by step with reelay."""
    if importlib.util.find_spec("reelay") is None:
        return None
    reelay = importlib.import_module("reelay")

    def work() -> None:
        monitor = reelay.discrete_timed_monitor(
            pattern=formula, semantics="boolean", condense=False
        )
        for step in steps:
            monitor.update(step)

    return per_second(len(steps), work, 3)
