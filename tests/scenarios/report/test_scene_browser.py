"""The animation in a browser: what it draws and where, by the page's own scripts. Needs playwright and Chromium."""

import json
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from tlpsim.loads.platform.body import rotation_matrix
from tlpsim.loads.waves.spreading import spread_directions
from tlpsim.scenarios.report.scene import scene_content, scene_scripts
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to draw in")

SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DEPTH, PERIOD, HEADING, AMPLITUDE = 60.0, 12.0, 0.7, 2.5
DEGREES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
PAGE = """<!doctype html><html><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'">
<style>:root {{ color-scheme: light dark; }}</style></head><body>{before}<div id="here"></div>
<script>{unpack}</script><script>{scripts}</script>
<script>window.ready = tlpsimScene.mount(document.getElementById("here"), {content}, tlpsimUnpack)
  .then((scene) => {{ window.scene = scene; return scene !== null; }});</script></body></html>"""
# How many colours the picture has, on a coarse grid of points, and a sum over them by which two pictures differ.
PICTURE = """() => {
  const canvas = document.querySelector("canvas"), copy = document.createElement("canvas");
  copy.width = copy.height = 64;
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0, 64, 64);
  const data = pen.getImageData(0, 0, 64, 64).data, colours = new Set();
  for (let i = 0; i < data.length; i += 4) colours.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]);
  return { colours: colours.size, data: Array.from(data) };
}"""


@dataclass
class Opened:
    """A page, and what went wrong in it."""

    page: Any
    messages: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def settled(self) -> None:
        """Wait until what was asked for is drawn."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def until(self, condition: str) -> None:
        """Wait for a condition; `wait_for_function` would need eval, which the page's policy forbids."""
        self.page.evaluate(
            "() => new Promise((done, fail) => {"
            f"  const watch = setInterval(() => {{ if ({condition}) {{ clearInterval(watch); done(); }} }}, 20);"
            "  setTimeout(() => fail(new Error('it never came')), 30000); })"
        )

    def seek(self, seconds: float) -> None:
        self.page.evaluate("(seconds) => { scene.seek(seconds); scene.draw(); }", seconds)

    def picture(self) -> np.ndarray:
        return np.array(self.page.evaluate(PICTURE)["data"], dtype=float)

    def text(self) -> str:
        return str(self.page.inner_text("#here"))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=[*SOFTWARE, "--ignore-gpu-blocklist"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def open_page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Opened]:
    def opened(content: dict[str, Any] | None, *, script: str = "", before: str = "", **options: Any) -> Opened:
        unpack = (resources.files("tlpsim.scenarios.report") / "assets" / "unpack.js").read_text()
        html = PAGE.format(content=json.dumps(content), unpack=unpack, scripts=scene_scripts(), before=before)
        file = tmp_path_factory.mktemp("page") / "page.html"
        file.write_text(html)
        result = Opened(page=browser.new_page(**({"viewport": {"width": 800, "height": 800}} | options)))
        result.page.on("console", lambda message: result.messages.append(message.text))
        result.page.on("pageerror", lambda error: result.messages.append(str(error)))
        result.page.on("request", lambda request: result.requests.append(request.url))
        if script:
            result.page.add_init_script(script)
        result.page.goto(file.as_uri())
        result.page.evaluate("ready")
        return result

    return opened


@pytest.fixture(scope="module")
def storm(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A spread sea at the displaced platform, which loses tendon 2 at 30 s; no wind."""
    folder = tmp_path_factory.mktemp("storm")
    (folder / "loss.csv").write_text("time [s],intact [1]\n0,1\n30,0\n")
    loss = {"fmu": str(folder / "loss.csv"), "step": 0.1, "parameters": {"interpolation": "hold", "beyond": "hold"}}
    chosen = Scenario.from_dict(
        {
            "simulation": {"duration": 60.0},
            "platform": {"hydrodynamics": "morison", "radiation": "none"},
            "waves": {"directions": 3},
            "components": {"wind": {"fmu": ""}, "loss": loss},
            "connections": {"platform.tendon_intact[2]": {"from": "loss.intact"}},
        }
    )
    return run_scenario(chosen, folder / "r.h5")


@pytest.fixture(scope="module")
def regular(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """An elevation from a table, a regular wave at the origin in shallow water; the platform rests."""
    folder = tmp_path_factory.mktemp("regular")
    times = np.arange(0.0, 400.01, 0.5)
    rows = [f"{t},{AMPLITUDE * math.cos(2.0 * math.pi / PERIOD * t)!r}" for t in times]
    (folder / "wave.csv").write_text("time [s],elevation [m]\n" + "\n".join(rows) + "\n")
    chosen = Scenario.from_dict(
        {
            "simulation": {"duration": 400.0, "start": "rest"},
            "site": {"water_depth": DEPTH},
            "platform": {"hydrodynamics": "morison", "radiation": "none"},
            "waves": {"heading_deg": math.degrees(HEADING)},
            "components": {"wind": {"fmu": ""}, "wave": {"fmu": str(folder / "wave.csv"), "step": 0.5}},
            "connections": {"platform.wave_force.*": {"from": ""}},
        }
    )
    return run_scenario(chosen, folder / "r.h5")


@pytest.fixture(scope="module")
def storm_page(open_page: Callable[..., Opened], storm: Results) -> Opened:
    return open_page(scene_content(storm))


def test_it_is_drawn_without_a_complaint_and_without_the_network(storm_page: Opened) -> None:
    storm_page.settled()
    assert storm_page.page.evaluate(PICTURE)["colours"] > 100
    assert storm_page.messages == []
    assert [url.split(":")[0] for url in storm_page.requests] == ["file"]


def test_the_slider_changes_the_picture_and_the_time(storm_page: Opened) -> None:
    storm_page.seek(0.0)
    before = storm_page.picture()
    slider = storm_page.page.locator("input[type=range]")
    assert slider.get_attribute("max") == "120"
    slider.fill("50")
    storm_page.settled()
    assert storm_page.page.evaluate("scene.seconds()") == 25.0
    assert "25.0 s (0:00:25)" in storm_page.text()
    assert np.abs(storm_page.picture() - before).mean() > 0.5


def test_it_plays_when_told_at_the_speed_told_and_stops_at_the_end(storm_page: Opened) -> None:
    page = storm_page.page
    storm_page.seek(0.0)
    page.wait_for_timeout(100)
    assert page.evaluate("scene.seconds()") == 0.0  # never by itself
    before = storm_page.picture()
    page.get_by_label("Speed").select_option("20")
    page.get_by_role("button", name="Play").click()
    storm_page.until("scene.seconds() > 3")
    assert np.abs(storm_page.picture() - before).mean() > 0.5
    page.get_by_role("button", name="Pause").click()
    storm_page.settled()
    paused = page.evaluate("scene.seconds()")
    page.wait_for_timeout(100)
    assert page.evaluate("scene.seconds()") == paused
    page.get_by_label("Speed").select_option("50")
    page.get_by_role("button", name="Play").click()
    storm_page.until("scene.seconds() === 60")
    page.get_by_role("button", name="Play").wait_for()


@pytest.mark.parametrize("factor", [1, 20])
def test_points_of_the_body_are_where_the_platforms_rotation_puts_them(
    storm_page: Opened, storm: Results, factor: int
) -> None:
    storm_page.page.get_by_label("Heave, roll, pitch").select_option(str(factor))
    storm_page.seek(45.0)
    index = int(np.argmin(np.abs(storm.time("platform") - 45.0)))
    pose = np.array([storm.signal(f"platform.position.{degree}")[index] for degree in DEGREES])
    drawn = pose * np.array([1, 1, factor, factor, factor, 1])
    for point in ([43.125, 43.125, -35.0], [-43.125, 20.0, 22.5], [0.0, 0.0, 0.0]):
        expected = drawn[:3] + rotation_matrix(drawn[3:]) @ point
        # 16 bits of the range of each motion, turned by the largest lever, 70 m.
        np.testing.assert_allclose(
            storm_page.page.evaluate("(point) => scene.pointInEarth(point)", point), expected, atol=2e-3 * factor
        )
    assert ("20 times as large" in storm_page.text()) == (factor == 20)
    assert ("All motions true to scale" in storm_page.text()) == (factor == 1)


def test_the_order_of_large_rotations_is_that_of_the_platform(open_page: Callable[..., Opened], storm: Results) -> None:
    content = scene_content(storm)
    assert content is not None
    pose = [3.0, -2.0, 1.0, 0.5, -0.4, 1.1]
    content["position"] = [{**content["position"][0], "count": 2, "offset": value, "scale": 0.0} for value in pose]
    content["time"]["count"] = 2
    two = "eNpjYGBgAAAABAAB"  # four zero bytes, deflated
    content["position"] = [{**packed, "differences": 0, "data": two} for packed in content["position"]]
    opened = open_page(content)
    opened.seek(0.0)
    for point in ([10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]):
        expected = np.array(pose[:3]) + rotation_matrix(np.array(pose[3:])) @ point
        np.testing.assert_allclose(opened.page.evaluate("(p) => scene.pointInEarth(p)", point), expected, atol=1e-5)
    opened.page.close()


def test_the_surface_at_the_platform_is_the_recorded_one(storm_page: Opened, storm: Results) -> None:
    made, recorded = [], []
    for index in range(0, 121, 5):
        storm_page.seek(0.5 * index)
        made.append(storm_page.page.evaluate("scene.elevation(...scene.pose().slice(0, 2))"))
        recorded.append(storm.signal("wave.elevation")[index])
    # The profile is linear over 2 m, which takes 4 % off a wave of 20 m; the ends of the record are mirrored.
    assert np.std(np.array(made) - np.array(recorded)) < 0.04 * np.std(recorded)


def test_a_spread_sea_has_crests_of_an_end(storm_page: Opened, storm: Results) -> None:
    parts = spread_directions(math.radians(21.6), 10.0, 3)
    content = scene_content(storm)
    assert content is not None
    assert content["sea"]["heading"] == pytest.approx(sorted(parts.heading))
    storm_page.seek(30.0)
    along = storm_page.page.evaluate(
        "(beta) => [...Array(50).keys()].map((i) => scene.elevation(-8 * i * Math.sin(beta), 8 * i * Math.cos(beta)))",
        math.radians(21.6),
    )
    assert np.ptp(along) > 0.5 * np.std(storm.signal("wave.elevation"))


def test_a_regular_wave_has_the_length_and_the_speed_of_the_dispersion_relation(
    open_page: Callable[..., Opened], regular: Results
) -> None:
    content = scene_content(regular)
    assert content is not None
    assert content["arrows"][0]["name"] == "current"  # of a table no heading is known
    opened = open_page(content)
    omega = 2.0 * math.pi / PERIOD
    k = brentq(lambda k: 9.80665 * k * math.tanh(k * DEPTH) - omega**2, 1e-6, 1.0)
    assert 2.0 * math.pi / k < 0.97 * 9.80665 * PERIOD**2 / (2.0 * math.pi)  # so that the depth matters
    places = np.array([[s * math.cos(HEADING) - n * math.sin(HEADING), s * math.sin(HEADING) + n * math.cos(HEADING)]
                       for s in np.linspace(-220.0, 220.0, 23) for n in (-100.0, 0.0, 150.0)])  # fmt: skip
    for time in (180.0, 183.7):
        opened.seek(time)
        made = opened.page.evaluate("(places) => places.map(([x, y]) => scene.elevation(x, y))", places.tolist())
        s = places @ [math.cos(HEADING), math.sin(HEADING)]
        np.testing.assert_allclose(made, AMPLITUDE * np.cos(omega * time - k * s), atol=0.02 * AMPLITUDE)
    assert opened.messages == []
    opened.page.close()


def test_a_lost_tendon_is_told(storm_page: Opened) -> None:
    storm_page.seek(29.0)
    assert "lost: tendon" not in storm_page.text()
    storm_page.seek(31.0)
    assert "lost: tendon 2" in storm_page.text()
    assert "dashed: slack, or lost" in storm_page.text()


def test_the_extreme_tensions_are_told(storm_page: Opened, storm: Results) -> None:
    storm_page.seek(20.0)
    index = int(np.argmin(np.abs(storm.time("platform") - 20.0)))
    tensions = [storm.signal(f"platform.tendon_tension[{k + 1}]")[index] / 1e6 for k in range(12)]
    assert f"tension {min(tensions):.2f} MN" in storm_page.text()
    assert f"to {max(tensions):.2f} MN" in storm_page.text()


def test_dragging_turns_the_view_and_buttons_choose_one(storm_page: Opened) -> None:
    page = storm_page.page
    page.get_by_role("button", name="Close").click()
    storm_page.settled()
    pictures = [storm_page.picture()]
    box = page.locator("canvas").bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 0.5 * box["height"], steps=3)
    page.mouse.up()
    for name in ("", "Whole", "Above", "Side"):
        if name:
            page.get_by_role("button", name=name).click()
        storm_page.settled()
        pictures.append(storm_page.picture())
    for i, one in enumerate(pictures):
        assert all(np.abs(one - other).mean() > 2.0 for other in pictures[i + 1 :])


def test_it_is_drawn_for_print_though_nobody_saw_it(open_page: Callable[..., Opened], storm: Results) -> None:
    opened = open_page(scene_content(storm), before='<div style="height: 5000px"></div>')
    opened.settled()
    assert opened.page.evaluate(PICTURE)["colours"] == 1  # not drawn where it is not seen
    opened.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert opened.page.evaluate(PICTURE)["colours"] > 100
    opened.page.close()


def test_a_phone_in_the_dark(open_page: Callable[..., Opened], storm: Results) -> None:
    options = {"viewport": {"width": 390, "height": 780}, "color_scheme": "dark", "has_touch": True, "is_mobile": True}
    opened = open_page(scene_content(storm), before='<meta name="viewport" content="width=device-width">', **options)
    opened.settled()
    assert opened.page.evaluate(PICTURE)["colours"] > 100
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 390
    for control in opened.page.locator("button, select, input").all():
        assert control.bounding_box()["height"] >= 44
    background = opened.page.evaluate("getComputedStyle(document.querySelector('.view')).backgroundColor")
    assert sum(map(int, background[4:-1].split(","))) < 200
    opened.page.close()


def test_without_webgl_a_sentence_says_so(open_page: Callable[..., Opened], storm: Results) -> None:
    script = "HTMLCanvasElement.prototype.getContext = () => null"
    opened = open_page(scene_content(storm), script=script)
    assert "needs WebGL 2" in opened.text()
    assert opened.page.evaluate("ready") is False
    assert opened.messages == []
    opened.page.close()
