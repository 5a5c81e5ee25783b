"""Images of an exported dataset: those that a policy gets."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest

from pytest_safemanip.lerobot.conventions import IMAGES
from pytest_safemanip.lerobot.statistics import EVERY, OfImages, of_rows, pooled
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.rollouts import loop
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.trace import files
from tests.conftest import Rollouts
from tests.lerobot.conftest import command
from tests.sim.rendering.test_observing import require


def frames(path: Path) -> Any:
    """The pictures of a video (N, 256, 256, 3)."""
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    wanted = ("-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-")
    done = subprocess.run([ffmpeg, *wanted], capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, 256, 256, 3)


def test_images_are_those_of_the_observation_the_top_row_first(
    tmp_path: Path, rollouts: Rollouts
) -> None:
    require("osmesa")
    pytest.importorskip("pyarrow")
    request = Request("OpenDrawer", 0, "compact")
    job = loop.Job("OpenDrawer", "hold", request, loop.Protocol("horizon", 0.004), {})
    recording = loop.run(job, rollouts.backend, Hold())
    files.save(recording, tmp_path / "OpenDrawer-hold-seed0.rollout")
    rollouts.backend.reset(request)
    seen = rollouts.backend.observe()
    out = tmp_path / "out"
    command("export", tmp_path, "--lerobot", "--images", "-o", out, "--assets=primitive")
    info = json.loads((out / "OpenDrawer/meta/info.json").read_text())
    for key, feature in IMAGES.items():
        assert info["features"][feature]["shape"] == [256, 256, 3]
        drawn = frames(out / f"OpenDrawer/videos/chunk-000/{feature}/episode_000000.mp4")
        assert len(drawn) == recording.acting - 1 == info["total_frames"]
        first, wanted = drawn[0].astype(int), seen[key].astype(int)
        assert np.abs(first - wanted).mean() < 5.0
        assert np.abs(first[::-1] - wanted).mean() > 10.0
        assert np.abs(first[..., ::-1] - wanted).mean() > 5.0  # RGB


def test_statistics_are_those_of_the_values() -> None:
    rows = np.random.default_rng(0).normal(size=(200, 3))
    found = of_rows(rows)
    assert np.allclose(found["mean"], rows.mean(axis=0))
    assert np.allclose(found["std"], rows.std(axis=0))
    assert np.allclose(found["q99"], np.quantile(rows, 0.99, axis=0))
    assert found["count"] == [200]
    pictures = np.random.default_rng(1).integers(0, 256, (2 * EVERY, 8, 8, 3), dtype=np.uint8)
    parts = []
    for half in np.split(pictures, 2):
        looked = OfImages()
        for picture in half:
            looked.add(picture)
        parts.append(looked.result())
    whole, used = pooled(parts), pictures[::EVERY] / 255.0
    assert whole["mean"].shape == (3, 1, 1)
    assert np.allclose(whole["mean"].ravel(), used.mean(axis=(0, 1, 2)))
    assert np.allclose(whole["std"].ravel(), used.std(axis=(0, 1, 2)))
    assert np.allclose(whole["max"].ravel(), used.max(axis=(0, 1, 2)))
    assert whole["count"] == [2]
