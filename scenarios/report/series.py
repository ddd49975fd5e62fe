"""Time series for a page: which signals, in which panels, at full resolution as far as the page has room.

The signals of the first view come first. A signal that no longer fits at full resolution is kept as an envelope: the
smallest and the largest of each group of m samples, at m times the step, with the smallest m of 4, 16, 64, ... that
fits. The page says so wherever such a signal is drawn.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.recording import select_signals
from tlpsim.scenarios.report.analysis import POSITIONS, Analysis, component_of, recorded, tensions
from tlpsim.scenarios.report.document import Chart
from tlpsim.scenarios.report.packing import pack, pack_times
from tlpsim.scenarios.report.running import records_of
from tlpsim.scenarios.report.setting import event_words
from tlpsim.scenarios.report.words import display_unit, typeset
from tlpsim.scenarios.results import Results

FloatArray = NDArray[np.float64]

BUDGET = 11_000_000
"""Characters of the time series in a page, at most"""

_GROUPS = tuple(4**power for power in range(1, 9))  # m
_LEAST = 10_000  # characters that are kept free for each signal to come
_ENVELOPE_SHARE = 0.02  # of the room that is left, for an envelope
_DEGREE = re.compile(rf"(.+)\.({'|'.join(DEGREES_OF_FREEDOM)})")
_HIGHEST, _LOWEST = "largest over tendons", "smallest over tendons"
_FIRST = (*POSITIONS, "wave.elevation", "wind.wind_speed")
_MOST_SHOWN = 8  # panels at first, of a system without a platform


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Signals that are drawn in one frame, and whether it is shown at first."""

    title: str
    names: tuple[str, ...]
    shown: bool


def panels(names: Sequence[str], wanted: Sequence[str] = ()) -> tuple[Panel, ...]:
    """Panels of all signals: those of the first view, loads by degree of freedom, and each other signal by itself.

    Parameters
    ----------
    names
        Of all recorded signals.
    wanted
        Patterns of the signals that are shown at first instead of the usual ones.

    Raises
    ------
    ScenarioError
        When a pattern matches none of the names.
    """
    try:
        chosen = select_signals(names, wanted) if wanted else set()
    except ScenarioError as error:
        raise ScenarioError(str(error).replace("outputs.signals", "--signal")) from None
    result: list[Panel] = []
    top = list(tensions(names).values())
    for name in _FIRST:
        if name in names:
            result.append(Panel(title=_title(name), names=(name,), shown=not wanted or name in chosen))
    if top:
        result.append(Panel(title="tension, all tendons", names=(_HIGHEST, _LOWEST), shown=not wanted))
    for degree in DEGREES_OF_FREEDOM:
        parts = tuple(name for name in names if _is_load(name) and name.endswith(f".{degree}"))
        if len(parts) > 1:
            shown = not wanted and degree in ("surge", "pitch")
            result.append(Panel(title=f"loads in {degree}", names=parts, shown=shown))
    usual = {name for panel in result for name in panel.names if len(panel.names) == 1}
    others = [name for name in names if name not in usual]
    bare = not wanted and not result
    for number, name in enumerate(others):
        result.append(Panel(title=_title(name), names=(name,), shown=name in chosen or (bare and number < _MOST_SHOWN)))
    return tuple(result)


def _is_load(name: str) -> bool:
    """Whether a signal is a part of a load: `wave.viscous.surge`, but not its total `wave.force.surge`."""
    match = _DEGREE.fullmatch(name)
    part = match[1].rpartition(".")[2] if match else ""
    if part in ("position", "velocity", "acceleration", ""):
        return False
    return not (name.startswith("wave.") and part == "force")


def _title(name: str) -> str:
    for prefix in ("platform.position.", "platform.", "wave.", "wind."):
        if name in _FIRST and name.startswith(prefix):
            return name.removeprefix(prefix).replace("_", " ")
    return name


def series_chart(analyses: Sequence[Analysis], wanted: Sequence[str] = (), budget: int = BUDGET) -> Chart:
    """All recorded signals of all records, packed.

    Parameters
    ----------
    analyses
        Whose records are shown, over each other.
    wanted
        As of `panels`.
    budget
        Characters that the signals may take.

    Raises
    ------
    ScenarioError
        When a pattern matches no signal.
    """
    records = records_of([each.case for each in analyses])
    files = [results for _, results in records]
    names = list(dict.fromkeys(name for results in files for name in recorded(results)))
    frames = panels(names, wanted)
    order = list(
        dict.fromkeys(name for panel in sorted(frames, key=lambda panel: not panel.shown) for name in panel.names)
    )
    packer = _Packer(budget, len(order) * len(files))
    signals = {name: _signal(name, files, packer) for name in order}
    thinned = [signal["group"] for signal in signals.values() if signal["group"] > 1]
    return Chart(
        kind="series",
        title="",
        content={
            "records": [
                {"label": label, "times": {name: pack_times(results.time(name)) for name in results.components}}
                for label, results in records
            ],
            "signals": signals,
            "panels": [{"title": p.title, "signals": p.names, "shown": p.shown} for p in frames],
            "from": min(each.start for each in analyses),
            "events": _events(analyses),
        },
        caption=_caption(len(signals), thinned),
    )


def _events(analyses: Sequence[Analysis]) -> list[dict[str, Any]]:
    """Events of all scenarios, each once."""
    found = {each: None for a in analyses if a.case.scenario is not None for each in event_words(a.case.scenario)}
    return [{"time": time, "label": label} for time, label in sorted(found)]


def _caption(count: int, thinned: Sequence[int]) -> str:
    text = (
        "Each value is within 1/131\u202f068 of its signal's range. Where a pixel covers several samples, the line "
        "spans the smallest and the largest of them; zoomed in, single samples are drawn. Grey: before statistics."
    )
    if thinned:
        text += (
            f" To keep the page small, {len(thinned)} of {count} signals are kept as envelopes, the smallest and the "
            f"largest of every {min(thinned)} to {max(thinned)} samples; they say so. `--signal` puts others first."
        )
    return text


class _Packer:
    """Packs one signal after the other into the room that there is."""

    def __init__(self, budget: int, count: int) -> None:
        self._room = budget
        self._left = count
        self._texts: set[str] = set()

    def pack(self, values: FloatArray) -> dict[str, Any]:
        """Values packed whole, or as the finest envelope that fits."""
        self._left -= 1
        free = self._room - _LEAST * self._left
        if self._may_fit(values, free):
            whole = pack(values)
            if self._cost(whole) <= free:
                return self._taken({"group": 1, "values": whole})
        allowed = max(_ENVELOPE_SHARE * free, _LEAST)
        for group in _GROUPS:
            lowest, highest = envelope(values, group)
            if len(lowest) > allowed and group != _GROUPS[-1]:
                continue
            found = {"group": group, "low": pack(lowest), "high": pack(highest)}
            if self._cost(found["low"]) + self._cost(found["high"]) <= allowed or group == _GROUPS[-1]:
                break
        return self._taken(found)

    def _may_fit(self, values: FloatArray, free: float) -> bool:
        """Whether it is worth a try: smooth signals take a fifth of a character a value."""
        return len(values) * 0.2 <= free

    def _cost(self, packed: dict[str, Any]) -> int:
        """Characters that it adds; equal arrays are in the page once."""
        return 0 if packed["data"] in self._texts else len(packed["data"])

    def _taken(self, found: dict[str, Any]) -> dict[str, Any]:
        for key in ("values", "low", "high"):
            if key in found:
                self._room -= self._cost(found[key])
                self._texts.add(found[key]["data"])
        return found


def envelope(values: FloatArray, group: int) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest of each group of samples, of which the last may have fewer; NaN where all are."""
    starts = np.arange(0, len(values), group)
    if not len(starts):
        return np.zeros(0), np.zeros(0)
    return np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


def _signal(name: str, files: Sequence[Results], packer: _Packer) -> dict[str, Any]:
    """One signal of all records."""
    packed: list[dict[str, Any] | None] = []
    unit, description, component, factor, known = "", "", "", 1.0, False
    for results in files:
        values, source = _values(name, results)
        if values is None or source is None:
            packed.append(None)
            continue
        if not known:
            unit, factor = display_unit(name, results.unit(source), values)
            component, known = component_of(results, source), True
            description = name if name != source else results.description(source)
        packed.append(packer.pack(factor * values))
    return {
        "unit": typeset(unit),
        "description": description,
        "component": component,
        "group": max((each["group"] for each in packed if each), default=1),
        "records": packed,
    }


def _values(name: str, results: Results) -> tuple[FloatArray | None, str | None]:
    """Values of a signal, or of the extreme over all tendons; and the recorded signal whose unit they have."""
    if name not in (_HIGHEST, _LOWEST):
        return (results.signal(name), name) if name in recorded(results) else (None, None)
    top = list(tensions(recorded(results)).values())
    if not top:
        return None, None
    extreme = np.fmax if name == _HIGHEST else np.fmin
    values = results.signal(top[0])
    for each in top[1:]:
        values = extreme(values, results.signal(each))
    return values, top[0]
