"""Every proposition obeys every law; each law catches a proposition that does not."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, settings

from pytest_safemanip.fuzz.laws import LAWS, laws_of
from pytest_safemanip.fuzz.search import find_counterexample
from pytest_safemanip.fuzz.trial import LawBroken, shortened
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import Parameter, Proposition
from pytest_safemanip.propositions.grasp import pressed
from pytest_safemanip.propositions.kernels.filters import held

BY_NAME = {law.name: law for law in LAWS}
CATALOGUE = Catalogue()
PARAMETERS = shortened(CATALOGUE, {})
NEWTONS = Parameter("own.force", "N", 3.0, "for the test")


@pytest.fixture
def laws(pytestconfig):
    """How many recordings each law is tried on; None for a few."""
    return pytestconfig.getoption("--laws")


@pytest.mark.parametrize(
    ("proposition", "law"),
    [
        pytest.param(proposition, law, id=f"{proposition.name}-{law.name}")
        for proposition in SHIPPED
        for law in laws_of(proposition)
    ],
)
def test_shipped_propositions_obey(proposition, law, laws):
    found = find_counterexample(proposition, law, CATALOGUE, PARAMETERS, examples=laws or 3)
    assert found is None, found.error


def test_what_a_proposition_is_exempt_from_is_a_law():
    for proposition in SHIPPED:
        assert set(proposition.exempt) <= set(BY_NAME)


def grasped(view, o):
    return view("obj_grasped", o)


def number(view, o):
    return view.trace.scene.object_index[o]


def since_ever(view, o):
    return np.maximum.accumulate(grasped(view, o))


def from_the_left(view, o):
    found, contacts = np.zeros(len(view.trace), bool), view.trace.steps.contacts
    parts = [part.entity for part in view.trace.scene.parts]
    rows = [row for row, b in enumerate(contacts.b) if parts[b] == o]
    found[contacts.step[rows]] = True
    return found


def in_a_band(view, o):
    limit = view.parameters["own.force"]
    force = view.trace.pair_table.force(
        set(view.trace.scene.parts_of("robot")), set(view.trace.scene.parts_of(o))
    )
    return (force >= limit) & (force < 3 * limit)


def ratio(view, o):
    twist = view.trace.steps.object_twist[:, number(view, o)]
    return np.asarray(twist[:, 0] / twist[:, 1] > 1.0)


def uneven(view, o):
    return np.arange(len(view.trace)) % 2 == 0


def graded(view, o):
    """Wrong where it is false."""
    return np.where(pressed(view, o), view.margin("obj_grasped", o), 0.5)


BROKEN = {
    "total": (lambda view, o: grasped(view, o).astype(int), 0.25),
    "causal": (lambda view, o: np.full(len(view.trace), grasped(view, o).any()), math.inf),
    "window": (since_ever, 0.25),
    "online": (since_ever, math.inf),
    "part": (lambda view, o: grasped(view, o) & (view.since == 0), 0.25),
    "margin": (pressed, 0.25),
    "permutation": (
        lambda view, o: grasped(view, o) & (o == min(view.trace.scene.object_index)),
        0.25,
    ),
    "swap": (from_the_left, 0.0),
    "sign": (lambda view, o: view.trace.steps.object_pose[:, number(view, o), 3] > 0.0, 0.0),
    "motion": (lambda view, o: (view.trace.steps.eef_poses[..., 0] > 0.1).any(axis=1), 0.0),
    "stranger": (
        lambda view, o: np.full(len(view.trace), len(view.trace.scene.bodies) % 2 == 0),
        0.0,
    ),
    "force": (in_a_band, 0.0),
    "flicker": (pressed, 0.25),
    "rate": (lambda view, o: held(pressed(view, o), 5), 0.5),
    "unobserved": (grasped, 0.25),
    "numbers": (ratio, 0.0),
}


@pytest.fixture
def unshrunk():
    """The first counterexample will do."""
    settings.register_profile("unshrunk", phases=[Phase.generate], database=None)
    before = settings.get_current_profile_name()
    settings.load_profile("unshrunk")
    yield
    settings.load_profile(before)


@pytest.mark.usefixtures("unshrunk")
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_law_catches_what_breaks_it(law):
    evaluate, window = BROKEN[law.name]
    own = Proposition(
        "own",
        ("object",),
        lambda _: window,
        (NEWTONS,),
        evaluate,
        debounce=lambda _: 0.25,
        sparse=True,
        reads=lambda inputs, o: inputs.poses(o),
        margin=graded,
    )
    catalogue = Catalogue([own])
    found = find_counterexample(own, law, catalogue, shortened(catalogue, {}), examples=2000)
    assert found is not None
    if law.name != "total":
        assert isinstance(found.error, LawBroken)


def since_then(view, o):
    """Its sign is right, but it looks farther back than the value."""
    found = np.where(pressed(view, o), 1.0, -1.0)
    return found * np.arange(1, len(found) + 1)


def by_length(view, o):
    """Its sign is right, but it looks at how long the trace is."""
    return np.where(pressed(view, o), 1.0, -1.0) * len(view.trace)


@pytest.mark.usefixtures("unshrunk")
@pytest.mark.parametrize(
    ("margin", "says"),
    [
        (graded, "False, but its margin is 0.5"),
        (since_then, "step by step|outside its window|online, asked for at the end"),
        (by_length, "without the steps from"),
    ],
)
def test_a_margin_that_is_less_local_than_its_value_is_found(margin, says):
    own = Proposition("own", ("object",), lambda _: 0.0, (), pressed, margin=margin)
    catalogue = Catalogue([own])
    parameters = shortened(catalogue, {})
    found = find_counterexample(own, BY_NAME["margin"], catalogue, parameters, examples=500)
    assert re.search(says, str(found.error))


def ahead(base, seconds, of=lambda view, o: True):
    """What another proposition will be so much later; ``of`` says for which objects."""

    def evaluate(view, o):
        values = base(view, o)
        count = view.trace.count(seconds) if of(view, o) else 0
        return np.append(values[count:], np.repeat(values[-1:], count))[: len(values)]

    return evaluate


def vessel(view, o):
    return "container" in view.binding.attributes[o]


def lifted(view, o):
    return view.trace.steps.object_pose[:, number(view, o), 2] > 1.0


def ever(view, o):
    return np.full(len(view.trace), lifted(view, o).any())


def until(view, o):
    return np.logical_or.accumulate(grasped(view, o)[::-1])[::-1]


def settles(view, o):
    return view("settled", o)


ACAUSAL = {
    "a step, grasped": ahead(grasped, 0.0),
    "a step, settled": ahead(settles, 0.0),
    "0.25 s, lifted": ahead(lifted, 0.25),
    "2 s, grasped": ahead(grasped, 2.0),
    "2 s, lifted": ahead(lifted, 2.0),
    "2 s, settled": ahead(settles, 2.0),
    "2 s, vessels only": ahead(lifted, 2.0, vessel),
    "0.25 s, third object only": ahead(grasped, 0.25, lambda view, o: number(view, o) == 2),
    "at any time": ever,
    "from now on": until,
}


@pytest.mark.usefixtures("unshrunk")
@pytest.mark.parametrize("shape", ACAUSAL)
def test_what_looks_ahead_is_found_with_a_hundred_recordings(shape, laws, monkeypatch):
    own = Proposition("own", ("object",), lambda _: math.inf, (), ACAUSAL[shape])
    catalogue = Catalogue([own])
    for seed in range(10 if laws else 2):
        monkeypatch.setattr("hypothesis.core.global_force_seed", seed)
        found = find_counterexample(
            own, BY_NAME["causal"], catalogue, shortened(catalogue, {}), examples=100
        )
        assert found is not None, f"not with seed {seed}"
        assert isinstance(found.error, LawBroken)


def test_a_sparse_proposition_may_ask_sparse_ones_and_others():
    def evaluate(view, o):
        asked = [view(name, o) for name in ("settled", "obj_grasped")]
        asked += [view("pre_safe", *call) for call in view.binding.skills]
        found = np.zeros(len(view.trace), bool)
        wanted = slice(view.since, view.until)
        found[wanted] = np.any(asked, axis=0)[wanted]
        return found

    own = Proposition("own", ("object",), lambda _: 3.0, (), evaluate, sparse=True)
    catalogue = Catalogue([own])
    for law in laws_of(own):
        found = find_counterexample(own, law, catalogue, shortened(catalogue, {}), examples=20)
        assert found is None, found.error


@pytest.mark.usefixtures("unshrunk")
def test_a_sparse_proposition_that_changes_another_one_is_found():
    def evaluate(view, o):
        view("settled", o)[: view.since] = True
        return view("obj_grasped", o)

    own = Proposition("own", ("object",), lambda _: 0.25, (), evaluate, sparse=True)
    catalogue = Catalogue([own])
    found = find_counterexample(
        own, BY_NAME["part"], catalogue, shortened(catalogue, {}), examples=2000
    )
    assert "settled(obj) is different at step 0 once own was asked for steps" in str(found.error)


def test_what_a_proposition_raises_is_a_counterexample_too():
    def evaluate(view, o):
        if len(view.trace) == 3:
            raise IndexError("three")
        return grasped(view, o)

    own = Proposition("own", ("object",), lambda _: 0.25, (), evaluate)
    catalogue = Catalogue([own])
    found = find_counterexample(
        own, BY_NAME["total"], catalogue, shortened(catalogue, {}), examples=2000
    )
    assert isinstance(found.error, IndexError)
    assert len(found.recording.steps) == 3


def test_windows_fit_into_generated_recordings():
    seconds = {p.name for q in SHIPPED for p in q.parameters if p.unit == "s"}
    # All but the time constants, which are no windows, and are reached by and by.
    assert max(PARAMETERS[name] for name in seconds - {"hot.heating", "hot.cooling"}) < 1.1
    assert shortened(CATALOGUE, {"settled.speed": 0.5})["settled.speed"] == 0.5


def test_the_manual_says_every_law():
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
    for law in LAWS:
        assert f"| `{law.name}` | {law.says} |" in page
