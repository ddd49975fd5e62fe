"""Figures of docs/theory.md that no command of `tlpsim` draws: python docs/draw_theory.py

Diagrams after Figs. 1, 4 and 5 of Li and Kareem (1990), as SVG, and the terms of the wind force of Fig. 2 in a storm,
as PNG.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.scenarios.assemble import wind_loads
from tlpsim.scenarios.figure_files import save
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

FOLDER = Path(__file__).parent / "figures" / "theory"
SCENARIO = Path(__file__).parent.parent / "scenarios" / "typical_tlp.toml"

# Both on white and on black.
COLOURS = {"wind": "#cfe0ee", "wave": "#cfe8e2", "platform": "#f3dfc4", "plain": "#e6e6ea"}
INK, LINE = "#1c2733", "#7d8a97"
WIDTH, HEIGHT, GAP_X, GAP_Y = 178.0, 64.0, 46.0, 34.0


# A line for each box: name, column, row, colour, title, words; and for each arrow: from, to, words. `back` is an arrow
# that goes around below the boxes, as feedback does.
SYSTEMS = (
    """
    gusts      0  0    wind      wind field      mean over height; gusts at segments
    sea        0  1    wave      sea             elevation; current over depth
    wind       1  0    wind      wind FMU        drag by relative velocity,; eq. (1), (2)
    wave       1  1    wave      wave FMU        diffraction, drag,; splash, slow drift
    platform   2  0.5  platform  platform FMU    inertia, radiation,; buoyancy, tethers
    response   3  0.5  plain     response        motion, tensions,; air gap
    """,
    """
    gusts     wind
    sea       wave
    wind      platform  force
    wave      platform  force
    platform  response
    platform  wave      back: position, velocity (the wind gets velocity and yaw)
    """,
)
TIME_DOMAIN = (
    """
    noise       0  0    plain     white noise         by seed; and sample number
    gusts       1  0    wind      ARMA, gusts         AR(25) → ARMA(3, 3); loads/filters, loads/wind
    sea         1  1    wave      ARMA, elevation     AR(59) → ARMA(8, 7); loads/filters, loads/waves
    wind        2  0    wind      wind force          on the moving platform; loads/wind/force.py
    wave        2  1    wave      convolution         kinematics, diffraction, drift; loads/hydro
    filter      3  0    plain     interpolation       between steps, loads/filters; orchestrator
    motion      3  1    platform  equation of motion  a digital filter; loads/platform
    statistics  4  1    plain     statistics          means, spectra, extremes; scenarios/statistics
    """,
    """
    noise   gusts
    noise   sea
    gusts   wind
    sea     wave
    wind    filter
    wave    filter
    filter  motion
    motion  statistics
    motion  wave        back: position, velocity, extrapolated by their derivatives
    """,
)
FREQUENCY_DOMAIN = (
    """
    spectra     0  0.5  plain     decomposed spectra  S = D Dᴴ of gusts and waves; decomposition.py
    hermite     1  0.5  wave      Hermite expansion   drag: mean, linear, quadratic; hermite.py, viscous.py
    zero        2  0    platform  order 0             mean position; iteration.py
    one         2  1    platform  order 1             waves and gusts, linear; iteration.py
    two         3  0.5  platform  order 2             decomposed bi-spectra; second_order.py
    statistics  4  0.5  plain     statistics          spectra, skewness, extremes; outputs.py, extremes.py
    """,
    """
    spectra  hermite
    hermite  zero
    hermite  one
    zero     one
    zero     two
    one      two
    two      statistics
    one      hermite     back: covariance of the relative velocity, until it stands still
    """,
)
TERMS = {"full": "black", "exciting": "#4ba3e3", "damping": "#2c8f6f", "second_order": "#d9822b"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box of a diagram: its upper left corner, colour, title and lines of words."""

    left: float
    top: float
    colour: str
    title: str
    words: Sequence[str]


def diagram(boxes: str, arrows: str) -> str:
    """SVG of boxes and arrows, one a line of each text."""
    placed = {}
    for line in filter(None, map(str.strip, boxes.splitlines())):
        name, column, row, colour, title, words = re.split(r"\s{2,}", line)
        left, top = 8.0 + float(column) * (WIDTH + GAP_X), 8.0 + float(row) * (HEIGHT + GAP_Y)
        placed[name] = Box(left=left, top=top, colour=COLOURS[colour], title=title, words=words.split("; "))
    ends = [[*re.split(r"\s{2,}", line), ""][:3] for line in filter(None, map(str.strip, arrows.splitlines()))]
    width = max(box.left for box in placed.values()) + WIDTH + 8.0
    floor = max(box.top for box in placed.values()) + HEIGHT
    drawn = [_box(box) for box in placed.values()]
    drawn += [_arrow(placed[source], placed[target], words, floor + 22.0) for source, target, words in ends]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {floor + 44.0:.0f}" width="{width:.0f}" '
        'font-family="system-ui, sans-serif">'
        '<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto">'
        f'<path d="M0 0L10 5L0 10z" fill="{LINE}"/></marker></defs>' + "".join(drawn) + "</svg>\n"
    )


def _box(box: Box) -> str:
    middle = box.left + 0.5 * WIDTH
    first = box.top + 0.5 * HEIGHT + 5.0 - 7.5 * len(box.words)
    lines = [f'<text x="{middle:.1f}" y="{first:.1f}" font-size="14" font-weight="600">{escape(box.title)}</text>']
    for number, words in enumerate(box.words, 1):
        lines.append(f'<text x="{middle:.1f}" y="{first + 15.5 * number:.1f}" font-size="11">{escape(words)}</text>')
    return (
        f'<rect x="{box.left:.1f}" y="{box.top:.1f}" width="{WIDTH}" height="{HEIGHT}" rx="7" '
        f'fill="{box.colour}" stroke="{LINE}"/><g fill="{INK}" text-anchor="middle">{"".join(lines)}</g>'
    )


def _arrow(source: Box, target: Box, words: str, below: float) -> str:
    """An arrow: below all boxes, straight down or up within a column, or with two bends from column to column."""
    anchor = "middle"
    if words.startswith("back: "):
        words = words.removeprefix("back: ")
        start, end = source.left + 0.6 * WIDTH, target.left + 0.4 * WIDTH
        path = f"M{start:.1f} {source.top + HEIGHT:.1f}V{below:.1f}H{end:.1f}V{target.top + HEIGHT + 2.0:.1f}"
        x, y = 0.5 * (start + end), below + 14.0
    elif source.left == target.left:
        x, anchor = source.left + 0.5 * WIDTH, "start"
        path = f"M{x:.1f} {source.top + HEIGHT:.1f}V{target.top - 2.0:.1f}"
        x, y = x + 6.0, target.top - 0.5 * GAP_Y + 4.0
    else:
        start, end = source.left + WIDTH, target.left - 2.0
        levels = source.top + 0.5 * HEIGHT, target.top + 0.5 * HEIGHT
        x, y = 0.5 * (start + end), levels[0] - 6.0
        path = f"M{start:.1f} {levels[0]:.1f}H{x:.1f}V{levels[1]:.1f}H{end:.1f}"
    said = f'<text x="{x:.1f}" y="{y:.1f}" font-size="11" fill="{LINE}" text-anchor="{anchor}">{escape(words)}</text>'
    line = f'<path d="{path}" fill="none" stroke="{LINE}" stroke-width="1.5" marker-end="url(#tip)"/>'
    return line + (said if words else "")


def wind_terms() -> Figure:
    """Terms of the wind force in surge in the default storm: a piece of the record, and their spectra."""
    scenario = Scenario.load(SCENARIO, ["simulation.duration=3h"])
    loads = wind_loads(scenario)
    assert loads is not None
    with tempfile.TemporaryDirectory() as folder:
        results = run_scenario(scenario, Path(folder) / "storm.h5", monolithic=True)
        chosen = slice(None, None, 10)  # 1 s, the step of the gusts
        time = results.time("platform")[chosen]
        rates = [results.signal(f"platform.velocity.{name}")[chosen] for name in DEGREES_OF_FREEDOM]
        yaw = results.signal("platform.position.yaw")[chosen]
    motion = list(zip(time, np.ascontiguousarray(np.column_stack(rates)), yaw, strict=True))
    parts = [loads.parts(*instant) for instant in motion]
    terms = {
        name: np.array([getattr(each, name)[0] for each in parts]) / 1e6 for name in ("mean", *TERMS) if name != "full"
    }
    terms["full"] = np.array([loads.evaluate(*instant)[0] for instant in motion]) / 1e6
    linear = terms["mean"] + terms["exciting"] + terms["damping"]

    figure = Figure(figsize=(11.0, 4.6), layout="constrained", dpi=130)
    record, spectra = figure.subplots(1, 2)
    shown = (time >= 600.0) & (time <= 780.0)
    record.plot(time[shown], terms["full"][shown], color="black", linewidth=2.6, label="eq. (1) in full")
    record.plot(
        time[shown], linear[shown], color="#d62728", linewidth=1.3, dashes=(5, 2), label="mean + exciting + damping"
    )
    record.axhline(terms["mean"].mean(), color="0.5", linewidth=0.9, linestyle=":", label="mean")
    record.set(title="wind force in surge", xlabel="time, s", ylabel="MN")
    for name, colour in TERMS.items():
        frequency, density = welch(terms[name], fs=1.0, nperseg=1024)
        label = f"{name.replace('_', ' ')}: {terms[name].std():.3f} MN"
        spectra.loglog(frequency[2:], density[2:], color=colour, linewidth=1.2, label=label)
    spectra.set(title="spectra of the terms, and standard deviations", xlabel="frequency, Hz", ylabel="MN²/Hz")
    spectra.set_ylim(1e-6, None)
    for axes in (record, spectra):
        axes.legend(frameon=False, fontsize=9)
        axes.grid(True, color="0.88", linewidth=0.7)
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle("Terms of the wind force, default storm, 3 h", fontsize=13)
    return figure


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, texts in {
        "systems": SYSTEMS,
        "time_domain": TIME_DOMAIN,
        "frequency_domain": FREQUENCY_DOMAIN,
    }.items():
        (FOLDER / f"{name}.svg").write_text(diagram(*texts), encoding="utf-8")
    save(FOLDER, {"wind_terms.png": wind_terms()})
