from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.remote.wire.dumps import dump


def read(path):
    with np.load(path, allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays}


def test_an_exchange_is_kept_value_by_value_without_pickle(tmp_path):
    request = {"image": np.arange(6, dtype=np.uint8).reshape(2, 3), "prompt": "open", "n": {"x": 1}}
    reply = {b"actions": np.array([np.nan]), "odd": [None, {}], "big": 2**100, "raw": b"\x00\xff"}
    found = read(dump(tmp_path / "new" / "folder", request, reply))
    assert found["request/image"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert (found["request/prompt"], found["request/n/x"]) == ("open", 1)
    assert np.isnan(found["reply/actions"][0])
    assert (found["reply/odd"], found["reply/big"]) == ("[None, {}]", str(2**100))
    assert found["reply/raw"].tolist() == [0, 255]


def test_what_could_not_be_decoded_is_kept_as_it_came(tmp_path):
    assert read(dump(tmp_path, {}, b"\x93NUM"))["reply"].tobytes() == b"\x93NUM"
    assert read(dump(tmp_path, {}, "Traceback"))["reply"] == "Traceback"
    assert len(list(tmp_path.iterdir())) == 2


def test_names_from_a_server_stay_within_the_file(tmp_path):
    nested = {"x": 1}
    for _ in range(50):
        nested = {"deep": nested}
    path = dump(tmp_path / "dumps", {}, {"../../evil": 1, "/abs": 2, "n" * 5000: 3, **nested})
    assert [p.name for p in tmp_path.iterdir()] == ["dumps"]
    names = list(read(path))
    assert "reply/..|..|evil" in names
    assert max(map(len, names)) < 200


def test_objects_never_get_into_a_file(tmp_path):
    found = read(dump(tmp_path, {"o": np.array([print], dtype=object)}, {"e": Exception("x")}))
    assert all(array.dtype.kind in "biufU" for array in found.values())
