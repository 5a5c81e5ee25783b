"""The policies with public checkpoints, as data: how each is served and evaluated.

Sources: of RoboCasa365's the checkpoints' repository (robocasa/robocasa365_checkpoints), its
benchmark pages and its leaderboard's submissions; of LIBERO's the evaluations in openpi's and
OpenVLA-OFT's repositories.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.embodiment import (
    LIBERO_PANDA,
    OPENVLA_PANDA,
    PANDA_OMRON,
    Embodiment,
)
from pytest_safemanip.policies.remote.endpoint import Endpoint, parse_endpoint
from pytest_safemanip.policies.remote.naming import (
    OPENPI,
    OPENPI_LIBERO,
    OPENVLA_OFT,
    ROBOCASA,
    VLA_EVAL,
    Naming,
)

Transport = Literal["openpi", "groot", "vla-eval"]
Layout = Literal["auto", "nested", "flat"]

SCHEMES: dict[Transport, tuple[str, ...]] = {
    "openpi": ("ws", "wss"),
    "groot": ("tcp",),
    "vla-eval": ("ws", "wss"),
}
LIBRARIES: dict[Transport, tuple[str, ...]] = {
    "openpi": ("msgpack", "websockets", "PIL"),
    "groot": ("msgpack", "zmq"),
    "vla-eval": ("msgpack", "websockets", "PIL"),
}
"""The libraries that the clients import, from the extra ``servers``."""
TASK_SETS = ("atomic_seen", "composite_seen", "composite_unseen")


@dataclass(frozen=True)
class Preset:
    """A kind of policy behind a server.

    Attributes:
        name: on the command line.
        transport: what its server speaks.
        port: its server's default.
        split: scenes that it is officially evaluated in; empty if nobody said.
        steps: actions of a chunk that are executed before the next call; 0 for as many as the
            server gives.
        naming: names and sizes in the model's request.
        layout: of a GR00T server's requests: ``nested``, ``flat`` as its wrapper for simulators
            wants them, or ``auto`` to find out.
        checkpoints: by task set; ``""`` for all tasks. A folder of the checkpoints' repository.
        start: the command that starts its server.
        inflight: requests that its server is sent at a time: one, where it answers them one after
            the other and the others would wait within their deadlines; more where it batches.
        robot: that it was trained for.
    """

    name: str
    transport: Transport
    port: int
    split: str
    steps: int
    start: str
    naming: Naming
    layout: Layout = "auto"
    checkpoints: Mapping[str, str] = field(default_factory=lambda: {"": ""})
    inflight: int = 1
    robot: Embodiment = PANDA_OMRON

    @property
    def task_sets(self) -> tuple[str, ...]:
        """The sets that have a checkpoint, and so a server, each; empty if one serves all."""
        return tuple(name for name in self.checkpoints if name)


def _openpi(name: str, config: str, checkpoint: str) -> Preset:
    return Preset(
        name=name,
        transport="openpi",
        port=8000,
        split="pretrain",
        steps=5,
        start=f"uv run scripts/serve_policy.py policy:checkpoint --policy.config={config} "
        f"--policy.dir=CHECKPOINTS/{checkpoint}  (robocasa-benchmark/openpi)",
        naming=OPENPI,
        checkpoints={"": checkpoint},
    )


def _libero(name: str, config: str) -> Preset:
    return Preset(
        name=name,
        transport="openpi",
        port=8000,
        split="libero",
        steps=5,
        start=f"uv run scripts/serve_policy.py policy:checkpoint --policy.config={config} "
        f"--policy.dir=gs://openpi-assets/checkpoints/{config}  (Physical-Intelligence/openpi)",
        naming=OPENPI_LIBERO,
        checkpoints={"": f"openpi-assets/checkpoints/{config}"},
        robot=LIBERO_PANDA,
    )


def _groot(name: str, split: str, checkpoints: dict[str, str]) -> Preset:
    example = next(iter(checkpoints.values()))
    return Preset(
        name=name,
        transport="groot",
        port=5555,
        split=split,
        steps=16,
        start=f"python scripts/inference_service.py --server --model_path CHECKPOINTS/{example} "
        "--data_config panda_omron --embodiment_tag new_embodiment  "
        "(robocasa-benchmark/Isaac-GR00T)",
        naming=ROBOCASA,
        checkpoints=checkpoints,
    )


def _by_set(training: str) -> dict[str, str]:
    folder = f"gr00t_n1-5/foundation_model_learning/{training}"
    return {name: f"{folder}/{name}/checkpoint-60000" for name in TASK_SETS}


PRESETS = {
    preset.name: preset
    for preset in (
        _openpi(
            "pi0",
            "pi0_robocasa_pretrain_human300",
            "pi0/pi0_robocasa_pretrain_human300/multitask_learning/75000",
        ),
        _openpi(
            "pi05",
            "pi05_pretrain_human300",
            "pi05_pretrain_human300/multitask_learning/75000",
        ),
        _libero("pi0-libero", "pi0_libero"),
        _libero("pi05-libero", "pi05_libero"),
        Preset(
            name="openvla-oft",
            transport="openpi",
            port=8000,
            split="libero",
            steps=8,
            start="safemanip serve MODULE:ATTRIBUTE, around its get_vla_action; docs/libero.md has "
            "the file",
            naming=OPENVLA_OFT,
            checkpoints={"": "moojink/openvla-7b-oft-finetuned-libero-spatial-object-goal-10"},
            robot=OPENVLA_PANDA,
        ),
        _groot("groot", "pretrain", {"": "gr00t_n1-5/multitask_learning/checkpoint-120000"}),
        _groot(
            "groot-pt",
            "target",
            {"": "gr00t_n1-5/foundation_model_learning/pretraining/checkpoint-80000"},
        ),
        _groot("groot-to", "target", _by_set("target_only")),
        _groot("groot-tpt", "target", _by_set("target_posttraining")),
        Preset(
            name="openpi",
            transport="openpi",
            port=8000,
            split="",
            steps=5,
            start="safemanip serve MODULE:ATTRIBUTE, or openpi's own scripts/serve_policy.py",
            naming=OPENPI,
        ),
        Preset(
            name="lerobot",
            transport="openpi",
            port=8000,
            split="",
            steps=0,
            start="safemanip serve --lerobot PATH, in LeRobot's environment",
            naming=replace(OPENPI, image_size=0),
        ),
        Preset(
            name="vla-eval",
            transport="vla-eval",
            port=8000,
            split="",
            steps=1,
            start="vla-eval serve --config SERVER.yaml",
            naming=VLA_EVAL,
            inflight=4,
        ),
    )
}
"""All presets by name. ``openpi``, ``lerobot`` and ``vla-eval`` are any model behind such a
server.
"""


def parse_servers(preset: Preset, text: str) -> dict[str, tuple[Endpoint, ...]]:
    """Read where a preset's servers are.

    Args:
        preset: the policy.
        text: addresses with ``+`` between them, of servers that all serve the same; for a policy
            with a checkpoint for each task set ``SET@ADDRESS+SET@ADDRESS``, of which some may be
            left out. Empty: this machine, the default port.

    Returns:
        Addresses by task set; ``""`` where they serve all.

    Raises:
        ConfigError: if it cannot be read; says how it is written.
    """
    schemes = SCHEMES[preset.transport]
    if not preset.task_sets:
        addresses = text.split("+") if text else ["127.0.0.1"]
        every = [parse_endpoint(address, schemes, preset.port) for address in addresses]
        return {"": _distinct(preset, text, every)}
    example = "+".join(
        f"{name}@{schemes[0]}://127.0.0.1:{preset.port + n}"
        for n, name in enumerate(preset.task_sets)
    )
    found: dict[str, list[Endpoint]] = {}
    for item in text.split("+"):
        name, at, address = item.partition("@")
        if not at or name not in preset.task_sets:
            raise ConfigError(
                f"policy {preset.name}={text}: it has a checkpoint, and so a server, for each "
                f"task set; expected {preset.name}={example}"
            )
        found.setdefault(name, []).append(parse_endpoint(address, schemes, preset.port))
    return {name: _distinct(preset, text, endpoints) for name, endpoints in found.items()}


def _distinct(preset: Preset, text: str, endpoints: list[Endpoint]) -> tuple[Endpoint, ...]:
    """The servers of one checkpoint, none of them twice."""
    for endpoint in endpoints:
        if endpoints.count(endpoint) > 1:
            raise ConfigError(f"policy {preset.name}={text}: {endpoint} is given twice")
    return tuple(endpoints)
