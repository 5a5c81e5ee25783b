from __future__ import annotations

import os
import stat

import pytest

from pytest_safemanip.report.whole import write_whole


def test_what_was_there_stays_until_all_is_written(tmp_path):
    path = tmp_path / "deep" / "page.html"
    assert write_whole(path, ["one ", b"two\n"]).read_bytes() == b"one two\n"

    def parts():
        yield "three"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_whole(path, parts())
    assert path.read_text() == "one two\n"
    assert [*path.parent.iterdir()] == [path]


def test_an_error_names_the_file_that_was_meant(tmp_path):
    (tmp_path / "page.html").mkdir()
    with pytest.raises(IsADirectoryError) as error:
        write_whole(tmp_path / "page.html", ["text"])
    assert error.value.filename == str(tmp_path / "page.html")


def test_a_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="not a file"):
        write_whole(tmp_path / "pipe", ["text"])
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_a_link_is_replaced_and_what_it_points_to_stays(tmp_path):
    (tmp_path / "else").write_text("theirs")
    (tmp_path / "page.html").symlink_to(tmp_path / "else")
    write_whole(tmp_path / "page.html", ["ours"])
    assert (tmp_path / "page.html").read_text() == "ours"
    assert (tmp_path / "else").read_text() == "theirs"
