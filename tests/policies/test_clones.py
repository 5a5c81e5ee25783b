"""The clones of examples/cloning, with weights of their own."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.registry import resolve
from tests import toy

FOLDER = Path(__file__).parents[2] / "examples" / "cloning"


@pytest.fixture
def clone(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(FOLDER)
    import features
    import policy

    random, size = np.random.default_rng(0), features.SIZE
    arrays = {"middle": np.zeros(size), "spread": np.ones(size), "longest": np.array(30)}
    for network, out in {"arm": 6, "base": 3, "switch": features.SWITCHES}.items():
        for layer, shape in enumerate(((size, 8), (8, out))):
            arrays[f"{network}/w{layer}"] = random.normal(size=shape)
            arrays[f"{network}/b{layer}"] = random.normal(size=shape[1])
    np.savez(tmp_path / "epoch_1.npz", **{f"Lift/{k}": v for k, v in arrays.items()})
    monkeypatch.setattr(policy, "FOLDER", tmp_path)
    yield resolve("cloned:epoch_1", {"cloned": policy.Cloned})
    del sys.modules["features"], sys.modules["policy"]


def test_a_checkpoint_says_its_tasks_and_acts_as_its_weights_say(clone):
    assert clone.tasks == ("Lift",)
    policy = clone.make()
    policy.reset(SimpleNamespace(task="Lift", scene=toy.SCENE))
    first, again = (policy.act(SimpleNamespace(index=0, step=toy.at_rest())) for _ in range(2))
    assert first.shape == (12,)
    assert np.abs(first).max() <= 1.0
    assert {first[6], first[11]} <= {-1.0, 0.0, 1.0}
    moved = np.flatnonzero(first[:10])
    assert set(moved) - {6} <= (set(range(7, 10)) if first[11] > 0.0 else set(range(6)))
    policy.reset(SimpleNamespace(task="Lift", scene=toy.SCENE))
    assert (policy.act(SimpleNamespace(index=0, step=toy.at_rest())) == first).all()
    assert again.shape == first.shape


def test_a_clone_is_done_a_third_later_than_the_longest_demonstration(clone):
    policy = clone.make()
    policy.reset(SimpleNamespace(task="Lift", scene=toy.SCENE))
    for index, done in ((0, False), (40, False), (41, True)):
        policy.act(SimpleNamespace(index=index, step=toy.at_rest()))
        assert policy.done is done


def test_a_switch_is_not_taken_back_at_once(clone):
    policy = clone.make()
    policy.reset(SimpleNamespace(task="Lift", scene=toy.SCENE))
    actions = [policy.act(SimpleNamespace(index=k, step=toy.at_rest())) for k in range(60)]
    told = np.array([action[[6, 11]] for action in actions])
    switched = np.flatnonzero(np.diff(told, axis=0).any(axis=1))
    assert (np.diff(switched) >= 6).all()


def test_what_shakes_the_expert_depends_on_the_seed_alone(clone):
    import shaken

    found = shaken.shakes(3, 2000)
    # A shake that has begun goes on beyond the shorter of two.
    assert (found[:1990] == shaken.shakes(3, 3000)[:1990]).all()
    assert (found != shaken.shakes(4, 2000)).any()
    sizes = np.linalg.norm(found[found.any(axis=1)], axis=1)
    assert 0.01 < found.any(axis=1).mean() < 0.12
    assert sizes == pytest.approx(np.hypot(shaken.SIZE, shaken.TURN))


def test_another_checkpoint_is_another_policy(clone, tmp_path, monkeypatch):
    path = tmp_path / "epoch_1.npz"
    with np.load(path) as arrays:
        changed = {key: value + 1.0 for key, value in arrays.items()}
    np.savez(path, **changed)
    assert resolve("cloned:epoch_1", {"cloned": clone.make().policy.__class__}).fingerprint != (
        clone.fingerprint
    )


def test_what_is_no_checkpoint_is_refused_with_those_that_are_there(clone, tmp_path):
    made = type(clone.make().policy)
    with pytest.raises(ConfigError, match=r"epoch_2\.npz is not there; checkpoints: epoch_1$"):
        made("epoch_2")
    for content in (b"", b"text", (tmp_path / "epoch_1.npz").read_bytes()[:900]):
        (tmp_path / "epoch_3.npz").write_bytes(content)
        with pytest.raises(ConfigError, match=r"epoch_3\.npz is no checkpoint: .*; train again"):
            made("epoch_3")
    np.savez(tmp_path / "epoch_4.npz", **{"Lift/middle": np.zeros(3)})
    with pytest.raises(ConfigError, match="has no Lift/spread; train again"):
        made("epoch_4")
