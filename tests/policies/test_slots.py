from __future__ import annotations

import os
import statistics
import subprocess
import sys
import threading
import time

import pytest

from pytest_safemanip.policies.slots import Slots

HOLDS = """
import sys, time
from pathlib import Path
from pytest_safemanip.policies.slots import Slots
folder, slots, times, seconds = Path(sys.argv[1]), *map(float, sys.argv[2:])
for _ in range(int(times)):
    with Slots(folder, "server").one(int(slots)):
        began = time.monotonic()
        print("in", flush=True)
        time.sleep(seconds)
        with (folder / "log").open("a") as log:
            log.write(f"{began} {time.monotonic()}\\n")
"""


def most_at_a_time(spans):
    changes = sorted([(start, 1) for start, _ in spans] + [(end, -1) for _, end in spans])
    now = most = 0
    for _, change in changes:
        now += change
        most = max(most, now)
    return most


@pytest.mark.parametrize("among", [1, 2])
def test_so_many_threads_hold_a_slot_at_a_time(tmp_path, among):
    slots, spans = Slots(tmp_path, "server"), []

    def hold():
        for _ in range(3):
            with slots.one(among):
                began = time.monotonic()
                time.sleep(0.01)
                spans.append((began, time.monotonic()))

    threads = [threading.Thread(target=hold) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(spans) == 12
    assert most_at_a_time(spans) == among


@pytest.mark.parametrize("among", [1, 2])
def test_so_many_processes_hold_a_slot_at_a_time(tmp_path, among):
    command = [sys.executable, "-c", HOLDS, str(tmp_path), str(among), "5", "0.02"]
    processes = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for _ in range(3)]
    assert [process.wait(60) for process in processes] == [0, 0, 0]
    lines = (tmp_path / "log").read_text().splitlines()
    spans = [tuple(map(float, line.split())) for line in lines]
    assert len(spans) == 15
    assert most_at_a_time(spans) <= among


def test_a_process_that_dies_gives_its_slot_back(tmp_path):
    command = [sys.executable, "-c", HOLDS, str(tmp_path), "1", "1", "60"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        assert not Slots(tmp_path, "server").take(0)
        other.kill()
    with Slots(tmp_path, "server").one(1):
        pass


def test_a_slot_is_free_again_after_an_error_in_it(tmp_path):
    slots = Slots(tmp_path, "server")
    with pytest.raises(ZeroDivisionError), slots.one(1):
        raise ZeroDivisionError
    assert slots.take(0)


def test_servers_and_numbers_are_apart(tmp_path):
    one, same, other = (Slots(tmp_path, name) for name in ("a", "a", "b"))
    assert [one.take(0), one.take(0), same.take(0), same.take(1), other.take(0)] == [
        True, False, False, True, True,
    ]  # fmt: skip
    one.give_back(0)
    assert same.take(0)
    for slots in (one, same, other):
        slots.close()
    assert one.take(0)
    assert one.take(1)


def test_a_free_slot_costs_far_less_than_a_call(tmp_path):
    slots, times = Slots(tmp_path, "server"), []
    for _ in range(200):
        began = time.perf_counter()
        with slots.one(1):
            pass
        times.append(time.perf_counter() - began)
    assert statistics.median(times) < 0.001
    assert len(os.listdir(tmp_path)) == 1
