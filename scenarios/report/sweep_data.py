"""The table of a sweep as its page has it: columns in the units that are shown, packed for the scripts.

Every statistic is kept as far as the page has room for it; the order of `STATISTICS` says which goes first where it
has not. Settings are kept as they are: each value once, and which one a row has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.report.packing import pack
from tlpsim.scenarios.report.sweep_words import (
    ANY_TENDON,
    EXPECTED_EXTREME,
    STATISTICS,
    key_labels,
    key_unit,
    signal_label,
    tendon,
    value_text,
    variant_labels,
)
from tlpsim.scenarios.report.words import display_unit, typeset

if TYPE_CHECKING:
    from tlpsim.scenarios.sweep.table import SweepTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MOST_VALUES = 4_000_000
"""Values of statistics in a page, each of some two and a half bytes there: a page of about 10 MB."""
DOMAINS = ("frequency", "time")
_DIGIT = 32768  # of a whole number in two parts, each of which is packed exactly


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """A table of n rows, in the units that are shown.

    Attributes
    ----------
    table
        As given.
    values
        Statistics (n,) by signal and statistic; NaN where they are not known, as for failed jobs.
    units
        Unit of each signal, not typeset.
    factors
        How many of it there are in the table's unit.
    """

    table: SweepTable
    values: Mapping[tuple[str, str], FloatArray]
    units: Mapping[str, str]
    factors: Mapping[str, float]

    @property
    def rows(self) -> int:
        """Number of jobs in the table, n."""
        return len(self.table.columns["case"])

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals that have a statistic, the tendons one by one after all others."""
        return tuple(self.units)

    @cached_property
    def done(self) -> NDArray[np.bool_]:
        """Which jobs ended well (n,)."""
        return np.asarray(self.table.columns["status"]) == "done"

    @cached_property
    def cases(self) -> IntArray:
        """Number of each row's case (n,), from 0, where the same case of another variant is another one."""
        both = np.stack([self.table.columns[name].astype(np.int64) for name in ("variant", "case")])
        return np.unique(both, axis=1, return_inverse=True)[1].ravel().astype(np.int64)

    @cached_property
    def domain(self) -> IntArray:
        """Place of each row's domain in `DOMAINS` (n,)."""
        return (np.asarray(self.table.columns["domain"]) == "time").astype(np.int64)

    def averaged(self, signal: str, statistic: str) -> tuple[IntArray, FloatArray]:
        """A statistic of each case in each domain, the mean over its replicates where it is known.

        Returns
        -------
        A row of each of the g cases in a domain that have a value (g,), and the means (g,).
        """
        values = self.values[signal, statistic]
        known = np.flatnonzero(np.isfinite(values) & self.done)
        groups, first, member = np.unique(
            2 * self.cases[known] + self.domain[known], return_index=True, return_inverse=True
        )
        counts = np.bincount(member, minlength=len(groups))
        return known[first], np.bincount(member, values[known], len(groups)) / counts

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Keys of which the table has more than one value."""
        return tuple(key for key in self.table.keys if len(levels(self.table.columns[key])[0]) > 1)

    @cached_property
    def design(self) -> frozenset[str]:
        """Keys that the variants set, where there are several."""
        several = len(self.table.variants) > 1
        return frozenset(key for each in self.table.variants for key in each if several)

    def settings(self, row: int) -> str:
        """What tells the case of a row from others of its variant: "significant height 12 m, waves heading 45 deg"."""
        labels, columns = key_labels(self.table.keys), self.table.columns
        keys = [key for key in self.varied if key not in self.design]
        parts = [f"{labels[key]} {value_text(_plain(columns[key][row]), key_unit(key))}" for key in keys]
        name = str(columns["name"][row]) if "name" in columns else ""
        return ", ".join([name, *parts] if name else parts)

    def case_text(self, row: int) -> str:
        """Case of a row, with its settings, variant and domain."""
        columns = self.table.columns
        parts = [f"case {int(columns['case'][row])}"]
        parts += [f"variant {int(columns['variant'][row]) + 1}"] if len(self.table.variants) > 1 else []
        parts += [f"{columns['domain'][row]} domain"] if len(np.unique(self.domain)) > 1 else []
        settings = self.settings(row)
        return ", ".join(parts) + (f": {settings}" if settings else "")


def sweep(table: SweepTable) -> Sweep:
    """The table in the units that are shown, with the governing tendon, and extremes of either sign."""
    known = {each.name: each for each in STATISTICS}
    columns: dict[str, dict[str, FloatArray]] = {}
    for name, values in table.columns.items():
        signal, _, statistic = name.rpartition(".")
        if statistic in known and signal and name not in table.keys:
            columns.setdefault(signal, {})[statistic] = np.asarray(values, dtype=np.float64)
    units, factors = _units(table, columns)
    found = {
        (signal, statistic): values * (factors[signal] if known[statistic].unit == "signal" else 1.0)
        for signal, group in columns.items()
        for statistic, values in group.items()
        if np.isfinite(values).any()
    }
    for signal in columns:
        if not tendon(signal) and all((signal, f"expected_{side}") in found for side in ("maximum", "minimum")):
            high, low = found[signal, "expected_maximum"], found[signal, "expected_minimum"]
            found[signal, EXPECTED_EXTREME] = np.where(np.abs(high) >= np.abs(low), high, low)
    tendons = [signal for signal in columns if tendon(signal)]
    if tendons:
        for each in STATISTICS:
            several = [found[signal, each.name] for signal in tendons if (signal, each.name) in found]
            if several:
                found[ANY_TENDON, each.name] = _governing(np.stack(several), each.name)
        units, factors = ({**values, ANY_TENDON: values[tendons[0]]} for values in (units, factors))
    order = [*(s for s in units if not tendon(s)), *tendons]
    shown = [signal for signal in order if any((signal, each.name) in found for each in STATISTICS)]
    return Sweep(table=table, values=found, units={s: units[s] for s in shown}, factors={s: factors[s] for s in shown})


def _units(table: SweepTable, columns: Mapping[str, Mapping[str, FloatArray]]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Unit in which each signal is shown, the same of all tensions, and the factor to it."""
    own = [each.name for each in STATISTICS if each.unit == "signal"]
    largest: dict[str, float] = {}
    for signal, group in columns.items():
        known = [abs(v[np.isfinite(v)]) for name, v in group.items() if name in own]
        kind = ANY_TENDON if tendon(signal) else signal
        largest[kind] = max([largest.get(kind, 0.0), *(float(each.max()) for each in known if len(each))])
    units, factors = {}, {}
    for signal in columns:
        size = np.array([largest[ANY_TENDON if tendon(signal) else signal]])
        units[signal], factors[signal] = display_unit(signal, table.units.get(signal, ""), size)
    return units, factors


def severity(values: FloatArray, statistic: str) -> FloatArray:
    """How bad values of a statistic are, of any shape: the larger, the worse; least where they are not known."""
    worst = next(each.worst for each in STATISTICS if each.name == statistic)
    size = {"max": values, "min": -values, "abs": np.abs(values)}[worst]
    return np.where(np.isfinite(values), size, -np.inf)


def _governing(values: FloatArray, statistic: str) -> FloatArray:
    """Worst of several signals (k, n) in each row (n,); NaN where none is known."""
    return np.take_along_axis(values, severity(values, statistic).argmax(axis=0)[None], axis=0)[0]


def levels(values: NDArray[Any]) -> tuple[list[Any], IntArray]:
    """Different values of a key, numbers rising and texts in the order of their first row, and which a row has (n,).

    NaN, of a case without the key, is none of them: its number is that after the last.
    """
    plain = [_plain(value) for value in values.tolist()]
    numbers = all(type(value) in (int, float) for value in plain)
    if numbers:
        different: list[Any] = sorted({value for value in plain if math.isfinite(value)})
    else:
        plain = [value_text(value) for value in plain]
        different = list(dict.fromkeys(plain))
    place = {value: index for index, value in enumerate(different)}
    return different, np.array([place.get(value, len(different)) for value in plain], dtype=np.int64)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


# For the scripts


def packed_whole(values: IntArray) -> dict[str, Any]:
    """Whole numbers from 0 to 2^30, exactly, for `whole` of `assets/sweep.js`."""
    low, high = (part.astype(np.float64) for part in (values % _DIGIT, values // _DIGIT))
    return {"low": pack(low), "high": pack(high)}


def packed_sweep(found: Sweep, most_values: int = MOST_VALUES) -> dict[str, Any]:
    """The content of the page's data, see `assets/sweep.js`; with at most so many values of statistics."""
    table, columns = found.table, found.table.columns
    kept, left_out = _kept(found, most_values)
    probability = np.asarray(columns.get("probability", np.full(found.rows, np.nan)), dtype=np.float64)
    return {
        "count": found.rows,
        "case": packed_whole(columns["case"].astype(np.int64)),
        "variant": packed_whole(columns["variant"].astype(np.int64)),
        "replicate": packed_whole(columns["replicate"].astype(np.int64)),
        "domain": packed_whole(found.domain),
        "failed": packed_whole((~found.done).astype(np.int64)),
        "probability": pack(probability) if np.isfinite(probability).any() else None,
        "names": [str(each) for each in columns["name"].tolist()] if "name" in columns else [],
        "files": [str(each) for each in columns["file"].tolist()],
        "variants": list(variant_labels(table.variants)),
        "keys": _keys(found),
        "statistics": [
            {"name": each.name, "label": each.label, "unit": each.unit, "worst": each.worst} for each in STATISTICS
        ],
        "signals": [
            {
                "name": signal,
                "label": signal_label(signal),
                "unit": typeset(found.units[signal]),
                "tendon": tendon(signal),
            }
            for signal in found.signals
            if any(name == signal for name, _ in kept)
        ],
        "values": [
            {"signal": signal, "statistic": statistic, "packed": pack(found.values[signal, statistic])}
            for signal, statistic in kept
        ],
        "left_out": left_out,
    }


def _keys(found: Sweep) -> list[dict[str, Any]]:
    keys = []
    for key, label in key_labels(found.table.keys).items():
        different, which = levels(found.table.columns[key])
        keys.append(
            {
                "name": key,
                "label": label,
                "unit": key_unit(key),
                "text": bool(different) and isinstance(different[0], str),
                "design": key in found.design,
                "levels": different,
                "which": packed_whole(which),
            }
        )
    return keys


def _kept(found: Sweep, most: int) -> tuple[Sequence[tuple[str, str]], str]:
    """Statistics for which there is room, and what is said of those for which there is none."""
    rank = {each.name: number for number, each in enumerate(STATISTICS)}
    # The governing tendon and the motions before the tendons one by one.
    order = sorted(found.values, key=lambda pair: (bool(tendon(pair[0])), rank[pair[1]], found.signals.index(pair[0])))
    room = most // max(found.rows, 1)
    kept = sorted(order[:room], key=lambda pair: (found.signals.index(pair[0]), rank[pair[1]]))
    left = len(order) - len(kept)
    told = (
        f"{left} of {len(order)} statistics of signals are left out, since the page would be too large; "
        "the table has them"
        if left
        else ""
    )
    return kept, told
