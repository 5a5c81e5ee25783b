from __future__ import annotations

import hashlib

import numpy as np
import pytest

from pytest_safemanip.policies.remote.images import resize_with_pad

# Of what openpi-client 0.1.2's function of the same name gives for these images.
DIGESTS = {
    (256, 256): "96ed00bb7385a2f6",
    (224, 224): "98bb2c381df954ef",
    (480, 640): "49a1d4b4149644ae",
    (640, 480): "4b88285b0726ad99",
    (100, 37): "b05a4601b868b420",
    (300, 224): "c4ee14805622c2f6",
}


def test_images_are_those_of_openpis_own_client_to_the_last_bit():
    random = np.random.default_rng(5)
    for shape, digest in DIGESTS.items():
        image = random.integers(0, 256, (*shape, 3), dtype=np.uint8)
        resized = resize_with_pad(image, 224)
        assert resized.shape == (224, 224, 3)
        assert hashlib.sha256(resized.tobytes()).hexdigest()[:16] == digest


def test_a_pixel_is_the_mean_of_what_it_covers_by_distance():
    random = np.random.default_rng(0)
    image = random.integers(0, 256, (256, 256, 3), dtype=np.uint8)
    scale = 256 / 224
    centres = (np.arange(224)[:, None] + 0.5) * scale - 0.5
    weights = np.clip(1 - np.abs(centres - np.arange(256)) / scale, 0, None)
    weights /= weights.sum(axis=1, keepdims=True)
    exact = np.einsum("ai,bj,ijc->abc", weights, weights, image, optimize=True)
    difference = np.abs(resize_with_pad(image, 224) - exact)
    assert difference.max() < 1.01  # rounded after each of two directions
    assert difference.mean() < 0.35


@pytest.mark.parametrize(
    ("shape", "filled"), [((100, 200), np.s_[56:168, :]), ((200, 100), np.s_[:, 56:168])]
)
def test_the_ratio_is_kept_and_the_rest_is_black(shape, filled):
    resized = resize_with_pad(np.full((*shape, 3), 9, np.uint8), 224)
    assert (resized[filled] == 9).all()
    assert resized.sum() == 9 * 3 * 112 * 224


def test_an_image_of_the_right_size_is_left_as_it_is():
    image = np.zeros((224, 224, 3), np.uint8)
    assert resize_with_pad(image, 224) is image
