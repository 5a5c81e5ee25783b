"""Draws timeline.png and video.png: ``python docs/images/recordings.py RECORDING``, of the failure
that the README shows.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import imageio_ffmpeg

from pytest_safemanip import load

HERE = Path(__file__).parent
MOMENT = "12.75"
"""Seconds, in the video's own time."""


def main(path: str) -> None:
    """The timeline, and one picture of the video."""
    load(path).plot_timeline("enclosure_release").savefig(HERE / "timeline.png", dpi=90)
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder, "fault.mp4")
        command = [sys.executable, "-m", "pytest_safemanip", "video", path, "-o", str(video)]
        subprocess.run(command, check=True)
        taken = ["-ss", MOMENT, "-i", str(video), "-frames:v", "1", "-y", str(HERE / "video.png")]
        subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", *taken], check=True)


if __name__ == "__main__":
    main(sys.argv[1])
