"""The page of a sweep in a real browser: figures that are linked. Needs playwright and Chromium."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from opened_page import OpenedPage
from sweep_by_hand import HEADINGS, HEIGHT, HEIGHTS, MEAN, PERIODS, SURGE, fail, surge, table

from tlpsim.scenarios.report.page import page
from tlpsim.scenarios.report.sweep_content import sweep_document
from tlpsim.scenarios.sweep.table import SweepTable

playwright = pytest.importorskip("playwright.sync_api", reason="no playwright to drive a browser")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the page in")

CELLS = "document.querySelector('figure.sweep_cells').tlpsimCells"
SCATTER = "document.querySelector('figure.sweep_scatter').tlpsimScatter"
PARALLEL = "document.querySelector('figure.sweep_parallel').tlpsimParallel"
DOMAINS = "document.querySelector('figure.sweep_domains').tlpsimDomains"


class Opened(OpenedPage):
    """The page of a sweep."""

    def ask(self, what: str) -> Any:
        """Value of an expression, once what was asked for is drawn."""
        self.settled()
        return self.page.evaluate(f"() => {what}")

    def selected(self) -> list[int] | None:
        """Rows that are selected, None for all."""
        mask = self.ask("tlpsimSweep.selected() && [...tlpsimSweep.selected()]")
        return None if mask is None else np.flatnonzero(mask).tolist()

    def table_cases(self) -> list[str]:
        self.settled()
        return self.page.locator(".sweep_worst tbody tr th").all_inner_texts()

    def at(self, figure: str, x: float, y: float) -> tuple[float, float]:
        """Place on the screen of one on a figure's canvas, pixels."""
        canvas = self.page.locator(f"figure.{figure} canvas").last
        canvas.evaluate("(canvas) => canvas.scrollIntoView({ block: 'center', behavior: 'instant' })")
        box = canvas.bounding_box()
        return box["x"] + x, box["y"] + y

    def click(self, figure: str, x: float, y: float) -> None:
        self.page.mouse.click(*self.at(figure, x, y))

    def drag(self, figure: str, begin: tuple[float, float], end: tuple[float, float]) -> None:
        mouse = self.page.mouse
        mouse.move(*self.at(figure, *begin))
        mouse.down()
        mouse.move(*self.at(figure, *end), steps=6)
        mouse.up()

    def cell(self, column: int, row: int) -> tuple[float, float]:
        """Middle of a cell of the map, on its canvas."""
        grid = self.ask(f"(({{ box, wide, high }}) => [box.left, box.bottom, wide, high])({CELLS}.cells())")
        return grid[0] + (column + 0.5) * grid[2], grid[1] - (row + 0.5) * grid[3]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-3d-apis"])
        yield found
        found.close()


@pytest.fixture(scope="module")
def opener(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Opened]]:
    folder, contexts = tmp_path_factory.mktemp("sweep"), []

    def opened(given: SweepTable, **options: Any) -> Opened:
        path: Path = folder / f"{len(contexts)}.html"
        path.write_text(page(sweep_document(given)), encoding="utf-8")
        context = browser.new_context(
            **({"viewport": {"width": 1120, "height": 900}, "reduced_motion": "reduce"} | options)
        )
        contexts.append(context)
        found = Opened(context.new_page())
        found.visit(path)
        return found

    yield opened
    for each in contexts:
        each.close()


@pytest.fixture(scope="module")
def desktop(opener: Callable[..., Opened]) -> Opened:
    return opener(table())


@pytest.fixture
def swept(desktop: Opened) -> Iterator[Opened]:
    """The table by hand, nothing selected, as it is at first."""
    yield desktop
    desktop.page.evaluate("""() => {
      tlpsimSweep.clear();
      document.querySelector("figure.sweep_worst").tlpsimWorst.state.sort = "";
      tlpsimSweep.choose("signal", "platform.position.surge");
      tlpsimSweep.choose("statistic", "expected_extreme");
      tlpsimSweep.choose("domain", "frequency");
      scrollTo(0, 0);
    }""")
    desktop.page.mouse.move(0, 0)
    desktop.settled()
    assert desktop.messages == []


def rows_where(given: SweepTable, **limits: tuple[float, float]) -> list[int]:
    """Rows whose settings are within limits."""
    keys = {each.rpartition(".")[2]: each for each in given.keys}
    good = np.ones(given.rows, dtype=bool)
    for name, (low, high) in limits.items():
        good &= (given.columns[keys[name]] >= low) & (given.columns[keys[name]] <= high)
    return np.flatnonzero(good).tolist()


def test_nothing_fails_and_nothing_is_asked_for(swept: Opened) -> None:
    assert swept.messages == []
    assert len(swept.requests) == 1
    assert not swept.page.locator(".banner").count()
    assert swept.page.locator("figure.sweep").inner_text().startswith("96 jobs of 24 cases")


def test_the_page_reads_what_the_table_has(swept: Opened) -> None:
    given = table()
    for name in (f"{SURGE}|expected_maximum", f"{SURGE}|std", HEIGHT):
        signal, _, statistic = name.partition("|")
        expected = given.columns[f"{signal}.{statistic}" if statistic else name]
        read = swept.ask(f"Array.from({{ length: 96 }}, (_, row) => tlpsimSweep.data.column('{name}').of(row))")
        np.testing.assert_allclose(read, expected, rtol=0, atol=np.ptp(expected) / 65534)


@pytest.mark.parametrize(("domain", "factor"), [("frequency", 1.0), ("time", MEAN)])
def test_each_cell_is_the_worst_heading_of_means_over_replicates(swept: Opened, domain: str, factor: float) -> None:
    swept.page.locator(".sweep_cells select[aria-label='domain']").select_option(domain)
    cells = np.reshape(swept.ask(f"{CELLS}.cells().cells.map(({{ value }}) => value)"), (4, 3))
    expected = [[factor * max(surge(h, t, b) for b in HEADINGS) for t in PERIODS] for h in HEIGHTS]
    np.testing.assert_allclose(cells, expected, rtol=1e-3)  # packed to 1/65534 of the range


def test_a_setting_can_be_held(swept: Opened) -> None:
    chooser = swept.page.locator(".sweep_cells select[aria-label='waves heading']")
    chooser.select_option("1")
    cells = np.reshape(swept.ask(f"{CELLS}.cells().cells.map(({{ value }}) => value)"), (4, 3))
    np.testing.assert_allclose(cells, [[surge(h, t, 90.0) for t in PERIODS] for h in HEIGHTS], rtol=1e-3)
    assert "waves heading 90 deg" in swept.page.locator(".sweep_cells figcaption").inner_text()
    chooser.select_option("")
    assert "worst of 2 values of waves heading" in swept.page.locator(".sweep_cells figcaption").inner_text()


def test_a_click_on_a_cell_selects_its_sea_state_everywhere(swept: Opened) -> None:
    swept.click("sweep_cells", *swept.cell(1, 2))
    chosen = rows_where(table(), significant_height=(6.0, 6.0), peak_period=(10.0, 10.0))
    assert swept.selected() == chosen
    assert len(chosen) == 8  # two headings, a frequency domain and three replicates
    assert len(swept.table_cases()) == 8
    assert swept.page.locator("figure.sweep .count").inner_text() == "8 jobs (2 cases) of 96 selected"
    bright = swept.ask(f"{SCATTER}.points().filter(({{ faint }}) => !faint).map(({{ row }}) => row)")
    assert set(bright) == set(chosen) & set(np.flatnonzero(table().columns["domain"] == "frequency").tolist())
    swept.page.get_by_role("button", name="Clear selection").click()
    assert swept.selected() is None
    assert len(swept.table_cases()) == 10


def test_a_drag_over_the_map_selects_a_block_and_shift_adds_to_it(swept: Opened) -> None:
    swept.drag("sweep_cells", swept.cell(0, 0), swept.cell(1, 1))
    block = rows_where(table(), significant_height=(2.0, 4.0), peak_period=(8.0, 10.0))
    assert swept.selected() == block
    swept.page.keyboard.down("Shift")
    swept.click("sweep_cells", *swept.cell(2, 3))
    swept.page.keyboard.up("Shift")
    more = rows_where(table(), significant_height=(8.0, 8.0), peak_period=(12.0, 12.0))
    assert swept.selected() == sorted(block + more)


def test_the_map_goes_by_keys(swept: Opened) -> None:
    swept.page.locator(".sweep_cells canvas").last.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowUp"):  # from the cell at the lower left
        swept.page.keyboard.press(key)
    assert "peak period 12 s" in swept.page.locator(".sweep_cells .unseen").inner_text()
    swept.page.keyboard.press("Enter")
    assert swept.selected() == rows_where(table(), significant_height=(4.0, 4.0), peak_period=(12.0, 12.0))
    swept.page.keyboard.press("Escape")
    assert swept.selected() is None


def axis_place(swept: Opened, number: int, value: float) -> tuple[float, float]:
    """Place of a value on an axis of the parallel coordinates, on their canvas."""
    return tuple(swept.ask(f"[{PARALLEL}.across({number}), {PARALLEL}.up({PARALLEL}.axes[{number}], {value})]"))


def test_brushes_on_axes_work_together(swept: Opened) -> None:
    swept.drag("sweep_parallel", axis_place(swept, 0, 3.5), axis_place(swept, 0, 6.5))
    assert swept.selected() == rows_where(table(), significant_height=(4.0, 6.0))
    swept.drag("sweep_parallel", axis_place(swept, 1, 9.0), axis_place(swept, 1, 10.5))
    both = rows_where(table(), significant_height=(4.0, 6.0), peak_period=(10.0, 10.0))
    assert swept.selected() == both
    # What is left is what all figures agree on; each of them lets go by itself.
    swept.click("sweep_cells", *swept.cell(1, 1))
    assert swept.selected() == rows_where(table(), significant_height=(4.0, 4.0), peak_period=(10.0, 10.0))
    swept.page.get_by_role("button", name="Remove: peak period 10, significant height 4").click()
    assert swept.selected() == both
    swept.page.mouse.dblclick(*swept.at("sweep_parallel", *axis_place(swept, 1, 9.0)))
    assert swept.selected() == rows_where(table(), significant_height=(4.0, 6.0))


def test_a_brush_moves_and_a_further_one_adds(swept: Opened) -> None:
    swept.drag("sweep_parallel", axis_place(swept, 0, 3.5), axis_place(swept, 0, 4.5))
    swept.drag("sweep_parallel", axis_place(swept, 0, 4.0), axis_place(swept, 0, 6.0))
    assert swept.selected() == rows_where(table(), significant_height=(6.0, 6.0))
    swept.page.keyboard.down("Shift")
    swept.drag("sweep_parallel", axis_place(swept, 0, 1.9), axis_place(swept, 0, 2.5))
    swept.page.keyboard.up("Shift")
    assert swept.selected() == sorted(
        rows_where(table(), significant_height=(6.0, 6.0)) + rows_where(table(), significant_height=(2.0, 2.0))
    )
    swept.page.mouse.dblclick(*swept.at("sweep_parallel", *axis_place(swept, 0, 7.5)))
    assert swept.selected() is None


def test_axes_are_dragged_and_limited_by_fields(swept: Opened) -> None:
    names = f"{PARALLEL}.axes.map(({{ column }}) => column.name)"
    before = swept.ask(names)
    x, _ = axis_place(swept, 0, 2.0)
    to, _ = axis_place(swept, 2, 0.0)
    swept.drag("sweep_parallel", (x, 60.0), (to, 60.0))
    assert swept.ask(names) == [before[1], before[2], before[0], *before[3:]]
    fields = swept.page.locator(".sweep_parallel .controls.axes")
    fields.get_by_role("button", name="Move this axis to the left").click()
    fields.get_by_role("button", name="Move this axis to the left").click()
    assert swept.ask(names) == before
    fields.get_by_label("from of the axis").fill("5")
    fields.get_by_label("from of the axis").press("Enter")
    assert swept.selected() == rows_where(table(), significant_height=(6.0, 8.0))
    fields.get_by_role("button", name="Clear this axis").click()
    assert swept.selected() is None
    fields.get_by_label("axis", exact=True).select_option(label="domain")
    fields.get_by_label("keep").select_option(label="time")
    assert swept.selected() == np.flatnonzero(table().columns["domain"] == "time").tolist()


def test_a_point_tells_its_job_and_selects_its_case(swept: Opened) -> None:
    point = swept.ask(f"(({{ row, x, y }}) => ({{ row, x, y }}))({SCATTER}.points().at(-2))")
    given = table()
    place = swept.at("sweep_scatter", point["x"], point["y"])
    swept.page.mouse.move(*place)
    swept.settled()
    told = swept.page.locator(".tip").inner_text()
    case = int(given.columns["case"][point["row"]])
    assert f"case {case}, frequency domain" in told
    assert f"{given.columns[f'{SURGE}.expected_maximum'][point['row']]:.2f}" in told
    assert swept.ask("tlpsimSweep.hovered") == point["row"]
    swept.page.mouse.click(*place)
    assert swept.selected() == np.flatnonzero(given.columns["case"] == case).tolist()


def test_a_drag_over_points_selects_their_jobs(swept: Opened) -> None:
    points = swept.ask(f"{SCATTER}.points().map(({{ row, x, y }}) => [row, x, y])")
    left = [each for each in points if each[1] == points[0][1]]
    top = min(y for _, _, y in left)
    bottom = max(y for _, _, y in left)
    swept.drag("sweep_scatter", (left[0][1] - 15, top - 8), (left[0][1] + 15, bottom + 8))
    assert swept.selected() == sorted(row for row, _, _ in left)


def test_headings_go_around_a_circle(swept: Opened) -> None:
    swept.page.get_by_role("button", name="around the circle").click()
    points = swept.ask(f"{SCATTER}.points().map(({{ row, x, y }}) => [row, x, y])")
    width = swept.page.locator(".sweep_scatter canvas").first.bounding_box()
    centre = (width["width"] / 2, width["height"] / 2)
    given = table()
    for row, x, y in points:
        heading, value = given.columns["waves.heading_deg"][row], given.columns[f"{SURGE}.expected_maximum"][row]
        angle = np.degrees(np.arctan2(centre[1] - y, x - centre[0]))
        assert angle == pytest.approx(heading, abs=0.5)
        radius = np.hypot(x - centre[0], y - centre[1])
        assert radius == pytest.approx(value / surge(8.0, 12.0, 0.0) * (centre[1] - 30), rel=2e-3, abs=0.5)
    swept.page.get_by_role("button", name="around the circle").click()


def test_domains_are_compared_case_by_case(swept: Opened) -> None:
    pairs = swept.ask(f"{DOMAINS}.points().map(({{ across, mean, low, high }}) => [across, mean, low, high])")
    assert len(pairs) == 24
    for across, *rest in pairs:
        np.testing.assert_allclose(np.array(rest) / across, [MEAN, 0.95, 1.08], rtol=2e-3)
    told = swept.page.locator(".sweep_domains .small").first.inner_text()
    assert told.startswith(f"Time over frequency domain: {MEAN:.2f} in the median")
    assert "100 % of 24 cases within 10 %" in told


def test_what_is_shown_is_chosen_once_for_all_figures(swept: Opened) -> None:
    swept.page.locator(".sweep_worst select[aria-label='signal']").select_option("tendons")
    swept.settled()
    captions = swept.page.locator("figure.chart figcaption").all_inner_texts()
    assert sum("governing tension, expected maximum" in each for each in captions) == 4
    assert swept.page.locator(".sweep_cells select[aria-label='signal']").input_value() == "tendons"
    offered = swept.page.locator(".sweep_cells select[aria-label='statistic'] option").all_inner_texts()
    assert offered == ["expected maximum, MN", "expected minimum, MN", "minimum, MN"]


def test_the_table_has_the_worst_first_and_sorts(swept: Opened) -> None:
    given = table()
    order = np.argsort(-given.columns[f"{SURGE}.expected_maximum"], kind="stable")[:10]
    assert swept.table_cases() == [str(case) for case in given.columns["case"][order]]
    swept.page.locator(".sweep_worst thead button", has_text="peak period").click()
    swept.page.locator(".sweep_worst thead button", has_text="peak period").click()
    values = swept.page.locator(".sweep_worst tbody tr td:nth-child(6)").all_inner_texts()
    assert values == sorted(values, key=float)
    assert set(swept.table_cases()) == {str(case) for case in given.columns["case"][order]}
    assert swept.page.locator(".sweep_worst th[aria-sort='ascending']").inner_text().startswith("peak period, s")
    swept.page.locator(".sweep_worst select[aria-label='statistic']").select_option("expected_minimum")
    lowest = np.argmin(given.columns[f"{SURGE}.expected_minimum"])
    assert str(given.columns["case"][lowest]) in swept.table_cases()


def test_a_row_of_the_table_selects_its_job(swept: Opened) -> None:
    swept.page.locator(".sweep_worst tbody tr button").first.click()
    (row,) = swept.selected() or []
    assert row == int(np.argmax(table().columns[f"{SURGE}.expected_maximum"]))
    assert len(swept.table_cases()) == 10  # its own choice does not empty it
    assert swept.page.locator(".sweep_worst tr.chosen").count() == 1


def test_failed_jobs_leave_a_mark_in_the_map(opener: Callable[..., Opened]) -> None:
    def corner(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            if (row[HEIGHT], row["waves.peak_period"]) == (8.0, 8.0):
                fail(row, "too steep")

    opened = opener(table(change=corner, domains=("frequency",)))
    grid = opened.ask(f"{CELLS}.cells().cells.map(({{ value, failed }}) => [Number.isNaN(value), failed])")
    assert [number for number, (missing, _) in enumerate(grid) if missing] == [9]  # 3 cells a row from below
    assert grid[9] == [True, 2]
    opened.page.mouse.move(*opened.at("sweep_cells", *opened.cell(0, 3)))
    assert opened.page.locator(".tip").inner_text().startswith("failed")
    assert opened.messages == []


def test_settings_of_words_and_of_a_design(opener: Callable[..., Opened]) -> None:
    def words(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row["waves.spectrum"] = ("jonswap", "torsethaugen")[row["case"] % 2]

    draughts = ({"platform.draught": 35.0}, {"platform.draught": 38.0})
    keys = (HEIGHT, "waves.spectrum", "platform.draught")
    opened = opener(table(change=words, variants=draughts, keys=keys))
    opened.page.locator(".sweep_scatter select[aria-label='across']").select_option("platform.draught")
    opened.page.locator(".sweep_scatter select[aria-label='colour']").select_option("waves.spectrum")
    opened.settled()
    # Along a setting of the design all variants are shown.
    assert opened.ask(f"{SCATTER}.points().length") == 48
    legend = opened.page.locator(".sweep_scatter .legend").inner_text().split()
    assert legend == ["jonswap", "torsethaugen"]
    opened.page.locator(".sweep_cells select[aria-label='across']").select_option("waves.spectrum")
    assert opened.ask(f"[{CELLS}.cells().x.count, {CELLS}.cells().y.count]") == [2, 4]
    assert opened.messages == []


def test_a_setting_that_goes_with_another_needs_no_choice(opener: Callable[..., Opened]) -> None:
    def wind(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row["wind.speed"] = 2.0 * row[HEIGHT]

    opened = opener(table(change=wind, keys=(HEIGHT, "waves.peak_period", "wind.speed"), domains=("frequency",)))
    assert opened.page.locator(".sweep_cells select").count() == 4  # signal, statistic, and the two axes
    opened.page.locator(".sweep_cells select[aria-label='upward']").select_option("wind.speed")
    assert opened.page.locator(".sweep_cells select").count() == 4
    assert opened.messages == []


@pytest.mark.parametrize("count", [1, 3])
def test_hardly_any_rows(opener: Callable[..., Opened], count: int) -> None:
    opened = opener(table(domains=("frequency",), change=lambda rows: rows.__delitem__(slice(count, None))))
    assert len(opened.table_cases()) == count
    assert opened.messages == []


def test_a_phone_scrolls_down_only(opener: Callable[..., Opened]) -> None:
    opened = opener(table(), viewport={"width": 390, "height": 800}, is_mobile=True, has_touch=True)
    assert opened.ask("document.documentElement.scrollWidth") == 390
    box = opened.page.locator(".sweep_cells canvas").first.bounding_box()
    assert box["width"] <= 390
    x, y = opened.at("sweep_cells", *opened.cell(1, 2))
    opened.page.touchscreen.tap(x, y)
    assert opened.selected() == rows_where(table(), significant_height=(6.0, 6.0), peak_period=(10.0, 10.0))
    assert opened.messages == []


def test_colours_follow_the_scheme(opener: Callable[..., Opened]) -> None:
    opened = opener(table(domains=("frequency",)), color_scheme="dark")
    text = "tlpsimTheme.colour('text')"
    dark = opened.ask(text)
    opened.page.emulate_media(color_scheme="light")
    assert opened.ask(text) != dark
    assert opened.messages == []


def test_figures_are_drawn_for_paper_at_once(opener: Callable[..., Opened]) -> None:
    opened = opener(table(), color_scheme="dark")
    widths = opened.ask("""(() => {
      dispatchEvent(new Event("beforeprint"));
      return [...document.querySelectorAll(".plane canvas:first-child")].map((canvas) => canvas.style.width);
    })()""")
    assert widths == ["680px"] * 4
    assert opened.messages == []


def test_texts_of_a_sweep_do_nothing(opener: Callable[..., Opened]) -> None:
    bad = "</script><img src=x onerror=alert(1)>"

    def evil(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row.update({"file": bad, "name": bad, "waves.spectrum": bad + str(row["case"] % 2)})

    opened = opener(table(change=evil, keys=(HEIGHT, "waves.spectrum"), title=bad))
    opened.page.locator(".sweep_worst tbody tr").first.hover()
    opened.settled()
    assert opened.page.locator("img").count() == 0
    assert bad in opened.page.locator(".sweep_worst").inner_text()
    assert opened.messages == []
    assert len(opened.requests) == 1
