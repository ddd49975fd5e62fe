"""The platform's track in plan as a drawing: path, mean, ellipse of the scatter, and where wind, waves, current go.

The ellipse of a covariance C holds 95 % of a Gaussian position: half axes sqrt(5.991 lambda) along the eigenvectors of
C, with 5.991 the 95 % quantile of chi-square with two degrees of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral.records import band_integral
from tlpsim.scenarios.report.analysis import POSITIONS, Analysis, recorded, samples
from tlpsim.scenarios.report.document import Block, Drawing, Grid
from tlpsim.scenarios.report.words import number, short
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import conversion

FloatArray = NDArray[np.float64]

QUANTILE = 5.991
"""95 % of chi-square with two degrees of freedom"""

_SIZE = 440  # of the drawing, in its own units
_MARGIN = 52
_SHOWN = f"0 {_MARGIN - 8} {_SIZE - _MARGIN + 10} {_SIZE - _MARGIN + 8}"  # without the empty margins
_COMPASS = 320
_MOST_POINTS = 5000  # of a path
_TICKS = 6  # at most
_COLOURS = 7  # of the page's style
_STEPS = (1.0, 2.0, 5.0, 10.0)
_ROOM = 0.08  # of the width, about the path


@dataclass(frozen=True, slots=True, kw_only=True)
class _Frame:
    """Where a position (m) is in the drawing."""

    centre: tuple[float, float]
    half: float  # m, from the centre to the edge

    def place(self, x: FloatArray | float, y: FloatArray | float) -> tuple[FloatArray | float, FloatArray | float]:
        scale = (_SIZE - 2 * _MARGIN) / (2.0 * self.half)
        return _SIZE / 2 + scale * (x - self.centre[0]), _SIZE / 2 - scale * (y - self.centre[1])


def track_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    """The track of all cases in one drawing; nothing where surge or sway was not recorded."""
    tracks = [(each, _tracks(each)) for each in analyses]
    paths = [path for _, found in tracks for path in found]
    if not paths:
        return []
    frame = _frame(paths)
    parts = [_grid(frame)]
    for index, (analysis, found) in enumerate(tracks):
        colour = 1 + index % _COLOURS
        parts += [_path(frame, path, colour) for path in found]
        if found:
            together = np.concatenate(found, axis=1)
            mean, covariance = together.mean(axis=1), np.cov(together)
            parts.append(_ellipse(frame, mean, covariance, f"mark c{colour}"))
            parts.append(_cross(frame, mean, colour))
        expected = _expected(analysis)
        if expected is not None:
            parts.append(_ellipse(frame, *expected, f"mark expected c{colour}"))
    title = "Surge and sway in plan"
    markup = f'<svg viewBox="{_SHOWN}" role="img" aria-label="{title}" class="track">{"".join(parts)}</svg>'
    caption = (
        "The reference point in plan, from the beginning of statistics on. Cross: mean. Ellipse: 95 % of a Gaussian "
        "position of the same mean and covariance; dashed, by the frequency domain."
    )
    if len(analyses) > 1:
        names = "; ".join(f"{number} {each.case.label}" for number, each in enumerate(analyses, 1))
        caption += f" Colours in order: {names}."
    drawings: list[Block] = [Drawing(title=title, svg=markup, caption=caption)]
    scenarios = [each.case.scenario for each in analyses if each.case.scenario is not None]
    compass = _compass(scenarios[0]) if len(analyses) == len(scenarios) == 1 else None
    return [Grid(blocks=(*drawings, compass))] if compass else drawings


def _tracks(analysis: Analysis) -> list[FloatArray]:
    """Surge and sway of each record in m, (2, n)."""
    surge, sway = POSITIONS[:2]
    found = []
    for results in analysis.case.results:
        if {surge, sway} <= set(recorded(results)):
            columns = [samples(results, n, analysis.start)[1] * conversion(results.unit(n), "m") for n in (surge, sway)]
            path = np.stack(columns)
            path = path[:, np.isfinite(path).all(axis=0)]
            if path.shape[1] > 1:
                found.append(path)
    return found


def _expected(analysis: Analysis) -> tuple[FloatArray, FloatArray] | None:
    """Mean and covariance of surge and sway by the frequency domain, m and m²."""
    response = analysis.response
    if response is None:
        return None
    parts = [[response.cross_spectrum[:, i, j].real for j in (0, 1)] for i in (0, 1)]
    covariance = np.array([[band_integral(response.frequency, each) for each in row] for row in parts])
    return np.array([response.quantities[n.partition(".")[2]].mean for n in POSITIONS[:2]]), covariance


def ellipse(mean: FloatArray, covariance: FloatArray, count: int = 73) -> FloatArray:
    """Points of the 95 % ellipse of a Gaussian position, (2, count)."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    axes = vectors * np.sqrt(QUANTILE * np.maximum(values, 0.0))
    return np.asarray(mean[:, None] + axes @ circle)


def _frame(paths: Sequence[FloatArray]) -> _Frame:
    together = np.concatenate(paths, axis=1)
    low, high = together.min(axis=1), together.max(axis=1)
    half = max(0.5 * float((high - low).max()) * (1.0 + 2.0 * _ROOM), 1e-3)
    middle = 0.5 * (low + high)
    return _Frame(centre=(float(middle[0]), float(middle[1])), half=half)


def _ticks(low: float, high: float) -> list[float]:
    raw = (high - low) / _TICKS
    base = 10.0 ** math.floor(math.log10(raw))
    step = next(base * each for each in _STEPS if base * each >= raw)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _grid(frame: _Frame) -> str:
    """Frame, lines at round values, their figures, and the names of the axes."""
    near, far = _MARGIN, _SIZE - _MARGIN
    parts = [f'<rect class="frame" x="{near}" y="{near}" width="{far - near}" height="{far - near}"/>']
    for axis in (0, 1):
        ticks = _ticks(frame.centre[axis] - frame.half, frame.centre[axis] + frame.half)
        step = ticks[1] - ticks[0] if len(ticks) > 1 else 1.0
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        for value in ticks:
            x, y = frame.place(value, value)
            kind = "zero" if abs(value) < 1e-9 * step else "grid"
            text = number(value, digits)
            if axis == 0:
                parts.append(f'<path class="{kind}" d="M{x:.1f} {near}V{far}"/>')
                parts.append(f'<text x="{x:.1f}" y="{far + 16}" text-anchor="middle">{text}</text>')
            else:
                parts.append(f'<path class="{kind}" d="M{near} {y:.1f}H{far}"/>')
                parts.append(f'<text x="{near - 6}" y="{y + 4:.1f}" text-anchor="end">{text}</text>')
    middle = _SIZE / 2
    parts.append(f'<text class="name" x="{middle}" y="{far + 34}" text-anchor="middle">surge, m</text>')
    turned = f"rotate(-90 {near - 40} {middle})"
    parts.append(
        f'<text class="name" x="{near - 40}" y="{middle}" text-anchor="middle" transform="{turned}">sway, m</text>'
    )
    return "".join(parts)


def _line(x: FloatArray, y: FloatArray) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))


def _path(frame: _Frame, path: FloatArray, colour: int) -> str:
    thinned = path[:, :: max(1, -(-path.shape[1] // _MOST_POINTS))]
    x, y = frame.place(thinned[0], thinned[1])
    return f'<path class="path c{colour}" d="{_line(np.asarray(x), np.asarray(y))}"/>'


def _ellipse(frame: _Frame, mean: FloatArray, covariance: FloatArray, kind: str) -> str:
    x, y = frame.place(*ellipse(mean, covariance))
    return f'<path class="{kind}" d="{_line(np.asarray(x), np.asarray(y))}Z"/>'


def _cross(frame: _Frame, mean: FloatArray, colour: int) -> str:
    x, y = frame.place(float(mean[0]), float(mean[1]))
    return f'<path class="mark c{colour}" d="M{x - 7:.1f} {y:.1f}h14M{x:.1f} {y - 7:.1f}v14"/>'


def _compass(scenario: Scenario) -> Drawing | None:
    """Where wind, waves and current go, past the platform in the middle; None in still air and calm water."""
    current, table = scenario.current, scenario.current.table
    flows = [
        ("wind", scenario.wind.heading_deg, scenario.wind.speed, "m/s"),
        ("waves", scenario.waves.heading_deg, scenario.waves.significant_height, "m (Hs)"),
        (
            "current",
            table.heading_deg[0] if table else current.heading_deg,
            table.speed[0] if table else current.speed,
            "m/s",
        ),
    ]
    flows = [flow for flow in flows if flow[2] > 0.0]
    if not flows:
        return None
    centre, radius = _COMPASS / 2, _COMPASS / 2 - 44
    half = 13
    parts = [
        f'<circle class="frame" cx="{centre}" cy="{centre}" r="{radius}"/>',
        f'<path class="zero" d="M{centre} {centre}h{radius}M{centre} {centre}v{-radius}"/>',
        f'<text x="{centre + radius + 5}" y="{centre + 4}">+x</text>',
        f'<text x="{centre}" y="{centre - radius - 7}" text-anchor="middle">+y</text>',
        f'<rect class="hull" x="{centre - half}" y="{centre - half}" width="{2 * half}" height="{2 * half}"/>',
    ]
    for lane, (name, degrees, _, _) in enumerate(flows):
        angle = math.radians(degrees)
        along = np.array([math.cos(angle), -math.sin(angle)])  # the drawing's y goes down
        across = np.array([-along[1], along[0]])
        shift = 9.0 * (lane - 0.5 * (len(flows) - 1)) * across  # so that equal headings stand beside each other
        tail, tip = centre - radius * along + shift, centre - 30.0 * along + shift
        head = [tip, tip - 12.0 * along + 5.0 * across, tip - 12.0 * along - 5.0 * across]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in head)
        text = tail - 8.0 * along + 0.6 * shift
        anchor = "middle" if abs(along[0]) < 0.5 else "end" if along[0] > 0.0 else "start"
        parts.append(f'<path class="arrow {name}" d="{_line(*np.stack([tail, tip - 6.0 * along]).T)}"/>')
        parts.append(f'<polygon class="arrow {name}" points="{points}"/>')
        low = 4.0 + (7.0 if along[1] < -0.5 else -5.0 if along[1] > 0.5 else 0.0)
        parts.append(
            f'<text class="{name}" x="{text[0]:.1f}" y="{text[1] + low:.1f}" text-anchor="{anchor}">{name}</text>'
        )
    title = "Wind, waves and current"
    markup = (
        f'<svg viewBox="0 0 {_COMPASS} {_COMPASS}" role="img" aria-label="{title}" class="track compass">'
        f"{''.join(parts)}</svg>"
    )
    words = "; ".join(f"{name} {short(size)} {unit}, toward {degrees:g}°" for name, degrees, size, unit in flows)
    caption = (
        f"{words[:1].upper()}{words[1:]}. Arrows point where they go; headings count from +x (surge) toward +y (sway), "
        "as in docs/conventions.md."
    )
    return Drawing(title=title, svg=markup, caption=caption)
