"""The scenario in words: waves, wind, current, water, platform; what differs from the default; the whole of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from tlpsim.scenarios.report.cases import Case, differences
from tlpsim.scenarios.report.document import Block, Cell, Facts, Fold, Row, Table, Text, Verbatim
from tlpsim.scenarios.report.words import UNKNOWN, listed, seconds, short
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.writing import to_toml

_SPECTRA = {"api": "API", "npd": "NPD", "jonswap": "JONSWAP"}
_LONGEST = 80  # characters of a value in a table


def setting_facts(scenario: Scenario) -> Facts:
    """Waves, wind, current, water and platform of a scenario in a line each."""
    entries = (
        ("waves", _waves(scenario)),
        ("wind", _wind(scenario)),
        ("current", _current(scenario)),
        ("water", Cell(text=f"{short(scenario.site.water_depth)} m deep")),
        ("platform", _platform(scenario)),
        ("length", Cell(text=seconds(scenario.simulation.duration), below=f"start: {scenario.simulation.start}")),
    )
    events = tuple(("event", Cell(text=text, below=f"at {time:g} s")) for time, text in event_words(scenario))
    return Facts(entries=(*entries, *events))


def event_words(scenario: Scenario) -> list[tuple[float, str]]:
    """Time (s) of each event of a scenario, in their order, and what happens."""
    found = []
    for event in sorted(scenario.events, key=lambda each: each.at):
        tendons = [str(number) for number in event.lose_tendons]
        words = [f"tendon{'s' if len(tendons) > 1 else ''} {listed(tendons)} lost"] if tendons else []
        words += ["current changes"] if event.current is not None else []
        words += [f"{name} = {value}" for name, value in event.values.items()]
        found.append((event.at, "; ".join(words)))
    return found


def _waves(scenario: Scenario) -> Cell:
    waves = scenario.waves
    if waves.significant_height == 0.0:
        return Cell(text="calm water")
    if waves.table is not None:
        return Cell(text="spectrum of a table", below=f"toward {waves.heading_deg:g}°")
    spread = "long-crested"
    if waves.directions > 1:
        spread = f"{waves.directions} directions, cos^{waves.spreading_exponent:g} spreading"
    return Cell(
        text=f"Hs {short(waves.significant_height)} m, Tp {short(waves.peak_period, 4)} s",
        below=f"{named(waves.spectrum)}, toward {waves.heading_deg:g}°, {spread}",
    )


def _wind(scenario: Scenario) -> Cell:
    wind = scenario.wind
    if wind.speed == 0.0:
        return Cell(text="no wind")
    return Cell(
        text=f"{short(wind.speed)} m/s at 10 m", below=f"{named(wind.spectrum)} gusts, toward {wind.heading_deg:g}°"
    )


def _current(scenario: Scenario) -> Cell:
    current = scenario.current
    if current.table is not None:
        return Cell(
            text=f"{short(current.table.speed[0])} m/s at {short(current.table.depth[0])} m depth",
            below=f"profile of {len(current.table.depth)} depths, toward {current.table.heading_deg[0]:g}° there",
        )
    if current.speed == 0.0:
        return Cell(text="no current")
    profile = f"power law, exponent {current.exponent:g}" if current.exponent else "uniform"
    return Cell(text=f"{short(current.speed)} m/s", below=f"{profile}, toward {current.heading_deg:g}°")


def _platform(scenario: Scenario) -> Cell:
    platform = scenario.platform
    return Cell(
        text=f"{platform.model.replace('issc_tlp', 'ISSC TLP')}, {short(platform.mass / 1e6)} kt",
        below=f"draught {short(platform.draught)} m, hydrodynamics {platform.hydrodynamics.rpartition('/')[2]}",
    )


def named(spectrum: str) -> str:
    """Name of a spectrum as one writes it: Pierson-Moskowitz."""
    return _SPECTRA.get(spectrum, spectrum.replace("_", "-").title())


def setting_blocks(cases: Sequence[Case]) -> list[Block]:
    """Each case in words, and as differences from the default scenario, and in full as TOML."""
    blocks: list[Block] = []
    for case in cases:
        if case.scenario is None:
            text = _indented(str(case.results[0].attributes.get("system", "")))
            if text:
                blocks.append(Fold(summary=f"System: {case.label}", blocks=(Verbatim(text=text),)))
            continue
        which = f": {case.label}" if len(cases) > 1 else ""
        if len(cases) > 1:
            blocks += [Text(text=f"{case.label}:"), setting_facts(case.scenario)]
        blocks.append(_difference_table(case.scenario, which))
        data = json.loads(case.scenario.to_json())
        blocks.append(Fold(summary=f"Scenario as TOML{which}", blocks=(Verbatim(text=to_toml(_without_none(data))),)))
    return blocks


def _difference_table(scenario: Scenario, which: str) -> Block:
    found = differences(scenario)
    if not found:
        return Text(text=f"Every key has its default value{which}.")
    rows = tuple(Row(heading=key, cells=(_value(value), _value(default))) for key, value, default in found)
    return Table(
        caption=f"What differs from the default scenario{which}",
        headings=("key", "value", "default"),
        rows=rows,
        text_columns=(0, 1),
    )


def _value(value: Any) -> Cell:
    text = UNKNOWN if value is None else json.dumps(value, ensure_ascii=False)
    return Cell(
        text=text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…", hint=text if len(text) > _LONGEST else ""
    )


def _without_none(value: Any) -> Any:
    """Nested content without what is not set, which TOML cannot say."""
    if isinstance(value, dict):
        return {key: _without_none(each) for key, each in value.items() if each is not None}
    return [_without_none(each) for each in value] if isinstance(value, list) else value


def _indented(text: str) -> str:
    try:
        return json.dumps(json.loads(text), indent=1, ensure_ascii=False)
    except ValueError:
        return text
