from __future__ import annotations

import itertools
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.policies.simple import Hold
from tests import toy

INFO = EpisodeInfo("OpenDrawer", 5, "open it", 10, toy.SCENE, toy.ROBOT)
LOCAL = ("scripted", "random", "hold")
NOW = Observation(0, "open it", toy.at_rest(), dict)

MODULE = """
    import numpy as np
    from pytest_safemanip.policies.simple import Hold

    def act(observation):
        return np.full(12, 0.1)

    class Bare:
        def act(self, observation):
            return np.full(12, 0.2)

    class Full:
        fingerprint = "weights 1"

        def __init__(self, seed=None):
            self.seed = seed

        def reset(self, episode):
            self.seed = episode.seed

        def act(self, observation):
            return np.full(12, 0.01 * self.seed)

    class Infers:
        resets = 0

        def reset(self):
            self.resets += 1

        def infer(self, observation):
            return np.full(12, 0.3 * self.resets)

    class Called:
        def __call__(self, observation):
            return np.full(12, 0.4)

    def make():
        return Full()

    class Network(Bare):
        # Can be called with anything, like PyTorch's modules.
        def __call__(self, *arguments, **named):
            raise TypeError("expected an image")

    class Holds(Hold):
        pass

    network = Network()

    class Zoo:
        bare = Bare()

    ready = Bare()
    called = Called()
    number = 3
    need = lambda weights, observation: None
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A user's module, under a name that no test has imported yet."""
    name = f"mine{next(NUMBERS)}"
    (tmp_path / f"{name}.py").write_text(textwrap.dedent(MODULE))
    (tmp_path / f"{name}_broken.py").write_text("import no_such_package_at_all\n")
    (tmp_path / f"{name}_typo.py").write_text("def act(observation:\n")
    (tmp_path / f"{name}_attr.py").write_text("object().weights\n")
    (tmp_path / f"{name}_gpu.py").write_text("raise RuntimeError('no GPU')\n")
    (tmp_path / f"{name}_args.py").write_text("raise SystemExit(2)\n")
    (tmp_path / f"{name}_skip.py").write_text(
        "import pytest; pytest.importorskip('no_gpu_at_all')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield name
    for loaded in [n for n in sys.modules if n.startswith(name)]:
        del sys.modules[loaded]


NUMBERS = itertools.count()


def first_action(spec):
    policy = spec.make()
    policy.reset(INFO)
    return policy.act(NOW)


@pytest.mark.parametrize(
    ("attribute", "value"),
    [
        ("act", 0.1),
        ("Bare", 0.2),
        ("ready", 0.2),
        ("network", 0.2),
        ("Zoo.bare", 0.2),
        ("Full", 0.05),
        ("make", 0.05),
        ("Infers", 0.3),
        ("called", 0.4),
        ("Called", 0.4),
    ],
)
def test_a_users_function_object_class_or_factory_is_a_policy(module, attribute, value):
    spec = resolve(f"{module}:{attribute}", {})
    assert first_action(spec) == pytest.approx(np.full(12, value))
    assert (spec.name, spec.tasks) == (f"{module}:{attribute}", None)


def test_every_rollout_gets_a_fresh_object_of_a_class(module):
    spec = resolve(f"{module}:Infers", {})
    assert first_action(spec)[0] == first_action(spec)[0] == pytest.approx(0.3)


def test_a_policy_that_says_its_fingerprint_is_recognised(module):
    told = resolve(f"{module}:Full", {}).fingerprint
    assert told == resolve(f"{module}:Full", {}).fingerprint is not None
    sys.modules[module].Full.fingerprint = "weights 2"
    assert resolve(f"{module}:Full", {}).fingerprint not in (told, None)
    assert resolve(f"{module}:Bare", {}).fingerprint is None


def test_a_policy_may_say_a_fingerprint_for_each_task(module):
    resolve(f"{module}:Full", {})
    full = sys.modules[module].Full
    full.fingerprint_in = lambda self, task: f"weights of {task}"
    spec = resolve(f"{module}:Full", {})
    assert len({spec.fingerprint, spec.fingerprint_in("A"), spec.fingerprint_in("B")}) == 3
    full.fingerprint_in = lambda self, task: self.weights[task]
    with pytest.raises(RolloutError, match="to say its fingerprint in A: AttributeError"):
        resolve(f"{module}:Full", {}).fingerprint_in("A")
    del full.fingerprint_in
    spec = resolve(f"{module}:Full", {})
    assert spec.fingerprint_in("A") == spec.fingerprint


def test_a_fingerprint_of_ours_says_nothing_of_a_users_subclass(module):
    assert resolve("hold", {}).fingerprint is not None
    assert resolve(f"{module}:Holds", {}).fingerprint is None


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ("{0}:Nobody", "policy '{0}:Nobody': '{0}' has no 'Nobody'"),
        ("{0}:Zoo.lion", "policy '{0}:Zoo.lion': '{0}' has no 'Zoo.lion'"),
        ("no_such_module:Policy", "cannot import 'no_such_module'"),
        ("{0}_broken:Policy", "cannot import '{0}_broken': ModuleNotFoundError: No module named"),
        ("{0}_typo:act", "cannot import '{0}_typo': SyntaxError: '(' was never closed"),
        ("{0}_attr:act", "cannot import '{0}_attr': AttributeError: 'object' object has no"),
        ("{0}_gpu:act", "cannot import '{0}_gpu': RuntimeError: no GPU"),
        ("{0}_args:act", "policy '{0}_args:act': cannot import '{0}_args': SystemExit: 2"),
        ("{0}_skip:act", "cannot import '{0}_skip': Skipped: could not import 'no_gpu_at_all'"),
        ("a..b:Policy", "cannot import 'a..b'"),
        (":Policy", "policy ':Policy': "),
        (".relative:Policy", "policy '.relative:Policy': "),
    ],
)
def test_what_cannot_be_imported_is_refused_before_anything_runs(module, form, message):
    with pytest.raises(ConfigError) as caught:
        resolve(form.format(module), {})
    assert message.format(module) in str(caught.value)


OUTCOMES = {
    "SystemExit: 3": lambda *given: sys.exit(3),
    "Skipped: no GPU": lambda *given: pytest.skip("no GPU"),
    "XFailed: known": lambda *given: pytest.xfail("known"),
    "Failed: bad": lambda *given: pytest.fail("bad"),
}


@pytest.mark.parametrize("what", OUTCOMES)
def test_a_policy_does_not_decide_on_the_outcome_of_its_cases(what):
    class Decides:
        act = reset = OUTCOMES[what]

    class Says(Mine):
        fingerprint = property(OUTCOMES[what])

    policy = resolve("mine", {"mine": Decides}).make()
    with pytest.raises(RolloutError, match=f"the policy failed at reset: {what}"):
        policy.reset(INFO)
    with pytest.raises(RolloutError, match=f"the policy failed at step 0: {what}"):
        policy.act(NOW)
    with pytest.raises(ConfigError, match=rf"policy 'mine': cannot be made: {what}"):
        resolve("mine", {"mine": OUTCOMES[what]})
    with pytest.raises(ConfigError, match=rf"policy 'mine': its 'fingerprint' failed: {what}"):
        resolve("mine", {"mine": Says})


@pytest.mark.parametrize("attribute", ["act", "staging", "fingerprint_in", "scenes"])
@pytest.mark.parametrize("error", [AttributeError, ValueError])
def test_a_property_that_raises_is_refused_with_its_name(attribute, error):
    def fails(self):
        raise error("no weights")

    policy = type("Fails", (Mine,), {attribute: property(fails)})
    message = f"policy 'mine': its '{attribute}' failed: {error.__name__}: no weights"
    for given in (policy, policy()):
        with pytest.raises(ConfigError, match=message):
            resolve("mine", {"mine": given})


@pytest.mark.parametrize("tasks", [5, "OpenDrawer", [5]])
def test_tasks_that_are_no_list_of_names_are_refused(tasks):
    policy = type("Tasked", (Mine,), {"tasks": tasks})
    with pytest.raises(ConfigError, match=r"policy 'mine': its 'tasks' are .*a list of names"):
        resolve("mine", {"mine": policy})


@pytest.mark.parametrize("ending", [KeyboardInterrupt, pytest.exit.Exception])
def test_what_ends_the_run_is_left_alone(ending):
    def act(observation):
        raise ending("enough")

    with pytest.raises(ending):
        resolve("mine", {"mine": act}).make().act(NOW)


def test_what_is_no_policy_is_refused_with_what_is_missing(module):
    with pytest.raises(ConfigError, match=r"int has no 'act\(observation\)' and cannot be called"):
        resolve(f"{module}:number", {})


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("scriptd", "did you mean 'scripted'?"),
        ("my_own_polcy", "did you mean 'my_own_policy'?"),
        ("xyz", "nearest of 17: my_own_policy, vla-eval, scripted"),
    ],
)
def test_an_unknown_policy_is_refused_with_a_near_miss_and_the_way_to_ones_own(name, hint):
    with pytest.raises(ConfigError) as caught:
        resolve(name, {"my_own_policy": object})
    assert str(caught.value) == f"unknown policy {name!r}; {hint} (your own: MODULE:ATTRIBUTE)"


@pytest.mark.parametrize("name", ["", "a b", "a[b]", "a\nb", "a,b", "x" * 201])
def test_a_name_that_cannot_be_part_of_an_id_is_refused(name):
    with pytest.raises(ConfigError, match="a name has letters, digits and any of"):
        resolve(name, {name: object})


@pytest.mark.parametrize("name", [*LOCAL, "mine"])
def test_a_policy_from_a_hook_comes_before_what_is_built_in(name):
    policy = resolve(name, {name: lambda: Mine(5)}).make()
    assert policy.act(NOW) == 5


class Mine:
    def __init__(self, value=7):
        self.value = value

    def act(self, observation):
        return self.value


@pytest.mark.parametrize("given", [Mine, Mine(), lambda: Mine().act, lambda _: 7])
def test_a_hook_may_give_what_an_option_may_name(given):
    policy = resolve("mine", {"mine": given}).make()
    policy.reset(None)
    assert policy.act(NOW) == 7


@pytest.mark.parametrize("name", LOCAL)
def test_what_is_built_in_is_recognised_in_a_later_run(name):
    assert resolve(name, {}).fingerprint == resolve(name, {}).fingerprint is not None


def test_the_script_knows_its_tasks_and_an_unknown_fault_is_refused():
    expert, fault = resolve("scripted", {}), resolve("scripted:half_inside", {})
    assert "PickPlaceCounterToCabinet" in fault.tasks
    assert set(fault.tasks) < set(expert.tasks)
    with pytest.raises(ConfigError, match="'scripted:half_insid'; did you mean 'half_inside'"):
        resolve("scripted:half_insid", {})
    with pytest.raises(ConfigError, match="has no plan for Juggle; it knows CloseFridge"):
        expert.make().reset(EpisodeInfo("Juggle", 0, "", 1, toy.SCENE, toy.ROBOT))


def test_the_script_comes_through_the_door_of_everybody():
    where = "pytest_safemanip.faults.policy:Scripted"
    for name in ("half_inside", "drop_high"):
        shipped = resolve(f"scripted:{name}", {})
        mine = resolve(f"mine:{name}", {"mine": where})
        assert mine.tasks == shipped.tasks
        assert {t: mine.staging(t) for t in mine.tasks} == {
            t: shipped.staging(t) for t in shipped.tasks
        }
    code = (
        "import sys, pytest_safemanip.run.plan; "
        "sys.exit(any('pytest_safemanip.expert' in name for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(("name", "library"), [("pi05", "websockets"), ("groot", "zmq")])
def test_a_missing_library_is_said_before_anything_runs(name, library, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ConfigError, match=rf"needs '{library}': pip install '.*\[servers\]'"):
        resolve(name, {})


def test_presets_bring_their_scenes_and_servers():
    spec = resolve("groot-to", {}, {"groot-to": "atomic_seen@a+composite_seen@b:7"})
    assert (spec.scenes, spec.fingerprint) == ("target", None)
    assert str(spec.server("OpenDrawer", ("quick", "atomic_seen"))) == "tcp://a:5555"
    assert str(spec.server("Wash", ("composite_seen",))) == "tcp://b:7"
    with pytest.raises(RolloutError, match="no server is given for Mine, which is in no task set"):
        spec.server("Mine", ())
    assert spec.claim["claimed_checkpoints"].keys() == {"atomic_seen", "composite_seen"}
    assert resolve("openpi", {}).scenes == ""


def test_local_policies_are_stepped_fast_and_those_on_servers_exactly(module):
    local = ("scripted", "scripted:drop_high", "random", "hold", f"{module}:act", "mine")
    assert {resolve(name, {"mine": Hold}).stepping for name in local} == {"fast"}
    assert {resolve(name, {}).stepping for name in ("pi05", "groot", "openpi")} == {"exact"}
