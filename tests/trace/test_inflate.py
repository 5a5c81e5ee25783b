from __future__ import annotations

import importlib
import sys
import zlib

import pytest

from pytest_safemanip.trace import inflate as module

CONTENT = bytes(range(256)) * 40


def deflated(content):
    packer = zlib.compressobj(6, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(content) + packer.flush()


@pytest.fixture(params=["isal", "zlib"])
def inflate(request, monkeypatch):
    """As it is installed, and as it is where there is no isal for the processor."""
    if request.param == "zlib":
        monkeypatch.setitem(sys.modules, "isal", None)
    else:
        pytest.importorskip("isal")
    yield importlib.reload(module).inflate
    monkeypatch.undo()
    importlib.reload(module)


@pytest.mark.parametrize("limit", [len(CONTENT), 2**28])
def test_content_is_unpacked(inflate, limit):
    assert inflate(deflated(CONTENT), len(CONTENT), limit) == CONTENT
    assert inflate(memoryview(deflated(CONTENT)), len(CONTENT), limit) == CONTENT
    assert inflate(deflated(b""), 0, limit) == b""


def test_what_may_be_too_much_is_unpacked_no_further_than_it_should_be(inflate):
    bomb = deflated(bytes(10_000_000))
    assert len(inflate(bomb, 1000, 20_000)) == 1001


@pytest.mark.parametrize("limit", [1000, 2**28])
def test_what_is_longer_than_it_should_be_shows(inflate, limit):
    assert len(inflate(deflated(CONTENT), 1000, limit)) > 1000


@pytest.mark.parametrize("limit", [len(CONTENT), 2**28])
def test_damage_is_an_error(inflate, limit):
    with pytest.raises(zlib.error):
        inflate(b"\xff" * 50, len(CONTENT), limit)


def test_what_is_cut_off_is_an_error_or_too_short(inflate):
    content = deflated(CONTENT)[:100]
    with pytest.raises(zlib.error):
        inflate(content, len(CONTENT), 2**28)
    assert len(inflate(content, len(CONTENT), len(CONTENT))) < len(CONTENT)
