"""Long-term results of a sweep as blocks of its page: return values, what governs them, exceedance curves, fatigue."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.report.document import Block, Cell, Chart, Fold, Grid, Row, Table, Text
from tlpsim.scenarios.report.sweep_words import NEGLIGIBLE, signal_label, tendon, years_text
from tlpsim.scenarios.report.words import UNKNOWN, display_unit, number, rounded, short, typeset
from tlpsim.scenarios.spectral_tables import hours
from tlpsim.scenarios.statistics.sea_states import YEAR

FloatArray = NDArray[np.float64]

_MOST_CONTRIBUTIONS = 8  # of a table
_MOST_TABLES = 4  # beside each other before the rest is folded
_DECADE_BELOW = 0.3  # of the smallest probability marked, where curves end


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LongTermFigures:
    """Long-term extreme of a signal, in its unit.

    Attributes
    ----------
    signal, unit
        As in the table of the sweep.
    side
        "maximum" or "minimum".
    variant
        Number of the design alternative, from 0.
    domain
        "frequency" or "time".
    duration
        Of a sea state, s.
    levels, exceedance
        Levels (k,), and the probabilities (k,) that the extreme of a sea state is beyond them.
    return_values
        Level by return period in years.
    intervals
        Limits of their 95 % intervals, where they are known.
    contributions
        Cases with their shares in the exceedance of the value of `governing_years`, largest first.
    governing_years
        Return period of the contributions, years.
    covered
        Probability of the sea states that are in, of 1.
    notes
        What else is to be said of it.
    """

    signal: str
    unit: str
    side: str = "maximum"
    variant: int = 0
    domain: str = "frequency"
    duration: float
    levels: FloatArray
    exceedance: FloatArray
    return_values: Mapping[float, float]
    intervals: Mapping[float, tuple[float, float]] = field(default_factory=dict)
    contributions: tuple[tuple[int, float], ...] = ()
    governing_years: float = 100.0
    covered: float = 1.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FatigueFigures:
    """Long-term fatigue of a signal, in its unit.

    Attributes
    ----------
    signal, unit, variant, domain
        As of `LongTermFigures`.
    damage_equivalent_range
        At 1 Hz, over all sea states.
    slope
        m of the S-N curve.
    damage, life
        Sum of Miner in a life (years); NaN where no S-N curve is given.
    contributions
        Cases with their shares in the damage, largest first.
    notes
        What else is to be said of it.
    """

    signal: str
    unit: str
    variant: int = 0
    domain: str = "frequency"
    damage_equivalent_range: float
    slope: float
    damage: float = math.nan
    life: float = math.nan
    contributions: tuple[tuple[int, float], ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Apart:
    """Whether results are of several variants and of both domains, so that each has to say of which."""

    variants: bool
    domains: bool


def long_term_blocks(
    extremes: Sequence[LongTermFigures],
    fatigue: Sequence[FatigueFigures],
    case_text: Callable[[int, int], str],
    variants: int = 1,
) -> list[Block]:
    """Blocks of the section, none without results.

    Parameters
    ----------
    extremes, fatigue
        Results, in the order in which they are shown.
    case_text
        What is said of a case, from its variant and number.
    variants
        How many design alternatives there are; they are told apart where there are several.
    """
    every: list[LongTermFigures | FatigueFigures] = [*extremes, *fatigue]
    apart = _Apart(variants=variants > 1, domains=len({each.domain for each in every}) > 1)
    blocks: list[Block] = []
    if extremes:
        blocks += [_return_values(extremes, case_text, apart), _exceedance(extremes, apart)]
        blocks += _contributions(
            [
                (f"{_what(each, apart)}, {years_text(each.governing_years)}", each.variant, each.contributions)
                for each in extremes
            ],
            "Sea states that govern",
            "share of the exceedance",
            case_text,
        )
    if fatigue:
        blocks.append(_fatigue(fatigue, case_text, apart))
        blocks += _contributions(
            [(_what(each, apart), each.variant, each.contributions) for each in fatigue],
            "Sea states that damage",
            "share of the damage",
            case_text,
        )
    told = [f"{_what(each, apart)}: {note}" for each in every for note in each.notes]
    return [*blocks, *(Text(text=text, small=True) for text in dict.fromkeys(told))]


def governing_extremes(extremes: Sequence[LongTermFigures]) -> list[LongTermFigures]:
    """Those that a design is decided by: the farthest surge and sway, the highest and the lowest tension of all."""
    groups: dict[str, list[LongTermFigures]] = {"surge": [], "sway": [], "highest": [], "lowest": []}
    for each in extremes:
        label = signal_label(each.signal)
        kind = {"maximum": "highest", "minimum": "lowest"}[each.side] if tendon(each.signal) else label
        if kind in groups and math.isfinite(_governing_value(each)):
            groups[kind].append(each)
    # A motion across the weather is no design value.
    sizes = {
        kind: max((abs(_governing_value(each)) for each in groups[kind]), default=0.0) for kind in ("surge", "sway")
    }
    for kind, size in sizes.items():
        if size < NEGLIGIBLE * max(sizes.values()):
            groups[kind].clear()
    return [max(group, key=lambda each: _beyond(kind, each)) for kind, group in groups.items() if group]


def _governing_value(extreme: LongTermFigures) -> float:
    return extreme.return_values.get(extreme.governing_years, math.nan)


def _beyond(kind: str, extreme: LongTermFigures) -> float:
    value = _governing_value(extreme)
    return {"highest": value, "lowest": -value}.get(kind, abs(value))


def governing_fact(extreme: LongTermFigures, case_text: Callable[[int, int], str], variants: int) -> tuple[str, Cell]:
    """Return value of the contributions' period as a card, with the sea state that governs it."""
    unit, factor = _unit(extreme)
    value = _governing_value(extreme)
    below = [f"{extreme.domain} domain" + (f", variant {extreme.variant + 1}" if variants > 1 else "")]
    if extreme.contributions:
        case, share = extreme.contributions[0]
        below.append(f"{100.0 * share:.0f} % by {case_text(extreme.variant, case)}")
    name = f"{signal_label(extreme.signal)}: {extreme.governing_years:g}-year {extreme.side}"
    return name, Cell(text=f"{short(factor * value)} {typeset(unit)}", below="\n".join(below))


def _what(each: LongTermFigures | FatigueFigures, apart: _Apart) -> str:
    side = f", {each.side}" if isinstance(each, LongTermFigures) else ""
    which = _which(each, apart)
    return f"{signal_label(each.signal)}{side}" + (f" ({which})" if which else "")


def _which(each: LongTermFigures | FatigueFigures, apart: _Apart) -> str:
    """Variant and domain, where there are several."""
    parts = [f"variant {each.variant + 1}"] if apart.variants else []
    return ", ".join([*parts, each.domain] if apart.domains else parts)


def _unit(each: LongTermFigures | FatigueFigures) -> tuple[str, float]:
    """Unit in which a result is shown, and the factor to it."""
    if isinstance(each, LongTermFigures):
        sizes = np.array([value for value in each.return_values.values() if math.isfinite(value)])
    else:
        sizes = np.array([each.damage_equivalent_range])
    return display_unit(each.signal, each.unit, sizes)


def _return_values(extremes: Sequence[LongTermFigures], case_text: Callable[[int, int], str], apart: _Apart) -> Table:
    periods = sorted({years for each in extremes for years in each.return_values})
    rows = []
    for each in extremes:
        unit, factor = _unit(each)
        cells = []
        for years in periods:
            low, high = each.intervals.get(years, (math.nan, math.nan))
            interval = f"{number(factor * low)} to {number(factor * high)}" if math.isfinite(low + high) else ""
            cells.append(Cell(text=short(factor * each.return_values.get(years, math.nan), 4), below=interval))
        governing: str | Cell = UNKNOWN
        if each.contributions:
            governing = _governing(each.variant, each.contributions[0], case_text)
        covered = Cell(text=f"{100.0 * each.covered:.4g} %", tone="" if each.covered > 0.999 else "attention")
        rows.append(Row(heading=_what(each, apart), cells=(*cells, typeset(unit), governing, covered)))
    governing_years = sorted({each.governing_years for each in extremes})
    names = " and ".join(years_text(years) for years in governing_years)
    headings = ("signal", *map(years_text, periods), "unit", f"governed by, at {names}", "probability in")
    length = hours(extremes[0].duration)
    note = (
        f"The level beyond which the extreme of a sea state of {length} is expected to be once in so many years; "
        "below it the limits of the 95 % interval where there are several replicates. The last column is the "
        "probability of the sea states that are in: what is missing may hold what governs."
    )
    return Table(
        caption="Return values",
        headings=headings,
        rows=tuple(rows),
        note=note,
        text_columns=(len(periods), len(periods) + 1),
    )


def _governing(variant: int, contribution: tuple[int, float], case_text: Callable[[int, int], str]) -> Cell:
    """The case that contributes most, with its settings below."""
    case, share = contribution
    which, _, settings = case_text(variant, case).partition(", ")
    return Cell(text=f"{100.0 * share:.0f} %: {which}", below=settings)


def _exceedance(extremes: Sequence[LongTermFigures], apart: _Apart) -> Chart:
    """Probability of exceedance in a sea state's duration against the level, a choice for each signal and side."""
    groups: dict[tuple[str, str], list[LongTermFigures]] = {}
    for each in extremes:
        groups.setdefault((each.signal, each.side), []).append(each)
    choices = []
    for (signal, side), group in groups.items():
        unit, factor = _unit(group[0])
        periods = sorted({years for each in group for years in each.return_values})
        probabilities = [group[0].duration / (years * YEAR) for years in periods]
        marks = [{"y": y, "label": years_text(years)} for y, years in zip(probabilities, periods, strict=True)]
        least = _DECADE_BELOW * min(probabilities, default=1e-6)
        series = []
        for colour, each in enumerate(group, 1):
            # Beyond what is shown a curve only squeezes the axis.
            near = (each.exceedance >= least) & (each.exceedance < 1.0)
            order = np.argsort(each.levels[near])
            series.append(
                {
                    "label": _which(each, apart) or each.domain,
                    "colour": colour,
                    "dash": each.domain == "frequency" and len(group) > 1,
                    "x": rounded(factor * each.levels[near][order], 6),
                    "y": rounded(each.exceedance[near][order]),
                }
            )
        label = f"{signal_label(signal)}, {side}"
        probability = {"label": f"probability in {hours(group[0].duration)}", "log": True, "from": least, "to": 1.0}
        axis = {"label": f"{label}, {typeset(unit)}"}
        view = {"label": "logarithmic", "x": axis, "y": probability, "series": series, "marks": marks}
        choices.append({"label": label, "views": [view]})
    return Chart(
        kind="lines",
        title="Long-term exceedance",
        content={"choices": choices, "height": 320},
        caption="Probability that the extreme of a sea state, drawn from the scatter diagram, is beyond a level.",
    )


def _fatigue(fatigue: Sequence[FatigueFigures], case_text: Callable[[int, int], str], apart: _Apart) -> Table:
    rows = []
    for each in fatigue:
        unit, factor = _unit(each)
        damage = Cell(text=short(each.damage), tone="attention" if each.damage >= 1.0 else "")
        governing: str | Cell = UNKNOWN
        if each.contributions:
            governing = _governing(each.variant, each.contributions[0], case_text)
        cells = (short(factor * each.damage_equivalent_range, 4), typeset(unit), short(each.slope), damage)
        life = f"{each.life:g} years" if math.isfinite(each.life) else UNKNOWN
        rows.append(Row(heading=_what(each, apart), cells=(*cells, life, governing)))
    headings = ("signal", "damage-equivalent range", "unit", "slope m", "damage", "in a life of", "governed by")
    note = "Damage-equivalent range at 1 Hz over all sea states; damage is the sum of Miner, 1 at failure."
    return Table(caption="Fatigue", headings=headings, rows=tuple(rows), note=note, text_columns=(1, 5))


def _contributions(
    groups: Sequence[tuple[str, int, tuple[tuple[int, float], ...]]],
    title: str,
    heading: str,
    case_text: Callable[[int, int], str],
) -> list[Block]:
    """Tables of the cases with the largest shares, beside each other."""
    tables = []
    for what, variant, contributions in groups:
        if contributions:
            rows = [
                Row(heading=case_text(variant, case), cells=(Cell(text=f"{100.0 * share:.1f} %", share=share),))
                for case, share in contributions[:_MOST_CONTRIBUTIONS]
            ]
            tables.append(Table(caption=f"{title}: {what}", headings=("sea state", heading), rows=tuple(rows)))
    first, more = tables[:_MOST_TABLES], tables[_MOST_TABLES:]
    blocks: list[Block] = [Grid(blocks=tuple(first))] if first else []
    return [*blocks, Fold(summary=f"{title}: further signals", blocks=(Grid(blocks=tuple(more)),))] if more else blocks
