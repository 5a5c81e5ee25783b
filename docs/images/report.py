"""Draws report.png and report_overview.png: ``python docs/images/report.py RUN``, of the output
folder of a run whose faults the page explains, six of them beside the expert.

With ``--look FOLDER`` it takes the pages at the widths of a phone, a laptop and a large screen
instead, dark and light, for somebody to look at.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from pytest_safemanip.report.page.writing import write_page

HERE = Path(__file__).parent
COLOURS = 128
SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
WIDTHS = (390, 1280, 2560)


def main() -> None:
    """Take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--look", type=Path, metavar="FOLDER")
    options = parser.parse_args()
    address = write_page(options.run).resolve().as_uri()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path="/usr/bin/chromium", args=[*SOFTWARE, "--enable-unsafe-swiftshader"]
        )
        if options.look:
            for scheme in ("light", "dark"):
                for width in WIDTHS:
                    tab = browser.new_page(
                        viewport={"width": width, "height": 900}, color_scheme=scheme
                    )
                    _take(tab, address, options.look / f"overview-{width}-{scheme}.png", whole=True)
                    _open(tab)
                    _take(tab, tab.url, options.look / f"rollout-{width}-{scheme}.png", whole=True)
                    tab.close()
        else:
            tab = browser.new_page(viewport={"width": 1280, "height": 900})
            _take(tab, address, HERE / "report_overview.png")
            _open(tab)
            _take(tab, tab.url, HERE / "report.png")
        browser.close()


def _open(tab: Page) -> None:
    """The rollout that the README shows."""
    tab.locator("#rollouts tbody tr", has_text="half_inside").first.locator("a").first.click()
    tab.wait_for_selector(".timeline canvas")


def _take(tab: Page, address: str, path: Path, whole: bool = False) -> None:
    if tab.url != address:
        tab.goto(address)
    tab.wait_for_timeout(1500)
    picture = Image.open(io.BytesIO(tab.screenshot(full_page=whole))).convert("RGB")
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main()
