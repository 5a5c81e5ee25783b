"""The videos of a test run, after it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pytest_safemanip.errors import JudgementError, RolloutError, SafemanipError, raised_as
from pytest_safemanip.judge import Judge
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.trace import files
from pytest_safemanip.video.film import Progress, check_drawn
from pytest_safemanip.video.origin import is_of, origin_of, sign
from pytest_safemanip.video.process import CannotDraw, Drawer
from pytest_safemanip.video.storyboard import Storyboard, storyboard

FOLDER = "videos"
"""In the output folder."""
CAMERAS = ("room", "close", "wrist")
SIZE = 256


@dataclass
class Drawn:
    """What became of the videos of a run.

    Attributes:
        wanted: how many were to be drawn.
        written: the files, those among them that were there.
        kept: how many an earlier run has drawn, of the same.
        unavailable: why none can be drawn here; empty if they can.
        failed: why single ones were not drawn.
        interrupted: whether somebody did not want to wait.
    """

    wanted: int = 0
    written: list[Path] = field(default_factory=list)
    kept: int = 0
    unavailable: str = ""
    failed: list[str] = field(default_factory=list)
    interrupted: bool = False


def wanted_of(records: Sequence[RolloutRecord], which: str) -> list[RolloutRecord]:
    """The rollouts that a video is wanted of.

    Args:
        records: all of the run.
        which: ``violations``, ``all`` or ``none``.
    """
    return [
        record
        for record in records
        if record.recording
        and (
            which == "all"
            or (which == "violations" and any(p.violations for p in record.properties.values()))
        )
    ]


def draw_videos(
    plan: Plan,
    records: Sequence[RolloutRecord],
    show: Callable[[int, Path], Progress],
) -> Drawn:
    """Draw the rollouts of a run, one after the other, into its folder, unless they are there.

    Args:
        plan: the run.
        records: the rollouts.
        show: given the number of a video, from 1, and its file, what is told how far it is.

    Returns:
        What was written, also after Ctrl-C.
    """
    found, folder = Drawn(len(records)), plan.settings.out
    log = folder / "logs" / "video.log"
    targets = {r.key: folder / FOLDER / f"{Path(r.recording).stem}.mp4" for r in records}
    with Drawer(SIZE, CAMERAS, log) as drawer:
        drawer.assets = plan.settings.assets
        try:
            if not all(target.exists() for target in targets.values()):
                drawer.launch()  # it imports while recordings are judged
            for number, record in enumerate(records, 1):
                target = targets[record.key]
                try:
                    found.kept += _draw(plan, record, target, drawer, show(number, target))
                except CannotDraw:
                    raise
                except SafemanipError as error:
                    found.failed.append(f"{target.name}: {error}")
                else:
                    found.written.append(target)
        except CannotDraw as error:
            found.unavailable = str(error)
        except KeyboardInterrupt:
            found.interrupted = True
    return found


def _draw(
    plan: Plan, record: RolloutRecord, target: Path, drawer: Drawer, progress: Progress
) -> bool:
    """Draw one, unless it is there; whether it was."""
    source = Path(record.recording)
    with raised_as(JudgementError, "cannot be judged again"):
        board = _board(plan, record, source)
        origin = origin_of(source, board, SIZE, CAMERAS)
    if is_of(target, origin):
        return True
    drawer.draw(source, board, target, progress)
    with raised_as(RolloutError, "cannot be written"):
        sign(target, origin)
    return False


def _board(plan: Plan, record: RolloutRecord, source: Path) -> Storyboard:
    """What the video shows beside the scene: the verdicts of the run, found again.

    Raises:
        ConfigError: if recordings of this backend cannot be drawn.
    """
    recording = files.load(source)
    check_drawn(recording.episode.backend, source.name)
    judge = Judge(
        recording,
        plan.tasks[record.task],
        plan.attributes,
        plan.catalogue,
        plan.parameters,
        plan.settings.semantics,
    )
    properties = {id_: plan.properties[id_] for id_ in record.properties}
    verdicts = {id_: judge.judge(prop) for id_, prop in properties.items()}
    return storyboard(recording, judge, properties, verdicts)
