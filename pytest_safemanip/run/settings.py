"""What the user asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.metrics.shards import Shard
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.policies.remote.presets import Preset
from pytest_safemanip.run.cases import is_case_id
from pytest_safemanip.sim.backend import Options


@dataclass(frozen=True)
class Settings:
    """What the user asked for, parsed. Attributes follow the options; see ``pytest --help``."""

    policies: tuple[str, ...]
    servers: Mapping[str, str]
    checkpoints: Mapping[str, str]
    inflight: Mapping[str, int]
    deadlines: Deadlines
    jobs: int | None
    ray: str
    ray_resources: Mapping[str, float]
    presets: Mapping[str, Preset]
    tasks: tuple[str, ...]
    properties: tuple[str, ...]
    seeds: tuple[int, ...] | None
    backend: str
    scenes: str
    stepping: str
    assets: Literal["auto", "official", "primitive"]
    recordings: Path | None
    semantics: Literal["timed", "paper"]
    stop: Literal["success", "horizon", "violation", "warning"]
    horizon_scale: float
    prompt: str
    violations: str
    unresolved: str
    vacuous: str
    gates: Gates
    baseline: Path | None
    floor: Path | None
    early_stop: float | None
    inconclusive: str
    allow_standins: bool
    fresh: bool
    shard: Shard | None
    out: Path
    reports: tuple[str, ...]
    ci: str
    store: str
    video: str
    params: Mapping[str, float]
    fuzz: bool
    fuzz_propositions: tuple[str, ...]
    fuzz_examples: int | None
    pythons: Mapping[str, str]
    backend_paths: Mapping[str, Mapping[str, Path]]
    property_paths: tuple[Path, ...]
    task_paths: tuple[Path, ...]
    select: tuple[str, ...]
    laws: tuple[str, ...]
    search: int | None
    spaces: tuple[Path, ...]
    regressions: Path

    @property
    def simulator_options(self) -> Options:
        """What the chosen backend is made with."""
        name = self.backend.partition(":")[0]
        return Options(
            self.assets,
            self.out / "logs",
            self.pythons.get(name, ""),
            self.backend_paths.get(name, {}),
        )

    @property
    def fuzzes(self) -> bool:
        """Whether laws are tried. Node ids of cases alone mean those cases alone."""
        return bool(self.laws) or (self.fuzz and not self._names_cases)

    @property
    def judges(self) -> bool:
        """Whether rollouts are judged. Node ids of laws alone mean those laws alone."""
        if self.laws and not self.select:
            return False
        return bool(self.policies or self.recordings or self._names_cases or not self.fuzz)

    @property
    def picks_cases(self) -> bool:
        """Whether node ids on the command line pick single cases, and nothing asks for all."""
        return bool(self.select) and all(is_case_id(text) for text in self.select)

    @property
    def _names_cases(self) -> bool:
        return any(is_case_id(text) for text in self.select)
