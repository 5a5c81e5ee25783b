"""Images in the size that openpi's models were trained with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.remote.library import need
from pytest_safemanip.policies.remote.naming import Naming
from pytest_safemanip.policies.remote.observation import Observation


def images_of(observation: Observation, naming: Naming) -> dict[str, NDArray[np.uint8]]:
    """The pictures of a request by their names in it."""
    return {
        key: resize_with_pad(observation[camera], naming.image_size)
        if naming.image_size
        else observation[camera]
        for key, camera in naming.pictures.items()
    }


def resize_with_pad(image: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """Fit an image into a square, its ratio kept, black around it.

    Pillow's bilinear filter, as in openpi's own clients, to the last bit: it averages over all
    pixels that an output pixel covers, which OpenCV's filter of the same name does not.

    Args:
        image: (height, width, 3).
        size: of each side of the result.
    """
    height, width = image.shape[:2]
    if (height, width) == (size, size):
        return image
    pillow: Any = need("PIL.Image")
    ratio = max(width / size, height / size)
    inner = int(height / ratio), int(width / ratio)
    fitted = np.asarray(
        pillow.fromarray(image).resize((inner[1], inner[0]), pillow.Resampling.BILINEAR)
    )
    if inner == (size, size):
        return fitted
    top, left = (size - inner[0]) // 2, (size - inner[1]) // 2
    square = np.zeros((size, size, 3), np.uint8)
    square[top : top + inner[0], left : left + inner[1]] = fitted
    return square
