"""The wheel of hf-libero from PyPI: its BDDL files and initial states, unpacked; not installed."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

WHEEL = "hf-libero==0.1.4"


def unpacked(folder: Path) -> Path:
    """The folder with ``bddl_files`` and ``init_files``.

    Args:
        folder: where the wheel is downloaded to (3 MB) and unpacked; kept for other processes.
    """
    root = folder / "libero" / "libero"
    if not root.is_dir():
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-input"]
        subprocess.run([*command, "--dest", str(folder), WHEEL], check=True, capture_output=True)
        (wheel,) = folder.glob("hf_libero-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            wanted = [n for n in archive.namelist() if Path(n).suffix in (".bddl", ".pruned_init")]
            archive.extractall(folder, wanted)
    return root
