"""What reading recordings' archives costs here, and with ``zipfile`` and ``numpy.load``.

    python -m benchmarks.speed.reading DIR

DIR has recordings. All members of each are unpacked and made into arrays, by `trace/members.py` and
by the libraries, which have to agree on every byte. Times are of the processor.
"""

from __future__ import annotations

import io
import statistics
import sys
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from benchmarks.recordings import below, load
from benchmarks.tables import table
from pytest_safemanip.trace.members import Array, Members

ROUNDS = 7


def ours(data: bytes, types: Mapping[str, type]) -> list[Array]:
    """The arrays, read by this package, which is told of what type each has to be."""
    members = Members(data)
    return [members.packed(name).array(wanted) for name, wanted in types.items()]


def libraries(data: bytes, types: Mapping[str, type]) -> list[Array]:
    """The arrays, read by the libraries."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return [np.load(io.BytesIO(archive.read(name)), allow_pickle=False) for name in types]


def types_of(data: bytes) -> dict[str, type]:
    """The type of each array of a recording, by its name in the archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = [name for name in archive.namelist() if name.endswith(".npy")]
    found = libraries(data, dict.fromkeys(names, object))
    return {name: array.dtype.type for name, array in zip(names, found, strict=True)}


def main() -> None:
    """Measure and print."""
    totals = {"members.py": 0.0, "zipfile, numpy.load": 0.0}
    paths = below([Path(sys.argv[1])])
    for path in paths:
        load(path)  # names a file that is none; not timed
        data = path.read_bytes()
        types = types_of(data)
        pairs = zip(libraries(data, types), ours(data, types), strict=True)
        if any(a.tobytes() != b.tobytes() for a, b in pairs):
            sys.exit(f"{path}: the two ways of reading differ")
        totals["members.py"] += seconds(ours, data, types)
        totals["zipfile, numpy.load"] += seconds(libraries, data, types)
    reference = totals["zipfile, numpy.load"]
    lines = [
        [name, str(len(paths)), f"{1000 * t / len(paths):.2f}", f"{t / reference:.2f}"]
        for name, t in totals.items()
    ]
    print(table(["read by", "recordings", "ms for each", "x libraries"], lines))


def seconds(
    read: Callable[[bytes, Mapping[str, type]], list[Array]], data: bytes, types: Mapping[str, type]
) -> float:
    """The median of some rounds."""
    taken = []
    for _ in range(ROUNDS):
        start = time.process_time()
        read(data, types)
        taken.append(time.process_time() - start)
    return statistics.median(taken)


if __name__ == "__main__":
    main()
