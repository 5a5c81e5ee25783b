"""Colours of the stand-ins, and one-colour PNG textures."""

from __future__ import annotations

import hashlib
import struct
import zlib

Paint = tuple[float, float, float, float]

STEEL: Paint = (0.70, 0.71, 0.73, 1.0)
DARK_STEEL: Paint = (0.38, 0.39, 0.42, 1.0)
BLACK: Paint = (0.08, 0.08, 0.09, 1.0)
WHITE: Paint = (0.93, 0.93, 0.91, 1.0)
GLASS: Paint = (0.65, 0.80, 0.86, 0.35)
DARK_GLASS: Paint = (0.10, 0.11, 0.13, 0.75)
RED: Paint = (0.76, 0.14, 0.12, 1.0)
GREEN: Paint = (0.22, 0.56, 0.20, 1.0)
WOOD: Paint = (0.62, 0.43, 0.26, 1.0)
BRASS: Paint = (0.72, 0.58, 0.28, 1.0)
UNSEEN: Paint = (0.0, 0.0, 0.0, 0.0)

PAINTS: dict[str, Paint] = {
    "steel": STEEL,
    "dark": DARK_STEEL,
    "black": BLACK,
    "white": WHITE,
    "glass": GLASS,
    "red": RED,
    "green": GREEN,
    "wood": WOOD,
    "brass": BRASS,
    "cream": (0.93, 0.87, 0.70, 1.0),
    "yellow": (0.93, 0.80, 0.20, 1.0),
    "orange": (0.92, 0.50, 0.12, 1.0),
    "brown": (0.40, 0.25, 0.14, 1.0),
    "crust": (0.76, 0.54, 0.29, 1.0),
    "pink": (0.90, 0.60, 0.60, 1.0),
    "purple": (0.42, 0.18, 0.38, 1.0),
    "lime": (0.62, 0.76, 0.28, 1.0),
    "blue": (0.24, 0.42, 0.70, 1.0),
    "sky": (0.66, 0.80, 0.88, 0.6),
}
"""Named colours, for tables."""

_TEXTURE_WORDS: tuple[tuple[str, tuple[int, int, int]], ...] = (
    ("dark_beige", (176, 158, 132)),
    ("dark_blue", (48, 62, 96)),
    ("dark_gray", (82, 82, 84)),
    ("dark_wood", (92, 66, 46)),
    ("light_gray", (196, 196, 196)),
    ("lighter_gray", (214, 214, 214)),
    ("light_wood", (202, 170, 128)),
    ("gray_wood", (150, 140, 130)),
    ("black", (34, 34, 36)),
    ("white", (238, 238, 236)),
    ("gray", (150, 150, 150)),
    ("beige", (214, 200, 172)),
    ("brass", (184, 148, 72)),
    ("metal", (176, 178, 182)),
    ("red", (150, 62, 52)),
    ("green", (92, 118, 92)),
    ("blue", (92, 116, 148)),
    ("wood", (160, 118, 78)),
    ("marble", (222, 220, 216)),
    ("brick", (160, 92, 74)),
    ("tile", (206, 208, 206)),
)
"""RGB of a texture whose file name contains a word; the first that fits decides."""

TEXTURE_SIDE = 4
"""Pixels along each side of a generated texture."""


def texture_colour(path: str) -> tuple[int, int, int]:
    """RGB, 0 to 255, for a texture by its path: from its name, else a muted tone of its own."""
    for word, colour in _TEXTURE_WORDS:
        if word in path:
            return colour
    digest = hashlib.sha256(path.encode()).digest()
    base = 120 + digest[0] % 90
    return base, base - digest[1] % 24, base - digest[2] % 40


def png(colour: tuple[int, int, int]) -> bytes:
    """A PNG file of one colour."""
    line = b"\0" + bytes(colour) * TEXTURE_SIDE
    header = struct.pack(">IIBBBBB", TEXTURE_SIDE, TEXTURE_SIDE, 8, 2, 0, 0, 0)
    # Stored, not compressed: the bytes then do not depend on the zlib version.
    pixels = zlib.compress(line * TEXTURE_SIDE, level=0)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", pixels),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(tag: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))
