"""Messages from a server that means no good: refused, in little memory, without a crash."""

from __future__ import annotations

import io
import struct

import msgpack
import numpy as np
import pytest

from pytest_safemanip.decoding.arrays import DecodingError, npy_array, npy_bytes
from pytest_safemanip.policies.remote.wire import packing
from tests.policies.remote import servers
from tests.policies.remote.conftest import little_memory

WAYS = {
    "openpi": (
        packing.from_openpi,
        lambda dtype, shape, data: {
            b"__ndarray__": True, b"data": data, b"dtype": dtype, b"shape": shape,
        },
    ),
    "vla-eval": (
        packing.from_vlaeval,
        lambda dtype, shape, data: {
            "__ndarray__": True, "data": data, "dtype": dtype, "shape": shape,
        },
    ),
    "groot": (
        packing.from_groot,
        lambda dtype, shape, data: {
            "__ndarray_class__": True, "as_npy": servers.npy(data, tuple(shape), dtype),
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("dtype", "shape", "data"),
    [
        ("|O", [2], b"\x41" * 16),
        ("O", [1], b"\x41" * 8),
        ("|V8", [1], b"\0" * 8),
        ("<c16", [1], b"\0" * 16),
        ("<U4", [1], b"\0" * 16),
        ("<M8[s]", [1], b"\0" * 8),
        ("(1000000000,)f8", [1], b"\0" * 8),
        ("f4,f4", [1], b"\0" * 8),
        ("<f4", [1], b""),
        ("<f4", [2], b"\0" * 4),
        ("<f4", [1], b"\0" * 8),
        ("<f4", [2**40], b"\0" * 4),
        ("<f4", [-1], b"\0" * 4),
        ("<f4", [2**33, 2**33], b"\0" * 4),
        ("<f4", [1] * 9, b"\0" * 4),
        ("<f4", [0, 2**60], b""),
        ("", [1], b"\0" * 4),
    ],
)
def test_an_array_that_is_not_numbers_or_not_there_is_refused(way, dtype, shape, data):
    hook, build = WAYS[way]
    message = msgpack.packb({"actions": build(dtype, shape, data)})
    with pytest.raises(DecodingError):
        packing.unpack(message, hook)


@pytest.mark.parametrize("way", WAYS)
def test_bytes_that_do_not_fill_their_shape_are_counted(way):
    hook, build = WAYS[way]
    with pytest.raises(DecodingError, match=r"4 bytes do not fill <f4 of shape \[2\]"):
        packing.unpack(msgpack.packb({"actions": build("<f4", [2], b"\0" * 4)}), hook)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", "<f2", "|u1", "<i8", ">u2", "|b1"])
def test_numbers_of_every_size_are_read_in_native_order_and_can_be_written(way, dtype):
    hook, build = WAYS[way]
    sent = np.array([[0, 1, 2], [3, 4, 5]]).astype(dtype)
    message = msgpack.packb({"actions": build(dtype, [2, 3], sent.tobytes())})
    array = packing.unpack(message, hook)["actions"]
    assert (array == sent).all()
    assert array.dtype == sent.dtype.newbyteorder("=")
    array[0, 0] = 1


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("key", [0, 1, 2])
def test_a_field_of_an_array_that_is_missing_or_of_another_type_is_refused(way, key):
    hook, build = WAYS[way]
    array = build("<f4", [1], b"\0" * 4)
    name = list(array)[min(key + 1, len(array) - 1)]
    for value in (None, 3, "x", [1.5], {}, [None]):
        with pytest.raises(DecodingError):
            packing.unpack(msgpack.packb({"actions": array | {name: value}}), hook)
    del array[name]
    with pytest.raises(DecodingError):
        packing.unpack(msgpack.packb({"actions": array}), hook)


BOMBS = {
    "a list of four billion": b"\xdd\xff\xff\xff\xff",
    "a map of four billion": b"\xdf\xff\xff\xff\xff",
    "a list of five thousand": msgpack.packb([0] * 5000),
    "a map of five thousand": msgpack.packb({str(n): 0 for n in range(5000)}),
    "4 GB of bytes": b"\xc6\xff\xff\xff\xff",
    "4 GB of text": b"\xdb\xff\xff\xff\xff",
    "4 GB of an extension": b"\xc9\xff\xff\xff\xff\x01",
    "lists in lists, each announced long": b"\xdc\x10\x00" * 100_000,
    "lists in lists": b"\x91" * 100_000,
    "maps in maps": b"\x81\xa1a" * 100_000,
    "a timestamp": msgpack.packb(msgpack.Timestamp(1)),
    "text that is not UTF-8": b"\xa2\xff\xfe",
    "a number as a key": b"\x81\x01\x01",
    "two messages": b"\x80\x80",
    "half a message": msgpack.packb({"actions": [1.0] * 12})[:-3],
    "nothing": b"",
    "no message": b"\xc1",
}


@pytest.mark.parametrize("bomb", BOMBS, ids=str)
@pytest.mark.parametrize("way", WAYS)
def test_a_boundless_or_broken_message_is_refused_in_little_memory(way, bomb):
    with little_memory(60e6), pytest.raises(DecodingError):
        packing.unpack(BOMBS[bomb], WAYS[way][0])


@pytest.mark.parametrize("dtype", ["|O", "<U3", "bool_", "f4 ", "<f3", 7, None, b"|O"])
def test_a_scalar_of_something_else_is_refused(dtype):
    message = msgpack.packb({"x": {b"__npgeneric__": True, b"data": 1, b"dtype": dtype}})
    with pytest.raises(DecodingError):
        packing.unpack(message, packing.from_openpi)


@pytest.mark.parametrize("array", [np.zeros((2, 3), np.float32), np.zeros((), np.uint8)])
def test_a_npy_file_is_what_numpy_writes_and_reads(array):
    assert np.load(io.BytesIO(npy_bytes(array)), allow_pickle=False).tolist() == array.tolist()
    stream = io.BytesIO()
    np.save(stream, np.asfortranarray(np.arange(6.0).reshape(2, 3)))
    assert npy_array(stream.getvalue()).tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)",
        "__import__('os').system('true')",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (" + "9" * 4000 + ",)}",
        "(" * 5000,
        "",
    ],
)
def test_a_npy_header_is_data(header):
    text = header.encode() + b"\n"
    data = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + b"\0" * 4
    with pytest.raises(DecodingError):
        npy_array(data)


def test_an_object_array_in_a_npy_file_is_refused():
    stream = io.BytesIO()
    np.save(stream, np.array([print], dtype=object), allow_pickle=True)
    with pytest.raises(DecodingError, match=r"'\|O' is not a number's"):
        npy_array(stream.getvalue())


@pytest.mark.parametrize("value", [object(), {1, 2}, 1j])
@pytest.mark.parametrize(
    "default", [packing.openpi_array, packing.groot_array, packing.vlaeval_array]
)
def test_what_no_protocol_has_a_form_for_is_not_sent(value, default):
    with pytest.raises(TypeError, match="cannot be sent"):
        packing.pack({"x": value}, default)
