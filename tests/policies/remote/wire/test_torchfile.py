"""torch's file format without torch.

The files in ``golden`` are what ``torch.save`` (2.9.1) has written under numpy 1.26.4 and 2.4.6.
What is written here was read back by ``torch.load`` there; its parts are checked one by one below.
"""

from __future__ import annotations

import io
import os
import pickle
import pickletools
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.decoding import torchfile
from pytest_safemanip.decoding.arrays import DecodingError
from pytest_safemanip.decoding.pickled import load_pickle
from tests.policies.remote.conftest import little_memory, unpickle
from tests.policies.remote.servers import SIZES

GOLDEN = Path(__file__).parents[1] / "golden"


def golden(name):
    return (GOLDEN / f"{name}.pt").read_bytes()


@pytest.mark.parametrize("numpy", ["numpy1", "numpy2"])
def test_what_torch_has_saved_is_read(numpy):
    actions = torchfile.read(golden(f"actions_{numpy}"))
    assert list(actions) == [f"action.{part}" for part in SIZES]
    for (part, size), dtype in zip(SIZES.items(), ("f8", "f4", "f8", "f4", "f8"), strict=True):
        array = actions[f"action.{part}"]
        expected = ((np.arange(16 * size) - 20) / 100).reshape(1, 16, size).astype(dtype)
        assert array.dtype == expected.dtype
        assert (array == expected).all()
        assert array.flags.writeable
    assert torchfile.read(golden("ping")) == {"status": "ok", "message": "Server is running"}


@pytest.mark.parametrize("numpy", ["numpy1", "numpy2"])
def test_every_kind_of_value_is_read(numpy):
    found = torchfile.read(golden(f"values_{numpy}"))
    assert (found["o"], found["b"], found["s"]) == ({"a": 1}, b"x\xff", 1.5)
    assert found["t"] == [1, 2.5, None, True, -300, 2**40]
    assert found["f"].tolist() == [[0, 1, 2], [3, 4, 5]]  # Fortran order
    assert found["i"].tolist() == [0, 1, 2]  # big-endian
    assert found["e"].shape == (0, 3)
    assert found["l"][0] == np.array(True)


def test_a_modality_config_becomes_its_attributes():
    found = torchfile.read(golden("modalities"))
    assert found["action"]["__dict__"]["delta_indices"] == list(range(16))
    assert found["language"]["__dict__"]["modality_keys"] == ["annotation.human.task_description"]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("tensor", "torch._utils._rebuild_tensor_v2"),
        ("objects", "array type '|O8' is not a number"),
    ],
)
def test_tensors_and_objects_are_refused(name, what):
    with pytest.raises(DecodingError, match=what):
        torchfile.read(golden(name))


def test_what_is_written_is_what_torch_reads():
    image = np.arange(24, dtype=np.uint8).reshape(1, 1, 2, 4, 3)
    value = {"endpoint": "get_action", "data": {"video": image, "words": ["open it"]}}
    stream = io.BytesIO(torchfile.write(value))
    # The parts and their order are torch.serialization's, before it had zip files.
    assert unpickle(stream) == 0x1950A86A20F9469CFC6C
    assert unpickle(stream) == 1001
    machine = unpickle(stream)
    assert machine["little_endian"] is True
    assert machine["protocol_version"] == 1001
    found = unpickle(stream)
    assert unpickle(stream) == []
    assert stream.read() == b""
    assert found["data"]["words"] == ["open it"]
    assert found["data"]["video"].dtype == np.uint8
    assert (found["data"]["video"] == image).all()
    assert found["data"]["video"].flags.writeable


def test_a_request_names_nothing_that_one_numpy_has_and_another_has_not():
    data = torchfile.write({"a": np.zeros(3, np.float32), "b": np.zeros((1, 2), np.uint8)})
    stream, names = io.BytesIO(data), set()
    for _ in range(5):
        strings = []
        for operation, argument, _ in pickletools.genops(stream):
            if operation.name == "SHORT_BINUNICODE":
                strings.append(argument)
            elif operation.name == "STACK_GLOBAL":
                names.add(tuple(strings[-2:]))
            assert operation.proto <= 4
    assert names == {("numpy", "ndarray"), ("builtins", "bytearray")}


def saved(content, name="archive/data.pkl", compression=zipfile.ZIP_STORED):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as archive:
        archive.writestr(name, content)
    return stream.getvalue()


class Evil:
    def __init__(self, call, *arguments):
        self.call, self.arguments = call, arguments

    def __reduce__(self):
        return self.call, self.arguments


RAN = []


def run_here(*arguments):
    RAN.append(arguments)


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize(
    "evil",
    [
        Evil(os.system, "touch pwned"),
        Evil(run_here, 1),
        Evil(eval, "1"),
        Evil(getattr, "x", "__class__"),
        Evil(np.load, "pwned.npy"),
        Evil(np.ndarray, (1,), "O"),
        Evil(bytes, 2**40),
    ],
    ids=["system", "own", "eval", "getattr", "load", "ndarray", "bytes"],
)
def test_no_code_is_run_whatever_a_pickle_asks_for(protocol, evil, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for value in (evil, {"action.gripper_close": evil}, [evil]):
        data = pickle.dumps(value, protocol)
        with pytest.raises(DecodingError):
            load_pickle(data)
        with pytest.raises(DecodingError):
            torchfile.read(saved(data))
    assert list(tmp_path.iterdir()) == []
    assert RAN == []


BOMBS = {
    "a claim of 4 GB of bytes": b"\x80\x04B\xff\xff\xff\xff.",
    "a claim of 8 EB of bytes": b"\x80\x04\x8e" + b"\xff" * 7 + b"\x7f.",
    "a number of 2 GB": b"\x80\x02\x8b\xff\xff\xff\x7f.",
    "lists in lists": b"\x80\x02" + b"]" * 15_000 + b"a" * 14_999 + b".",
    "a list of itself": b"\x80\x02]q\x00h\x00a.",
    "twice the one before, fifty times": (
        b"\x80\x02]q\x00" + b"".join(b"](h%ch%ceq%c" % (n, n, n + 1) for n in range(50)) + b"."
    ),
    "one string made bytes ten thousand times": (
        b"\x80\x02c_codecs\nencode\nq\x00X" + struct.pack("<I", 2**20) + b"a" * 2**20
        + b"q\x01X\x06\x00\x00\x00latin1q\x02]" + b"h\x00h\x01h\x02\x86Ra" * 3000 + b"."
    ),
    "ten times the one before, eight times": (
        b"\x80\x02]q\x00"
        + b"".join(b"](" + b"h%c" % n * 10 + b"eq%c" % (n + 1) for n in range(8))
        + b"."
    ),
    "three million operations": b"\x80\x02" + b"N" * 3_000_000 + b".",
    "nothing": b"",
    "no end": b"\x80\x02N",
    "an empty stack": b"\x80\x02.",
    "a mark as a value": b"\x80\x02(.",
    "a class as a value": b"\x80\x02cnumpy\nndarray\n.",
    "text that is no operation": b"hello",
    "a state for a list": b"\x80\x02]N}b.",
}  # fmt: skip


@pytest.mark.parametrize("bomb", BOMBS, ids=str)
def test_a_broken_or_boundless_pickle_is_refused_in_little_memory(bomb):
    with little_memory(40e6), pytest.raises(DecodingError):
        load_pickle(BOMBS[bomb])


def test_a_memo_entry_far_away_is_one_entry():
    with little_memory(1e6):
        assert load_pickle(b"\x80\x02Nr\xff\xff\xff\xff.") is None


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (saved(b"\0" * 10**7, compression=zipfile.ZIP_DEFLATED), "is compressed"),
        (saved(b"N.", compression=zipfile.ZIP_DEFLATED), "is compressed"),
        (saved(b"N.", name="data.pkl"), "without torch's data.pkl"),
        (saved(b"N.", name="../archive/data.pkl"), "without torch's data.pkl"),
        (b"PK\x03\x04" + b"\0" * 60, "not a torch file"),
        (saved(b"N.")[:-30], "not a torch file"),
    ],
)
def test_an_archive_that_torch_would_not_write_is_refused(data, what):
    with little_memory(5e6), pytest.raises(DecodingError, match=what):
        torchfile.read(data)


def test_every_truncation_and_every_flipped_bit_is_read_or_refused():
    data = golden("actions_numpy2")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith("data.pkl"))
        content = archive.read(name)
    for end in range(0, len(content), 7):
        with pytest.raises(DecodingError):
            load_pickle(content[:end])
    random = np.random.default_rng(0)
    for position in random.integers(0, len(content), 400):
        broken = bytearray(content)
        broken[position] ^= 1 << int(random.integers(8))
        try:
            load_pickle(bytes(broken))
        except DecodingError:
            continue
