"""Extremes: the tensions of each tendon, probabilities of exceedance, and the largest values of a case."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.report.analysis import EXPOSURE, POSITIONS, SLOPE, Analysis, recorded, samples, tensions
from tlpsim.scenarios.report.document import Block, Cell, Chart, Row, Table
from tlpsim.scenarios.report.words import UNKNOWN, interval, number, rounded, typeset
from tlpsim.scenarios.spectral_tables import hours
from tlpsim.scenarios.statistics.records import Estimate, WeibullFit
from tlpsim.scenarios.statistics.signals import SignalStatistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, conversion

FloatArray = NDArray[np.float64]

MEGA = 1e-6
_CURVE_POINTS = 60  # of a fitted distribution


def tendon_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    """Tensions of each tendon at its top, the lowest at its anchor, and how often maxima exceed a level."""
    blocks: list[Block] = []
    for each in analyses:
        table = _tendon_table(each, f": {each.case.label}" if len(analyses) > 1 else "")
        if table.rows:
            blocks.append(table)
    groups = dict.fromkeys(tuple(group) for each in analyses for group in alike(each))
    names = tensions([name for each in analyses for name in each.statistics])
    shown = {names[group[0]]: f"tendon{'s' if len(group) > 1 else ''} {', '.join(group)}" for group in groups}
    chart = exceedance_chart(analyses, shown, "tensions")
    return [*blocks, *([chart] if chart else [])]


def _tendon_table(analysis: Analysis, which: str) -> Table:
    lowest = tensions(list(analysis.statistics), bottom=True)
    rows = []
    for group in alike(analysis):
        found = analysis.statistics[tensions(list(analysis.statistics))[group[0]]]
        anchor = analysis.statistics.get(lowest.get(group[0], ""), found)
        factor = MEGA * conversion(found.unit, "N")
        expected = analysis.expected(found.name)
        damage = found.damage_equivalent_range
        rows.append(
            Row(
                heading=", ".join(group),
                cells=(
                    _estimate(found.mean, factor),
                    _estimate(found.std, factor),
                    number(factor * found.maximum),
                    _estimate(found.expected_maximum, factor),
                    number(MEGA * expected.maximum if expected else math.nan),
                    number(factor * anchor.minimum),
                    _estimate(anchor.expected_minimum, factor),
                    _margin(anchor),
                    _estimate(damage, factor) if damage else UNKNOWN,
                ),
            )
        )
    length = hours(EXPOSURE)
    note = (
        f"MN; tendons with the same tension in one row. Expected: the mean extreme of {length}, with its 95 % "
        "interval, by the Weibull distribution of the maxima between two crossings of the mean; beside it the "
        "frequency domain's (docs/frequency-domain.md). Minima are those at the anchor where they were recorded. The "
        "margin against slack is the expected minimum over the mean. Damage-equivalent range: of rainflow cycles, at "
        f"1 Hz over the record, with the slope m = {SLOPE:g}."
    )
    headings = (
        "tendon",
        "mean",
        "std",
        "maximum",
        f"expected in {length}",
        "frequency domain",
        "minimum",
        f"expected in {length}",
        "margin",
        "damage-equivalent range",
    )
    return Table(caption=f"Tensions{which}", headings=headings, rows=tuple(rows), note=note)


def alike(analysis: Analysis) -> list[list[str]]:
    """Tendons by groups of the same tension, as those of one column of the platform have."""
    names, lowest = tensions(list(analysis.statistics)), tensions(list(analysis.statistics), bottom=True)
    groups: dict[tuple[str, ...], list[str]] = {}
    for tendon, name in names.items():
        both = (analysis.statistics[each] for each in (name, lowest.get(tendon, name)))
        key = tuple(f"{v:.9g}" for each in both for v in (each.mean.value, each.std.value, each.maximum, each.minimum))
        groups.setdefault(key, []).append(tendon)
    return list(groups.values())


def _estimate(estimate: Estimate, factor: float) -> Cell:
    return Cell(text=number(factor * estimate.value), below=interval(estimate, factor))


def _margin(anchor: SignalStatistics) -> Cell:
    """Expected minimum over the mean; the observed one where none is expected."""
    lowest = anchor.expected_minimum.value
    lowest = lowest if math.isfinite(lowest) else anchor.minimum
    if not anchor.mean.value > 0.0:
        return Cell(text=UNKNOWN)
    tone = "attention" if min(lowest, anchor.minimum) <= 0.0 else ""
    return Cell(text=f"{100.0 * lowest / anchor.mean.value:.0f} %".replace("-", "−"), tone=tone)


# Probabilities of exceedance


def exceedance_chart(analyses: Sequence[Analysis], names: Mapping[str, str], what: str) -> Chart | None:
    """Empirical probabilities that maxima exceed a level, with the fitted tail; None where there are no maxima."""
    choices = []
    for name, label in names.items():
        found = [(each, each.statistics[name]) for each in analyses if name in each.statistics]
        shown = [(analysis, each) for analysis, each in found if len(each.exceedance.level) > 1]
        if shown:
            choices.append(_choice(name, label, shown, len(analyses) > 1))
    if not choices:
        return None
    return Chart(
        kind="lines",
        title=f"Exceedance of maxima: {what}",
        content={"choices": choices, "height": 300},
        caption=(
            "Probability that the largest value between two up-crossings of the mean exceeds a level: points as "
            "observed, with the 95 % band, and the Weibull distribution fitted to the upper part. On Weibull paper "
            "that distribution with the mean as its origin is a straight line where its threshold is small."
        ),
    )


def _choice(
    name: str, label: str, shown: Sequence[tuple[Analysis, SignalStatistics]], several: bool
) -> dict[str, object]:
    """The chart of one signal, on a logarithmic scale and on Weibull paper."""
    unit, factor = _chart_unit(name, shown[0][1].unit)
    plain, paper, marks = [], [], []
    for colour, (analysis, found) in enumerate(shown, 1):
        which = f"{analysis.case.label}: " if several else ""
        points, fit = found.exceedance, found.weibull_maxima
        mean = found.mean.value
        level = factor * points.level
        observed = {"label": f"{which}observed", "colour": colour, "points": True, "x": rounded(level, 6)}
        observed |= {"y": rounded(points.probability)}
        observed |= {"low": rounded(points.low), "high": rounded(points.high)}
        plain.append(observed)
        marks += _marks(analysis, found, factor, which)
        above = points.level > mean
        reduced = {"x": rounded(level[above] - factor * mean, 6), "y": rounded(_reduced(points.probability[above]))}
        paper.append({key: value for key, value in observed.items() if key not in ("low", "high")} | reduced)
        if fit is not None:
            levels, probabilities = _tail(fit, float(points.probability.min()))
            curve = {"label": f"{which}fitted", "colour": colour, "dash": True, "x": rounded(factor * levels, 6)}
            plain.append(curve | {"y": rounded(probabilities)})
            reduced = {"x": rounded(factor * (levels - mean), 6), "y": rounded(_reduced(probabilities))}
            paper.append(curve | reduced)
    least = min(float(found.exceedance.probability.min()) for _, found in shown)
    axis = {"label": f"{label}, {typeset(unit)}"}
    views = [
        {
            "label": "logarithmic",
            "x": axis,
            "y": {"label": "probability", "log": True, "from": 0.2 * least},
            "series": plain,
            "marks": marks,
        },
        {
            "label": "Weibull paper",
            "x": {"label": f"{label} above its mean, {typeset(unit)}", "log": True},
            "y": {"label": "−ln(probability)", "log": True},
            "series": paper,
        },
    ]
    return {"label": label, "views": views}


def _marks(analysis: Analysis, found: SignalStatistics, factor: float, which: str) -> list[dict[str, object]]:
    """Where the expected extremes of both domains are."""
    expected = analysis.expected(found.name)
    values = [("expected", factor * found.expected_maximum.value)]
    if expected:
        values.append(("frequency domain", factor / analysis.factor(found.name) * expected.maximum))
    length = hours(EXPOSURE)
    return [{"x": value, "label": f"{which}{name}, {length}"} for name, value in values if math.isfinite(value)]


def _chart_unit(name: str, unit: str) -> tuple[str, float]:
    """Unit of the chart and the factor to it: that of Table I, or MN."""
    if name in POSITIONS:
        wanted, scale = TABLE_UNITS[name.rpartition(".")[2]]
        return wanted, scale * conversion(unit, "rad" if wanted.endswith("rad") else "m")
    return "MN", MEGA * conversion(unit, "N")


def _tail(fit: WeibullFit, least: float) -> tuple[FloatArray, FloatArray]:
    """Levels and probabilities of a fitted tail, down to a tenth of the least observed probability."""
    probability = np.geomspace(fit.share, min(0.1 * least, 0.5 * fit.share), _CURVE_POINTS)
    return fit.level(probability), probability


def _reduced(probability: FloatArray) -> FloatArray:
    return np.asarray(-np.log(np.clip(probability, 1e-300, 1.0 - 1e-12)))


def key_figures(analysis: Analysis) -> list[tuple[str, Cell]]:
    """Extremes over all records of a case: offset, setdown, tensions, air gap, each with its record and time."""
    case, names = analysis.case, set(recorded(analysis.case.results[0]))
    found: list[tuple[str, Cell]] = []
    surge, sway, heave = POSITIONS[:3]
    if {surge, sway} <= names:
        extreme = _extreme(analysis, lambda values: np.hypot(*values), (surge, sway), highest=True)
        found.append(("largest offset", _value(extreme, "m", 2, case.records)))
    if heave in names:
        extreme = _extreme(analysis, lambda values: values[0], (heave,), highest=False)
        found.append(("lowest heave", _value(extreme, "m", 3, case.records)))
    for heading, highest, bottom in (("largest tension", True, False), ("smallest tension", False, True)):
        chosen = tensions(sorted(names), bottom=bottom) or tensions(sorted(names))
        extremes = [
            (tendon, _extreme(analysis, lambda values: values[0], (name,), highest=highest))
            for tendon, name in chosen.items()
        ]
        if extremes:
            sign = 1.0 if highest else -1.0
            tendon, extreme = max(extremes, key=lambda each: sign * each[1][0])
            cell = _value((MEGA * extreme[0], extreme[1], extreme[2]), "MN", 2, case.records, f"tendon {tendon}")
            found.append((heading, cell))
    if "platform.airgap" in names:
        extreme = _extreme(analysis, lambda values: values[0], ("platform.airgap",), highest=False)
        found.append(("smallest air gap", _value(extreme, "m", 2, case.records)))
    return found


def _extreme(
    analysis: Analysis, of: Callable[[list[FloatArray]], FloatArray], names: Sequence[str], *, highest: bool
) -> tuple[float, int, float]:
    """Largest or smallest of a function of signals in SI units, its record and its time (s)."""
    best = (-math.inf if highest else math.inf, 0, math.nan)
    for index, results in enumerate(analysis.case.results):
        if not set(names) <= set(recorded(results)):
            continue
        time = samples(results, names[0], analysis.start)[0]
        columns = [samples(results, name, analysis.start)[1] * _si(results.unit(name)) for name in names]
        values = of(columns)
        if not len(values) or not np.isfinite(values).any():
            continue
        place = int(np.nanargmax(values) if highest else np.nanargmin(values))
        if (values[place] > best[0]) == highest and values[place] != best[0]:
            best = (float(values[place]), index, float(time[place]))
    return best


def _si(unit: str) -> float:
    """Factor to m or N where the unit is one of length or force, else 1."""
    return next((factor for wanted in ("m", "N") if (factor := conversion(unit, wanted)) != 1.0), 1.0)


def _value(extreme: tuple[float, int, float], unit: str, digits: int, records: Sequence[str], where: str = "") -> Cell:
    value, record, time = extreme
    which = [where] if where else []
    which += [records[record]] if len(records) > 1 else []
    if not math.isfinite(time):
        return Cell(text=UNKNOWN)
    return Cell(text=f"{number(value, digits)} {unit}", below=", ".join([*which, f"at {number(time, 1)} s"]))
