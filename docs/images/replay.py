"""Draws replay.png: ``python docs/images/replay.py PAGE``, of the page that ``safemanip replay
--meshes`` wrote of the failure that the README shows.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

COLOURS = 128
SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main(page: Path) -> None:
    """Take a picture of the page as it opens."""
    with sync_playwright() as driver:
        arguments = ["--no-sandbox", *SOFTWARE]
        browser = driver.chromium.launch(executable_path="/usr/bin/chromium", args=arguments)
        tab = browser.new_page(viewport={"width": 960, "height": 600})
        tab.goto(page.resolve().as_uri())
        tab.wait_for_timeout(500)
        picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
        browser.close()
    drawn = picture.quantize(COLOURS, dither=Image.Dither.NONE)
    drawn.save(Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
