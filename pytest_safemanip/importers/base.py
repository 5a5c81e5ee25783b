"""What every importer is and gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

from pytest_safemanip.importers.source import Source
from pytest_safemanip.trace.recording import Recording

DRIFT_LIMIT = 0.1
"""Distance between an object's recorded place and the one that physics gives it, m. Above it the
physics is not that of the data. Of 28 human demonstrations the worst has 71 mm."""


OnStep = Callable[[int, int], None]
"""Called with the steps so far and how many there are."""


@dataclass(frozen=True)
class ImportOptions:
    """A user's choices about an import.

    Attributes:
        task: name of the task that the episodes are of; empty for what the source says.
        bindings: a YAML file that says what is what in the source; None for its own naming.
        policy: who acted, as recordings will say; empty for what the source says.
        assets: folders with meshes that a source refers to, and does not bring.
        tail: whether the scene is simulated until it rests, after the last state.
        drift_limit: largest drift of an object within a control period, m.
    """

    task: str = ""
    bindings: Path | None = None
    policy: str = ""
    assets: tuple[Path, ...] = ()
    tail: bool = True
    drift_limit: float = DRIFT_LIMIT


@dataclass(frozen=True)
class Clip:
    """What a camera saw in an episode: a part of a file of moving pictures.

    Attributes:
        camera: its name, fit for a file's.
        open: opens the file; TraceError if it cannot be read.
        start: of the part, s.
        pictures: of the part, one for each step.
        rate: pictures in a second.
    """

    camera: str
    open: Callable[[], IO[bytes]]
    start: float
    pictures: int
    rate: float


@dataclass(frozen=True)
class SourceEpisode:
    """An episode of a source that has not been imported yet.

    Attributes:
        name: where it is in the source, for people.
        task: name of the task.
        policy: who acted.
        seed: tells the episodes of one task and policy apart.
        record: makes the recording; TraceError or ConfigError if it has to be refused.
        clips: what cameras saw, where a recording has no states to draw it from.
    """

    name: str
    task: str
    policy: str
    seed: int
    record: Callable[[OnStep], Recording]
    clips: tuple[Clip, ...] = ()


class Importer(Protocol):
    """Makes recordings from sources of one kind."""

    def recognizes(self, source: Source) -> bool:
        """Whether a source is of its kind; quick, and never an error."""

    def episodes(self, source: Source, options: ImportOptions) -> Iterator[SourceEpisode]:
        """The episodes of a source, in its order; nothing is simulated before ``record``.

        Raises:
            ConfigError: if nothing of it can be imported, naming why.
        """
