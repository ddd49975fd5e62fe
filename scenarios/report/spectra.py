"""Spectra of the response by Welch's method, with the frequency domain's curve and the band of the estimate.

An average of n independent segments has 2 n degrees of freedom: the true spectrum lies between the factors

    2 n / chi2(0.975; 2 n),   2 n / chi2(0.025; 2 n)                                                  (1)

of the estimate with a probability of 95 %. Of Hann segments that overlap by half, 18/19 of each count as independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch
from scipy.stats import chi2

from tlpsim.scenarios.report.analysis import POSITIONS, Analysis, recorded, samples, tensions
from tlpsim.scenarios.report.document import Block, Chart, Grid, Text
from tlpsim.scenarios.report.words import rounded, seconds, squared
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.statistics.bands import BAND_EDGES
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, conversion

FloatArray = NDArray[np.float64]

LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1e-3, 1.0
"""Hz, between which spectra are shown: from below the natural frequency of surge to beyond those of heave and pitch"""

_CONFIDENCE = 0.95
_SEGMENTS = 8  # of a record, without their overlap
_LENGTHS = (300.0, 1800.0)  # s, shortest and longest segment
_INDEPENDENT = 18.0 / 19.0
_DECADES = 7.0  # of the ordinate, below the highest peak


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimate:
    """A spectrum from records.

    Attributes
    ----------
    frequency, density
        Hz and unit²/Hz, one-sided, shape (n,); without the lowest lines, which the window mixes with the mean.
    segments
        Number of independent ones.
    length
        Of a segment, s.
    """

    frequency: FloatArray
    density: FloatArray
    segments: float
    length: float

    def band(self) -> tuple[float, float]:
        """Factors of eq. (1)."""
        freedom = 2.0 * self.segments
        tails = (0.5 * (1.0 + _CONFIDENCE), 0.5 * (1.0 - _CONFIDENCE))
        low, high = (freedom / float(chi2.ppf(tail, freedom)) for tail in tails)
        return low, high


def spectrum(results: Sequence[Results], name: str, start: float = 0.0) -> Estimate | None:
    """Spectrum of a signal, averaged over records; None where they are too short, or are not sampled evenly
    and alike.

    Parameters
    ----------
    results
        Records.
    name
        Of the signal, in whose recorded unit the density is.
    start
        Time before which samples are left out, s.
    """
    densities, segments, grid = [], 0.0, np.zeros(0)
    for each in results:
        time, values = samples(each, name, start)
        if len(time) < 2 or not np.isfinite(values).all():
            return None
        step = float(time[-1] - time[0]) / (len(time) - 1)
        if not np.allclose(np.diff(time), step, rtol=1e-6, atol=1e-9 * abs(time[-1])):
            return None
        duration = len(time) * step
        if grid.size == 0:
            length = min(max(duration / _SEGMENTS, _LENGTHS[0]), _LENGTHS[1], duration)
            count = round(length / step)
        if len(values) < count or count < 8:
            return None
        frequency, density = welch(values, fs=1.0 / step, nperseg=count)
        if grid.size and not np.allclose(grid, frequency):
            return None
        grid = frequency
        found = 1 + (len(values) - count) // (count - count // 2)
        # Records of different lengths count by their segments.
        densities.append(density * found)
        segments += found
    if not segments:
        return None
    inside = slice(2, int(np.searchsorted(grid, HIGHEST_FREQUENCY)))
    independent = segments if segments == len(results) else segments * _INDEPENDENT
    return Estimate(
        frequency=grid[inside],
        density=np.sum(densities, axis=0)[inside] / segments,
        segments=independent,
        length=1.0 / float(grid[1]),
    )


def spectra_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    """Spectra of the motions and of the tension of the tendon that is loaded most, each case in a colour."""
    names = [name for name in POSITIONS if any(name in recorded(each.case.results[0]) for each in analyses)]
    worst = worst_tendon(analyses)
    charts, used = [], None
    for name in [*names, *([worst] if worst else [])]:
        chart, estimate = _chart(analyses, name)
        charts += [chart] if chart else []
        used = used or estimate
    if not charts or used is None:
        return []
    caption = (
        f"Welch's method with Hann segments of {seconds(used.length)} that overlap by half, {used.segments:.1f} "
        f"independent ones; resolution {1e3 / used.length:.2g} mHz. Shaded: where the true spectrum lies with 95 % "
        "(chi-square). Dashed: the frequency domain (docs/frequency-domain.md), where the scenario is one it can take. "
        f"The bands of Table I end at {BAND_EDGES[0]:g} and {BAND_EDGES[1]:g} Hz."
    )
    return [Grid(blocks=tuple(charts)), Text(text=caption, small=True)]


def worst_tendon(analyses: Sequence[Analysis]) -> str | None:
    """Name of the tension with the largest maximum over all cases; None where there is none."""
    found: dict[str, float] = {}
    for each in analyses:
        for name in tensions(list(each.statistics)).values():
            found[name] = max(found.get(name, -np.inf), each.statistics[name].maximum)
    return max(found, key=found.__getitem__) if found else None


def _chart(analyses: Sequence[Analysis], name: str) -> tuple[Chart | None, Estimate | None]:
    """Chart of one signal, and the first estimate that is in it."""
    series: list[dict[str, Any]] = []
    used = None
    unit, base, scale = "MN", "N", 1e-6
    degree = name.rpartition(".")[2]
    if name in POSITIONS:
        unit, scale = TABLE_UNITS[degree]
        base = "rad" if unit.endswith("rad") else "m"
    for colour, each in enumerate(analyses, 1):
        which = f"{each.case.label}: " if len(analyses) > 1 else ""
        if any(name not in recorded(results) for results in each.case.results):
            continue
        estimate = spectrum(each.case.results, name, each.start)
        if estimate is not None and np.any(estimate.density > 0.0):
            used = used or estimate
            density = (scale * conversion(each.case.results[0].unit(name), base)) ** 2 * estimate.density
            low, high = estimate.band()
            line = {"label": f"{which}time domain", "colour": colour, "x": rounded(estimate.frequency)}
            line |= {"y": rounded(density), "low": rounded(low * density), "high": rounded(high * density)}
            series.append(line)
        quantity = each.response.quantities.get(name.partition(".")[2]) if each.response else None
        if quantity is not None:
            shown = (quantity.frequency > 0.0) & (quantity.frequency <= HIGHEST_FREQUENCY)
            other = colour if len(analyses) > 1 else 2
            line = {"label": f"{which}frequency domain", "colour": other, "dash": True}
            line |= {"x": rounded(quantity.frequency[shown]), "y": rounded(scale**2 * quantity.density[shown])}
            series.append(line)
    if used is None:
        return None, None
    top = max(value for line in series for value in line["y"] if value is not None)
    floor = top * 10.0**-_DECADES
    views = [
        {
            "label": label,
            "x": {"label": "frequency, Hz", "log": log_x, "from": LOWEST_FREQUENCY if log_x else 0.0, "to": end},
            "y": {"label": f"{squared(unit)}/Hz", "log": log_y, "from": floor if log_y else 0.0},
            "marks": [{"x": edge, "label": f"{edge:g} Hz"} for edge in BAND_EDGES],
            "series": series,
        }
        for label, log_x, log_y, end in (
            ("log–log", True, True, HIGHEST_FREQUENCY),
            ("lin–log", False, True, 1.5 * BAND_EDGES[1]),
            ("lin–lin", False, False, 1.25 * BAND_EDGES[1]),
        )
    ]
    tendon = next(iter(tensions([name])), "")
    title = f"Tension of tendon {tendon}" if tendon else degree.capitalize()
    return Chart(
        kind="lines", title=title, content={"choices": [{"label": title, "views": views}], "height": 230}
    ), used
