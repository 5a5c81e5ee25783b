"""The clones of examples/cloning, with weights of their own."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pytest_safemanip.policies.registry import resolve
from tests import toy

FOLDER = Path(__file__).parents[2] / "examples" / "cloning"


@pytest.fixture
def clone(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(FOLDER)
    import features
    import policy

    random, size = np.random.default_rng(0), features.SIZE
    arrays = {"middle": np.zeros(size), "spread": np.ones(size)}
    for layer, shape in enumerate(((size, 8), (8, 12))):
        arrays[f"w{layer}"] = random.normal(size=shape)
        arrays[f"b{layer}"] = random.normal(size=shape[1])
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
    policy.reset(SimpleNamespace(task="Lift", scene=toy.SCENE))
    assert (policy.act(SimpleNamespace(index=0, step=toy.at_rest())) == first).all()
    assert again.shape == first.shape


def test_another_checkpoint_is_another_policy(clone, tmp_path, monkeypatch):
    path = tmp_path / "epoch_1.npz"
    with np.load(path) as arrays:
        changed = {key: value + 1.0 for key, value in arrays.items()}
    np.savez(path, **changed)
    assert resolve("cloned:epoch_1", {"cloned": clone.make().policy.__class__}).fingerprint != (
        clone.fingerprint
    )
