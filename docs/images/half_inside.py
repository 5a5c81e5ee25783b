"""Draws half_inside.png: ``python docs/images/half_inside.py RECORDING``, of the failure that the
README shows.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from pytest_safemanip.cli.drawing import draw
from pytest_safemanip.sim.codec import decode_request
from pytest_safemanip.trace import files
from pytest_safemanip.video.imaging import open_studio, pillow

SIZE = 320
SAFE, UNSAFE = "white", "#ffb0b0"
MOMENTS = (
    (150, "The onion is grasped", SAFE),
    (320, "Released, 6 of 8 corners inside:\nVIOLATED enclosure_release", UNSAFE),
    (344, "RoboCasa: success", SAFE),
)
"""Step, caption, what is behind the caption."""
COLOURS = 256


def main(path: Path) -> None:
    """Draw each moment by two cameras, one below the other."""
    recording = files.load(path)
    studio = open_studio("primitive", SIZE)
    columns = []
    with studio.visit(decode_request(recording.episode.request)) as shot:
        shot.check(recording.scene)
        for step, text, colour in MOMENTS:
            shot.pose(recording.steps.qpos[step])
            seconds = step * recording.scene.control_period
            first, _, rest = text.partition("\n")
            above = draw(shot, ["right"], f"{seconds:.2f} s  {first}\n{rest}", colour)
            columns.append(np.concatenate((above, shot.take("close"))))
    studio.close()
    picture = pillow().Image.fromarray(np.concatenate(columns, axis=1))
    picture.quantize(COLOURS, dither=0).save(Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
