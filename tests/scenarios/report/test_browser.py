"""The page in a real browser: what it draws, how it moves, on a phone and on paper. Needs playwright and Chromium."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pytest
from opened_page import OpenedPage

from tlpsim.scenarios.report.document import Chart, Document, Row, Section, Table, Text, Verbatim
from tlpsim.scenarios.report.packing import pack, pack_times
from tlpsim.scenarios.report.page import page
from tlpsim.scenarios.report.writing import write_report
from tlpsim.scenarios.results import Results

playwright = pytest.importorskip("playwright.sync_api", reason="no playwright to drive a browser")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the page in")

SERIES = "document.querySelector('figure.series').tlpsimSeries"
# Colours of each canvas of a kind of figure, on a coarse grid of points.
COLOURS = """(figures) => figures.map((figure) => [...figure.querySelectorAll("canvas")].map((canvas) => {
  const copy = document.createElement("canvas");
  copy.width = copy.height = 96;
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0, 96, 96);
  const data = pen.getImageData(0, 0, 96, 96).data, found = new Set();
  for (let i = 0; i < data.length; i += 4) if (data[i + 3]) found.add(data.slice(i, i + 3).join());
  return found.size;
}))"""


@dataclass
class Opened(OpenedPage):
    """The page of a run."""

    dialogs: list[str] = field(default_factory=list)

    def until(self, condition: str) -> None:
        """Wait for a condition; the page's policy lets no waiting of playwright's own in."""
        end = monotonic() + 20.0
        while not self.page.evaluate(condition):
            assert monotonic() < end, condition
            self.settled()

    def view(self) -> list[float]:
        """The stretch of time that is shown, s."""
        self.settled()
        return self.page.evaluate(f"{SERIES}.stretch.view")

    def first(self, what: str) -> Any:
        """Something of the plot of the first panel, which is surge's."""
        return self.page.evaluate(f"[...{SERIES}.panels.values()][0].plot.{what}")


@pytest.fixture(scope="module")
def driver() -> Iterator[Any]:
    with playwright.sync_playwright() as found:
        yield found


@pytest.fixture(scope="module")
def browser(driver: Any) -> Iterator[Any]:
    """A browser without WebGL: the animation has tests of its own, and is slow where a processor draws it."""
    found = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-3d-apis"])
    yield found
    found.close()


@pytest.fixture(scope="module")
def opener(browser: Any) -> Iterator[Callable[..., Opened]]:
    contexts = []

    def opened(path: Path, **options: Any) -> Opened:
        context = browser.new_context(**({"viewport": {"width": 1120, "height": 480}} | options))
        contexts.append(context)
        found = Opened(context.new_page())
        found.page.on("dialog", lambda dialog: (found.dialogs.append(dialog.message), dialog.dismiss()))
        found.visit(path)
        return found

    yield opened
    for each in contexts:
        each.close()


@pytest.fixture(scope="module")
def report(record: Results, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of the short storm."""
    path = tmp_path_factory.mktemp("report") / "storm.html"
    write_report([record.path], path)
    return path


@pytest.fixture(scope="module")
def desktop(opener: Callable[..., Opened], report: Path) -> Opened:
    return opener(report)


@pytest.fixture
def storm_page(desktop: Opened) -> Opened:
    """The report on a desktop, showing the whole record from its top."""
    desktop.page.evaluate(f"{SERIES}.stretch.reset(); scrollTo(0, 0)")
    desktop.settled()
    return desktop


def drag(opened: Opened, begin: float, end: float) -> None:
    """Drag over a part of the first panel, in shares of its width."""
    area = opened.page.locator(".panel .u-over").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    mouse = opened.page.mouse
    mouse.move(box["x"] + begin * box["width"], box["y"] + 0.5 * box["height"])
    mouse.down()
    mouse.move(box["x"] + end * box["width"], box["y"] + 0.6 * box["height"], steps=4)
    mouse.up()


def test_nothing_fails_and_nothing_is_asked_for(storm_page: Opened, report: Path) -> None:
    assert storm_page.messages == []
    assert storm_page.requests == [report.as_uri()]
    assert not storm_page.page.locator(".banner").count()


def test_every_figure_is_drawn(storm_page: Opened) -> None:
    page_ = storm_page.page
    lines = page_.eval_on_selector_all("figure.lines", COLOURS)
    assert len(lines) == 2 + 7 + 2  # exceedances, spectra, processes
    panels = page_.eval_on_selector_all(".panel", COLOURS)
    assert len(panels) == 6 + 2 + 1 + 2  # motions, elevation and wind, tensions, loads in surge and pitch
    # Lines, frame and figures of axes: a blank canvas has one colour or none.
    assert all(len(each) == 1 and each[0] > 8 for each in (*lines, *panels))
    assert page_.locator("svg.track path.path").count() == 1
    for section in ("summary", "animation", "series", "track", "spectra", "loads", "tendons", "processes", "timing"):
        assert page_.locator(f"#{section}").count() == 1


def test_drag_shows_a_stretch_in_all_panels_down_to_samples(storm_page: Opened) -> None:
    before, scale = storm_page.view(), storm_page.first("scales.y")
    points = len(storm_page.first("data[0]"))
    drag(storm_page, 0.4, 0.45)
    after = storm_page.view()
    whole = before[1] - before[0]
    assert after[0] == pytest.approx(before[0] + 0.4 * whole, abs=0.01 * whole)
    assert after[1] == pytest.approx(before[0] + 0.45 * whole, abs=0.01 * whole)
    shown = storm_page.first("scales.y")
    assert shown["max"] - shown["min"] < scale["max"] - scale["min"]
    # 5 % of 400 s at 0.1 s, and a sample beyond either edge.
    assert len(storm_page.first("data[0]")) == pytest.approx(0.05 * whole / 0.1 + 2, abs=2) != points
    drawn = storm_page.page.evaluate(
        f"[...{SERIES}.panels.values()].filter((p) => !p.stale).map((p) => p.plot.scales.x.min)"
    )
    assert len(drawn) > 1
    assert drawn == pytest.approx([after[0]] * len(drawn))
    storm_page.page.locator(".panel .u-over").first.dblclick()
    assert storm_page.view() == before


def test_panels_out_of_sight_follow_when_they_come_into_sight(storm_page: Opened) -> None:
    drag(storm_page, 0.2, 0.5)
    after = storm_page.view()
    storm_page.page.locator(".panel").last.scroll_into_view_if_needed()
    storm_page.until(f"[...{SERIES}.panels.values()].at(-1).plot.scales.x.min === {after[0]}")


def test_wheel_and_keys(storm_page: Opened) -> None:
    area = storm_page.page.locator(".panel .u-over").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    before = storm_page.view()
    storm_page.page.evaluate("document.activeElement.blur()")
    storm_page.page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    storm_page.page.keyboard.down("Control")
    storm_page.page.mouse.wheel(0, -100)
    storm_page.page.keyboard.up("Control")
    near = storm_page.view()
    assert near[1] - near[0] < before[1] - before[0]
    # What the pointer is at stays where it is.
    assert near[0] + 0.25 * (near[1] - near[0]) == pytest.approx(before[0] + 0.25 * (before[1] - before[0]), abs=1.0)
    storm_page.page.locator(".plot").first.focus()
    storm_page.page.keyboard.press("ArrowRight")
    right = storm_page.view()
    assert right[0] > near[0]
    assert right[1] - right[0] == pytest.approx(near[1] - near[0])
    storm_page.page.keyboard.press("0")
    assert storm_page.view() == before


def test_without_control_the_wheel_scrolls_the_page(storm_page: Opened) -> None:
    area = storm_page.page.locator(".panel .u-over").first
    area.scroll_into_view_if_needed()
    storm_page.page.evaluate("document.activeElement.blur()")
    before, top = storm_page.view(), storm_page.page.evaluate("scrollY")
    box = area.bounding_box()
    storm_page.page.mouse.move(box["x"] + 50, box["y"] + 50)
    storm_page.page.mouse.wheel(0, 300)
    storm_page.until(f"scrollY > {top}")
    assert storm_page.view() == before


def test_values_at_the_pointer_are_those_of_the_record(storm_page: Opened, record: Results) -> None:
    area = storm_page.page.locator(".panel .u-over").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    storm_page.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 40)
    storm_page.settled()
    told = storm_page.page.locator(".panel .values").first.inner_text().replace("−", "-")
    time = float(storm_page.page.locator("#series .readout").first.inner_text().split()[2])
    surge = record.signal("platform.position.surge")[round(time / 0.1)]
    assert float(told) == pytest.approx(surge, abs=2e-3)


def test_the_largest_value_is_found(storm_page: Opened, record: Results) -> None:
    storm_page.page.get_by_label("surge: show the largest value", exact=True).click()
    surge = record.signal("platform.position.surge")
    time = 0.1 * int(np.argmax(surge))
    from_, to = storm_page.view()
    assert from_ <= time <= to
    assert to - from_ == pytest.approx(60.0)


def test_signals_are_chosen_and_lines_hidden(storm_page: Opened) -> None:
    page_ = storm_page.page
    count = page_.locator(".panel").count()
    page_.locator(".chooser summary").click()
    page_.get_by_label("search signals").fill("airgap")
    box = page_.locator(".choices label:visible input")
    assert box.count() == 1
    box.check()
    storm_page.until(f"document.querySelectorAll('.panel canvas').length === {count + 1}")
    box.uncheck()
    assert page_.locator(".panel").count() == count
    page_.get_by_label("search signals").fill("")
    page_.locator(".chooser summary").click()
    panel = page_.locator(".panel", has_text="loads in surge")
    before = page_.evaluate(f"[...{SERIES}.panels.values()].find((p) => p.names.length > 2).plot.scales.y.max")
    panel.get_by_role("button", name="wave.diffraction").click()
    after = page_.evaluate(f"[...{SERIES}.panels.values()].find((p) => p.names.length > 2).plot.scales.y.max")
    assert after < before
    panel.get_by_role("button", name="wave.diffraction").click()


def test_spectra_change_their_scales_together(storm_page: Opened) -> None:
    page_ = storm_page.page
    distributions = """() => [...document.querySelectorAll("#spectra figure.lines")].map((figure) => {
      const { x, y } = figure.tlpsimPlot().scales;
      return [x.distr, y.distr];
    })"""
    assert page_.evaluate(distributions) == [[3, 3]] * 7
    page_.locator("#spectra").get_by_role("button", name="lin–lin").click()
    assert page_.evaluate(distributions) == [[1, 1]] * 7
    page_.locator("#spectra").get_by_role("button", name="log–log").click()
    assert page_.evaluate(distributions) == [[3, 3]] * 7


def test_another_quantity_and_weibull_paper(storm_page: Opened) -> None:
    figure = storm_page.page.locator("#summary figure.lines")
    limits = "(figure) => [figure.tlpsimPlot().scales.x.max, figure.tlpsimPlot().scales.x.distr]"
    before = figure.evaluate(limits)
    figure.get_by_label("quantity").select_option(label="pitch")
    assert figure.evaluate(limits)[0] != before[0]
    figure.get_by_role("button", name="Weibull paper").click()
    assert figure.evaluate(limits)[1] == 3
    figure.get_by_role("button", name="logarithmic").click()
    figure.get_by_label("quantity").select_option(label="surge")
    assert figure.evaluate(limits) == before


@pytest.mark.parametrize("width", [380, 768])
def test_no_sideways_scroll_on_a_phone(opener: Callable[..., Opened], report: Path, width: int) -> None:
    size = {"width": width, "height": 800}
    found = opener(report, viewport=size, is_mobile=True, has_touch=True, device_scale_factor=2)
    assert found.messages == []
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    blocks = "[...document.querySelectorAll('main > section > *')]"
    assert found.page.evaluate(f"{blocks}.filter((e) => e.getBoundingClientRect().right > innerWidth).length") == 0
    assert not found.page.locator("nav details").get_attribute("open")


def test_fingers_move_and_pinch(opener: Callable[..., Opened], report: Path) -> None:
    found = opener(report, viewport={"width": 380, "height": 800}, is_mobile=True, has_touch=True)
    area = found.page.locator(".panel .u-over").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    session = found.page.context.new_cdp_session(found.page)

    def touch(kind: str, *places: float) -> None:
        points = [{"x": box["x"] + x * box["width"], "y": box["y"] + 30, "id": k} for k, x in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    before = found.view()
    touch("touchStart", 0.4, 0.6)
    for spread in (0.12, 0.16, 0.2, 0.3):
        touch("touchMove", 0.5 - spread, 0.5 + spread)
    touch("touchEnd")
    near = found.view()
    assert near[1] - near[0] == pytest.approx((before[1] - before[0]) / 3.0, rel=0.1)
    touch("touchStart", 0.6)
    for place in (0.58, 0.5, 0.4):
        touch("touchMove", place)
    touch("touchEnd")
    moved = found.view()
    assert moved[1] - moved[0] == pytest.approx(near[1] - near[0])
    assert moved[0] > near[0]


def test_dark_and_paper(opener: Callable[..., Opened], report: Path) -> None:
    dark = opener(report, color_scheme="dark")
    background = "getComputedStyle(document.body).backgroundColor"
    assert sum(int(each) for each in dark.page.evaluate(background)[4:-1].split(",")) < 150
    stroke = f"[...{SERIES}.panels.values()][0].plot.series[1].stroke()"
    on_screen = dark.page.evaluate(stroke)
    # What is printed is light, and as wide as the paper.
    dark.page.evaluate(
        f"addEventListener('beforeprint', () => {{ window.printed = [{stroke}, "
        f"[...{SERIES}.panels.values()][0].plot.width]; }})"
    )
    document = dark.page.pdf(format="A4")
    assert document.startswith(b"%PDF")
    colour, width = dark.page.evaluate("window.printed")
    assert colour == "#0072b2" != on_screen
    assert width == 680  # 182 mm between the margins of A4 are 688 pixels
    dark.settled()
    assert dark.page.evaluate(stroke) == on_screen
    assert dark.messages == []


# By other data


def shown(opener: Callable[..., Opened], path: Path, document: Document) -> Opened:
    path.write_text(page(document), encoding="utf-8")
    return opener(path)


def empty(*sections: Section, title: str = "Title") -> Document:
    return Document(title=title, subtitle="", status="complete", complete=True, head=(), sections=sections)


def test_arrays_are_read_back_as_they_were_packed(opener: Callable[..., Opened], tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    noise = rng.standard_normal(4001)
    noise[[0, 7, 4000]] = np.nan
    arrays = [
        noise,
        np.cumsum(np.cumsum(rng.standard_normal(3000))),
        np.full(10, 2.5),
        np.zeros(0),
        np.array([1e-30, 2e30]),
    ]
    times = [np.arange(500) * 0.1, np.sort(rng.uniform(0.0, 9.0, 40)), np.zeros(0)]
    found = shown(opener, tmp_path / "x.html", empty(Section(anchor="a", title="A", blocks=(Text(text="t"),))))
    for values in arrays:
        packed = pack(values)
        read = found.page.evaluate(f"async () => Array.from(await tlpsimUnpack({json.dumps(packed)}))")
        read = np.array([np.nan if each is None else each for each in read], dtype=float)
        room = 0.5 * packed["scale"] + 1e-7 * np.nanmax(
            np.abs(values), initial=0.0
        )  # half a step, and single precision
        np.testing.assert_allclose(read, values, rtol=0.0, atol=room)
    for values in times:
        read = found.page.evaluate(f"async () => Array.from(await tlpsimTimes({json.dumps(pack_times(values))}))")
        np.testing.assert_allclose(read, values, rtol=0.0, atol=1e-9)
    with pytest.raises(playwright.Error, match="bytes of an array"):
        found.page.evaluate(f"() => tlpsimUnpack({json.dumps(pack(noise) | {'count': 5})})")


def test_thinning_keeps_every_extreme(desktop: Opened) -> None:
    """Against the same by a plain loop over the samples that are in sight."""
    worst = desktop.page.evaluate("""() => {
      let seed = 1;
      const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
      const count = 20011, time = Float64Array.from({ length: count }, (_, i) => 0.1 * i);
      const values = Float32Array.from({ length: count }, () => random() - 0.5);
      for (let i = 5000; i < 5600; i++) values[i] = NaN;
      values[12345] = 9;
      values[12346] = -9;
      const signal = tlpsimThinning.signal(values, values, 1);
      const faults = [];
      for (let trial = 0; trial < 200; trial++) {
        const from = random() * 2000, to = from + random() ** 3 * 2000;
        const [times, shown] = tlpsimThinning.between(signal, time, from, to, 300);
        const inside = [...values].filter((v, i) => time[i] >= from && time[i] <= to && !Number.isNaN(v));
        const drawn = shown.filter((v) => v !== null);
        if (inside.length && Math.max(...drawn) < Math.max(...inside)) faults.push(["max", from, to]);
        if (inside.length && Math.min(...drawn) > Math.min(...inside)) faults.push(["min", from, to]);
        if (drawn.some((v) => !values.includes(v))) faults.push(["made up", from, to]);
        if (times.length > 2 * 300 + 20) faults.push(["many", times.length]);
        if (times.some((t, i) => i && t <= times[i - 1])) faults.push(["order", from, to]);
      }
      if (tlpsimThinning.extreme(signal, true) !== 12345) faults.push("largest");
      if (tlpsimThinning.extreme(signal, false) !== 12346) faults.push("smallest");
      const gap = tlpsimThinning.between(signal, time, 500, 560, 300)[1];
      if (!gap.includes(null)) faults.push("gap");
      return faults;
    }""")
    assert worst == []


def test_hostile_texts_stay_texts(opener: Callable[..., Opened], tmp_path: Path) -> None:
    bad = "</script><script>alert(1)</script><img src=x onerror=alert(2)><svg onload=alert(3)>"
    signal = {"unit": bad, "description": bad, "component": bad, "group": 1}
    signal["records"] = [{"group": 1, "values": pack(np.arange(9.0))}]
    content = {
        "records": [{"label": bad, "times": {bad: pack_times(np.arange(9.0))}}],
        "signals": {bad: signal, "__proto__": signal},
        "panels": [{"title": bad, "signals": [bad, "__proto__"], "shown": True}],
        "from": 0.0,
        "events": [{"time": 3.0, "label": bad}],
    }
    table = Table(caption=bad, headings=(bad, bad), rows=(Row(heading=bad, cells=(bad,)),), note=bad)
    blocks = (Text(text=bad), table, Verbatim(text=bad), Chart(kind="series", title=bad, content=content, caption=bad))
    found = shown(opener, tmp_path / "x.html", empty(Section(anchor="a", title=bad, blocks=blocks), title=bad))
    assert found.dialogs == []
    assert found.messages == []
    assert len(found.requests) == 1
    assert found.page.title() == bad
    assert found.page.locator(".panel canvas").count() == 1


def test_records_can_be_left_out(
    opener: Callable[..., Opened], written: Callable[..., Results], tmp_path: Path
) -> None:
    time = np.arange(3000) * 0.5
    files = [written({"spring.y": size * np.sin(time)}, {"spring.y": "m"}, title=f"Spring {size}") for size in (1, 5)]
    write_report([each.path for each in files], tmp_path / "x.html")
    found = opener(tmp_path / "x.html")
    assert found.messages == []
    limits = "scales.y.max"
    both = found.first(limits)
    found.page.get_by_role("checkbox", name="Spring 5").uncheck()
    found.until(f"[...{SERIES}.panels.values()][0].plot.series.length === 2")
    found.settled()
    assert found.first(limits) == pytest.approx(both / 5.0, rel=0.01)


def test_the_animation_stands_in_the_page(driver: Any, report: Path) -> None:
    drawing = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
    found = drawing.new_page()
    faults: list[str] = []
    found.on("pageerror", lambda error: faults.append(str(error)))
    found.goto(report.as_uri())
    found.evaluate("window.tlpsimReady")
    assert faults == []
    assert found.locator("#animation canvas").count() == 1
    drawing.close()


def test_without_scripts_tables_and_texts_are_there(browser: Any, report: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    found = context.new_page()
    found.goto(report.as_uri())
    assert found.locator("noscript, .banner").first.inner_text().startswith("Figures are drawn by scripts")
    assert found.locator("table").count() > 5
    assert found.locator("#summary caption").first.is_visible()
    context.close()
