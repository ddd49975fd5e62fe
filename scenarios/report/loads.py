"""What each load is and does: recorded loads by band, and the response under one excitation alone."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.spectral.records import SpectralResponse, band_integral
from tlpsim.scenarios.report.analysis import Analysis, component_of, recorded
from tlpsim.scenarios.report.document import Block, Cell, Fold, Row, Table
from tlpsim.scenarios.report.words import UNKNOWN, short, typeset
from tlpsim.scenarios.spectral_tables import LOW, WAVE
from tlpsim.scenarios.statistics.bands import BAND_EDGES, band_statistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, conversion

FloatArray = NDArray[np.float64]

_LOAD = re.compile(rf"(.+)\.({'|'.join(DEGREES_OF_FREEDOM)})")
_SI = ("N", "N", "N", "N.m", "N.m", "N.m")
_MEGA = 1e-6
_BANDS = {LOW: (0.0, BAND_EDGES[0]), WAVE: BAND_EDGES}
_EXCITATIONS = {
    "waves": "waves, first order",
    "slow drift": "slow drift, potential",
    "tethers": "tethers, second order",
}
_RECORDED_NOTE = (
    "Standard deviation of the recorded loads on the platform about its reference point, in MN and MN·m, by the bands "
    "of Table I; the bars are relative to the largest of their column. The parts of a force are coherent: their "
    "variances do not add up."
)
_ALONE_NOTE = (
    "Standard deviation of the response to one excitation alone, by the frequency domain with the stiffness and "
    "damping of all together (docs/frequency-domain.md). Second-order parts from the same waves are coherent: their "
    "variances do not add up."
)


def load_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    """Recorded loads by band and what each excitation does, for each case."""
    blocks: list[Block] = []
    for each in analyses:
        which = f": {each.case.label}" if len(analyses) > 1 else ""
        found = [*_recorded_tables(each, which), *_alone_tables(each, which)]
        # Of several cases the first one is open.
        blocks += found if each is analyses[0] or not found else [Fold(summary=f"Loads{which}", blocks=tuple(found))]
    return blocks


def recorded_loads(analysis: Analysis) -> dict[str, FloatArray]:
    """Mean and standard deviations in both bands of each load that was recorded, (6, 3), in N and N·m.

    Standard deviations of several records are those of their average variance; NaN for what was not recorded.
    """
    loads: dict[str, FloatArray] = {}
    names = set(recorded(analysis.case.results[0])).intersection(*(recorded(r) for r in analysis.case.results[1:]))
    for name in (each for each in recorded(analysis.case.results[0]) if each in names):
        match = _LOAD.fullmatch(name)
        unit = analysis.case.results[0].unit(name)
        if match is None or not (unit in _SI or any(conversion(unit, wanted) != 1.0 for wanted in _SI[2:4])):
            continue
        index = DEGREES_OF_FREEDOM.index(match[2])
        row = loads.setdefault(match[1], np.full((6, 3), math.nan))
        row[index] = _statistics(analysis, name, conversion(unit, _SI[index]))
    return {name: values for name, values in loads.items() if np.nansum(np.abs(values)) > 0.0}


def _statistics(analysis: Analysis, name: str, factor: float) -> tuple[float, float, float]:
    found = []
    for results in analysis.case.results:
        time = results.time(component_of(results, name))
        try:
            found.append(band_statistics(time, factor * results.signal(name), start=analysis.start))
        except TlpsimError:
            return math.nan, math.nan, math.nan
    low, wave = (float(np.mean([getattr(e, b) ** 2 for e in found])) for b in ("low_frequency", "wave_frequency"))
    return float(np.mean([each.mean for each in found])), math.sqrt(low), math.sqrt(wave)


def _recorded_tables(analysis: Analysis, which: str) -> list[Block]:
    loads = recorded_loads(analysis)
    if not loads:
        return []
    headings = ("load", *(f"{degree}, {'MN·m' if k > 2 else 'MN'}" for k, degree in enumerate(DEGREES_OF_FREEDOM)))
    tables: list[Block] = []
    for column, band in enumerate(_BANDS, 1):
        largest = np.fmax.reduce([values[:, column] for values in loads.values()])
        rows = tuple(
            Row(
                heading=name,
                cells=tuple(_bar(_MEGA * v, _MEGA * m) for v, m in zip(values[:, column], largest, strict=True)),
            )
            for name, values in loads.items()
        )
        caption = f"Recorded loads, standard deviation at {band} Hz{which}"
        tables.append(Table(caption=caption, headings=headings, rows=rows, note=_RECORDED_NOTE if column == 2 else ""))
    mean = tuple(
        Row(heading=name, cells=tuple(short(_MEGA * float(v)) for v in values[:, 0])) for name, values in loads.items()
    )
    folded = Table(caption=f"Recorded loads, mean{which}", headings=headings, rows=mean)
    return [*tables, Fold(summary="Mean loads", blocks=(folded, *_mean_loads(analysis, headings)))]


def _mean_loads(analysis: Analysis, headings: tuple[str, ...]) -> list[Block]:
    if analysis.response is None or not analysis.response.mean_loads:
        return []
    rows = tuple(
        Row(heading=name, cells=tuple(short(_MEGA * float(value)) for value in load))
        for name, load in analysis.response.mean_loads.items()
    )
    note = "By part, earth-fixed; parts of the same name may be cut otherwise than in the record."
    return [Table(caption="Mean loads by the frequency domain", headings=headings, rows=rows, note=note)]


def _alone_tables(analysis: Analysis, which: str) -> list[Block]:
    if analysis.response is None:
        return []
    spreads = alone(analysis.response)
    headings = ("excitation", *(f"{degree}, {typeset(TABLE_UNITS[degree][0])}" for degree in DEGREES_OF_FREEDOM))
    tables: list[Block] = []
    for row, band in enumerate(_BANDS):
        largest = np.max([values[row] for values in spreads.values()], axis=0)
        rows = tuple(
            Row(
                heading=_EXCITATIONS.get(name, name),
                cells=tuple(_bar(v, m) for v, m in zip(values[row], largest, strict=True)),
                lead=name == "all together",
            )
            for name, values in spreads.items()
        )
        caption = f"Response to one excitation alone, standard deviation at {band} Hz{which}"
        tables.append(Table(caption=caption, headings=headings, rows=rows, note=_ALONE_NOTE if row == 1 else ""))
    return tables


def alone(response: SpectralResponse) -> Mapping[str, FloatArray]:
    """Standard deviation of the six positions in both bands under one excitation alone, (2, 6), in Table I's units."""
    densities = dict(response.contributions)
    six = [response.quantities[f"position.{degree}"].density for degree in DEGREES_OF_FREEDOM]
    densities["all together"] = np.column_stack(six)
    scale = np.array([TABLE_UNITS[degree][1] for degree in DEGREES_OF_FREEDOM])
    return {
        name: scale
        * np.array(
            [
                [math.sqrt(max(band_integral(response.frequency, column, *edges), 0.0)) for column in density.T]
                for edges in _BANDS.values()
            ]
        )
        for name, density in densities.items()
    }


def _bar(value: float, largest: float) -> Cell:
    if not math.isfinite(value):
        return Cell(text=UNKNOWN)
    if value == 0.0:
        return Cell(text="0")
    share = value / largest if largest > 0.0 else 0.0
    return Cell(text=short(value) if share >= 5e-4 else "≈ 0", share=share)
