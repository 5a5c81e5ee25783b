"""The policies with public RoboCasa365 checkpoints, as data: how each is served and evaluated.

Sources: the checkpoints' repository (robocasa/robocasa365_checkpoints), RoboCasa365's benchmark
pages and its leaderboard's submissions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.endpoint import Endpoint, parse_endpoint

Transport = Literal["openpi", "groot", "vla-eval"]

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
"""What the clients import, from the extra ``servers``."""
TASK_SETS = ("atomic_seen", "composite_seen", "composite_unseen")


@dataclass(frozen=True)
class Preset:
    """A kind of policy behind a server.

    Attributes:
        name: on the command line.
        transport: what its server speaks.
        port: its server's default.
        split: scenes that it is officially evaluated in; None if nobody said.
        steps: actions of a chunk that are executed before the next call.
        instruction_key: where the model reads the instruction in its request.
        checkpoints: by task set; ``""`` for all tasks. A folder of the checkpoints' repository.
        start: the command that starts its server.
        batches: whether its server answers several requests in one pass of the model; none does,
            so a worker more waits for the others.
    """

    name: str
    transport: Transport
    port: int
    split: Literal["pretrain", "target"] | None
    steps: int
    start: str
    instruction_key: str
    checkpoints: Mapping[str, str] = field(default_factory=lambda: {"": ""})
    batches: bool = False

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
        instruction_key="prompt",
        checkpoints={"": checkpoint},
    )


def _groot(name: str, split: Literal["pretrain", "target"], checkpoints: dict[str, str]) -> Preset:
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
        instruction_key="annotation.human.task_description",
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
            split=None,
            steps=5,
            start="python -m pytest_safemanip.policies.serve MODULE:ATTRIBUTE, or openpi's own "
            "scripts/serve_policy.py",
            instruction_key="prompt",
        ),
        Preset(
            name="vla-eval",
            transport="vla-eval",
            port=8000,
            split=None,
            steps=1,
            start="vla-eval serve --config SERVER.yaml",
            instruction_key="task_description",
        ),
    )
}
"""By name. ``openpi`` and ``vla-eval`` are any model behind such a server."""


def parse_servers(preset: Preset, text: str) -> dict[str, Endpoint]:
    """Read where a preset's servers are.

    Args:
        preset: the policy.
        text: an address; for a policy with a checkpoint for each task set
            ``SET@ADDRESS+SET@ADDRESS``, of which some may be left out. Empty: this machine, the
            default port.

    Returns:
        Addresses by task set; ``""`` where one server serves all.

    Raises:
        ConfigError: if it cannot be read; says how it is written.
    """
    schemes = SCHEMES[preset.transport]
    if not preset.task_sets:
        return {"": parse_endpoint(text or "127.0.0.1", schemes, preset.port)}
    example = "+".join(
        f"{name}@{schemes[0]}://127.0.0.1:{preset.port + n}"
        for n, name in enumerate(preset.task_sets)
    )
    found: dict[str, Endpoint] = {}
    for item in text.split("+"):
        name, at, address = item.partition("@")
        if not at or name not in preset.task_sets or name in found:
            raise ConfigError(
                f"policy {preset.name}={text}: it has a checkpoint, and so a server, for each "
                f"task set; expected {preset.name}={example}"
            )
        found[name] = parse_endpoint(address, schemes, preset.port)
    return found
