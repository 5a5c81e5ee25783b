"""A policy of LeRobot's behind this package's server; runs in LeRobot's environment, not in ours.

Actions come one by one from ``select_action``, as in LeRobot's own evaluation: it knows how a
policy keeps its chunks, its history of observations and its ensembles.
"""

from __future__ import annotations

import hashlib
import importlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.remote.actions import ACTION_SIZE
from pytest_safemanip.policies.remote.naming import ALIASES, IMAGES, OPENPI
from pytest_safemanip.policies.remote.openpi import STATE as STATE_PARTS
from pytest_safemanip.sim.robocasa.observation import STATE as STATE_SIZES

PICTURE, STATE, ACTION, TASK = "observation.images.", "observation.state", "action", "task"
STATE_SIZE = sum(STATE_SIZES[part] for part in STATE_PARTS)
_REPOSITORY = re.compile(r"[\w.-]+/[\w.-]+")
NAMES: Mapping[str, str] = {
    name.removeprefix("video."): image
    for image, camera in IMAGES.items()
    for name in (camera, *ALIASES[image], image)
}
"""Which picture of a request a policy means, by the end of its feature's name."""


class LeRobotModel:
    """A policy that was trained with LeRobot.

    Args:
        path: a folder with a checkpoint, or a repository on the Hub.
        device: of torch, ``cuda`` or ``cpu``; as in the checkpoint if empty.
        cameras: ``left``, ``wrist`` or ``right`` by the feature of a picture, where its name does
            not say.

    Raises:
        ConfigError: if LeRobot is not installed, or this is no policy for RoboCasa's robot.
    """

    def __init__(self, path: str, device: str = "", cameras: Mapping[str, str] = {}) -> None:
        folder = Path(path)
        if not folder.is_dir() and not _REPOSITORY.fullmatch(path):
            raise ConfigError(f"--lerobot {path}: neither a folder nor OWNER/NAME of the Hub")
        self._torch = _library("torch")
        if not folder.is_dir():
            folder = Path(_library("huggingface_hub").snapshot_download(path))
        factory = _library("lerobot.policies.factory")
        config = _library("lerobot.configs.policies").PreTrainedConfig.from_pretrained(folder)
        config.device = device or config.device
        self._pictures = _pictures(config.input_features, cameras)
        _check_sizes(config)
        self._policy = factory.get_policy_class(config.type).from_pretrained(folder, config=config)
        self._policy.to(config.device)
        self._policy.eval()
        on_device = {"device_processor": {"device": str(config.device)}}
        self._before, self._after = factory.make_pre_post_processors(
            config, pretrained_path=str(folder), preprocessor_overrides=on_device
        )
        # A policy with a history wants to see every step.
        alone = getattr(config, "n_obs_steps", 1) == 1
        self.steps = int(getattr(config, "n_action_steps", 1)) if alone else 1
        self.fingerprint = _digest(folder)
        self.metadata = {
            "lerobot": {
                "version": importlib.import_module("lerobot").__version__,
                "type": str(config.type),
                "path": path,
                "n_action_steps": self.steps,
                "pictures": {feature: image for feature, (image, _) in self._pictures.items()},
            }
        }

    def reset(self, seed: int) -> None:
        """Forget the episode before, and seed whatever is random in the next."""
        self._torch.manual_seed(seed)
        for part in (self._policy, self._before, self._after):
            part.reset()

    def infer(self, request: Mapping[str, Any]) -> dict[str, NDArray[np.float32]]:
        """The actions up to the next request.

        Args:
            request: as openpi's RoboCasa365 models get it, images of any size.

        Returns:
            ``actions`` (:attr:`steps`, 12).
        """
        torch = self._torch
        batch: dict[str, Any] = {
            feature: _picture(torch, request[OPENPI.keys[image]], size)
            for feature, (image, size) in self._pictures.items()
        }
        state = np.array(request[OPENPI.keys["state"]], np.float32)
        batch |= {STATE: torch.from_numpy(state)[None], TASK: [request[OPENPI.keys["instruction"]]]}
        with torch.inference_mode():
            ready = self._before(batch)
            rows = [self._after(self._policy.select_action(ready)) for _ in range(self.steps)]
        actions = torch.cat(rows).to("cpu", torch.float32).numpy()
        return {"actions": actions}


def parse_cameras(items: Sequence[str]) -> dict[str, str]:
    """Which picture a feature is, from ``FEATURE=left``.

    Raises:
        ConfigError: if an item is not of that form.
    """
    found = {}
    for item in items:
        feature, _, image = (part.strip() for part in item.partition("="))
        if image not in IMAGES:
            hint = did_you_mean(image, IMAGES)
            raise ConfigError(
                f"--camera: expected FEATURE=left, right or wrist, found {item!r}; {hint}"
            )
        found[feature] = image
    return found


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ConfigError(
            "safemanip serve --lerobot runs in LeRobot's environment, which has "
            f"{name.partition('.')[0]!r}: install this package there, beside it ({error})"
        ) from error


def _pictures(
    features: Mapping[str, Any], cameras: Mapping[str, str]
) -> dict[str, tuple[str, tuple[int, int]]]:
    """Picture of the request, and its height and width, by the policy's feature."""
    found = {}
    for feature in (name for name in features if name.startswith(PICTURE)):
        image = cameras.get(feature) or NAMES.get(feature.removeprefix(PICTURE))
        if image is None:
            raise ConfigError(
                f"the policy looks at {feature!r}, whose name says no camera of RoboCasa's: say "
                f"which with --camera {feature}=left, right or wrist"
            )
        _, height, width = features[feature].shape
        found[feature] = image, (int(height), int(width))
    if unknown := [name for name in cameras if name not in found]:
        hint = did_you_mean(unknown[0], found)
        raise ConfigError(f"--camera: the policy has no picture {unknown[0]!r}; {hint}")
    return found


def _check_sizes(config: Any) -> None:
    """Refuse a policy of another robot."""
    for features, name, size in (
        (config.input_features, STATE, STATE_SIZE),
        (config.output_features, ACTION, ACTION_SIZE),
    ):
        shape = tuple(features[name].shape) if name in features else None
        if shape not in ((size,), None) or (shape is None and name == ACTION):
            raise ConfigError(
                f"the policy's {name!r} has shape {shape}, RoboCasa's robot has ({size},): it is "
                "another robot's"
            )


def _picture(torch: Any, image: NDArray[np.uint8], size: tuple[int, int]) -> Any:
    """An image (H, W, 3) as LeRobot has it: (1, 3, height, width), from 0 to 1."""
    picture = torch.from_numpy(np.array(image)).permute(2, 0, 1)[None].float() / 255.0
    if tuple(picture.shape[2:]) == size:
        return picture
    scale = torch.nn.functional.interpolate
    return scale(picture, size=size, mode="bilinear", antialias=True).clamp(0.0, 1.0)


def _digest(folder: Path) -> str:
    """Of all files of a checkpoint: weights, configuration, statistics."""
    whole = hashlib.sha256()
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        with file.open("rb") as stream:
            content = hashlib.file_digest(stream, "sha256").hexdigest()
        whole.update(f"{file.relative_to(folder)}\0{content}\n".encode())
    return whole.hexdigest()[:16]
