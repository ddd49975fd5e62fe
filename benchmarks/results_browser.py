"""A report in headless Chromium, for benchmarks/results.py: console, network, figures, zoom."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from report import Row

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DRAWN = """() => [...document.querySelectorAll('canvas')].filter((canvas) => {
  const small = document.createElement('canvas');
  [small.width, small.height] = [64, 64];
  const context = small.getContext('2d');
  context.drawImage(canvas, 0, 0, 64, 64);
  return new Set(new Uint32Array(context.getImageData(0, 0, 64, 64).data.buffer)).size > 2;
}).length"""
RANGE = "() => ['from', 'to'].map((end) => Number(document.querySelector(`#series input[aria-label^=${end}]`).value))"


def rows(page: Path) -> Sequence[Row]:
    """Open a page, look at every figure, zoom into the time series by the mouse."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        return [Row(item="report in Chromium", measured="there is none here")]
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=FLAGS)
        tab = browser.new_page(viewport={"width": 1280, "height": 900})
        faults: list[str] = []
        requests: list[str] = []
        tab.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.on("request", lambda request: requests.append(request.url))
        tab.goto(page.resolve().as_uri())
        for number in range(tab.locator("canvas").count()):  # a figure is drawn when it is seen
            tab.locator("canvas").nth(number).scroll_into_view_if_needed()
            tab.wait_for_timeout(100)
        tab.wait_for_timeout(1000)
        canvases, drawn = tab.locator("canvas").count(), int(tab.evaluate(DRAWN))
        before = tab.evaluate(RANGE)
        _drag(tab)
        after = tab.evaluate(RANGE)
        browser.close()
    others = [url for url in requests if not url.startswith(("file:", "data:", "blob:"))]
    zoomed = bool(before and after and after[1] - after[0] < 0.6 * (before[1] - before[0]))
    wrong = [*faults, *others]
    said = f"{len(faults)}; {len(others)}" if not wrong else wrong[0][:60]
    return [
        Row(item="in Chromium: errors; requests to a network", measured=said, bound="0; 0", ok=not wrong),
        Row(item="the same: figures drawn", measured=f"{drawn} of {canvases}", bound="≥ 10", ok=drawn >= 10),
        Row(item="the same: range after a drag of half of it, s", measured=f"{after}", bound="less", ok=zoomed),
    ]


def _drag(tab: object) -> None:
    tab.locator("#series .u-over").first.scroll_into_view_if_needed()  # type: ignore[attr-defined]
    box = tab.locator("#series .u-over").first.bounding_box()  # type: ignore[attr-defined]
    middle = box["y"] + 0.5 * box["height"]
    mouse = tab.mouse  # type: ignore[attr-defined]
    mouse.move(box["x"] + 0.25 * box["width"], middle)
    mouse.down()
    mouse.move(box["x"] + 0.75 * box["width"], middle, steps=8)
    mouse.up()
    tab.wait_for_timeout(500)  # type: ignore[attr-defined]
