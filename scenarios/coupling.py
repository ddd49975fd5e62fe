"""What `--coupling` shows: filters and extrapolations of each connection before a run, their errors after it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rich.box import SIMPLE_HEAD
from rich.table import Table

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.coupling_report import ConnectionMeasure, ConnectionReport
from tlpsim.scenarios.terminal import output

_LEGEND = (
    "error: of the wanted part, the largest in the band between samples, that at its end (Hz) beyond them; image: of "
    "the band above it; alias: of what folds onto it, above 0 what is amplified; + s: how far beyond the newest sample"
)
_MEASURED_LEGEND = (
    "relative to the standard deviation; between: each sample from its neighbours by the connection's filter, hence "
    "the error at twice the step; beyond: each sample from those that were there one horizon earlier"
)


def print_coupling(reports: Sequence[ConnectionReport], band: float) -> None:
    """Table of `tlpsim.orchestrator.coupling_report.coupling_report`, six degrees of freedom in a row where alike."""
    title = f"coupling, for a band to {band:g} cycles a sample of the slower component"
    table = Table(title=title, caption=_LEGEND, box=SIMPLE_HEAD, padding=0)
    table.add_column("connection", no_wrap=True)
    for heading in ("step, s\nband, Hz", "values by", "error", "dB", "delay\ns"):
        table.add_column(heading, no_wrap=True)
    for each in _together(reports):
        source, _, target = each.connection.partition(" -> ")
        levels = [
            f"{name} {level:.0f}" for name, level in (("image", each.image), ("alias", each.alias)) if level > -999
        ]
        values = []
        if each.filter:
            values.append((each.filter, _short(each.error), f"{_rounded(each.delay):.2g}"))
        if each.extrapolation:
            values.append((f"{each.extrapolation} +{each.horizon:g} s", _short(each.extrapolation_error), ""))
        methods, errors, delays = (list(column) for column in zip(*values, strict=True)) if values else ([], [], [])
        steps = [f"{each.source_step:g}→{each.target_step:g}", f"{each.band:.3g}"]
        columns = ([source, f"→ {target}"], steps, methods, errors, levels, delays)
        table.add_row(*("\n".join(column) for column in columns))
    output.print(table)


def print_measures(measures: Sequence[ConnectionMeasure]) -> None:
    """Table of `tlpsim.orchestrator.coupling_report.CouplingMeter`, without what is neither inter- nor extrapolated."""
    table = Table(title="coupling, measured", caption=_MEASURED_LEGEND)
    table.add_column("connection", overflow="fold")
    for heading in ("samples", "std", "between", "beyond"):
        table.add_column(heading, justify="right")
    for each in measures:
        if each.samples:
            numbers = (_measured(value) for value in (each.interpolation, each.extrapolation))
            table.add_row(each.connection, str(each.samples), f"{each.deviation:.4g}", *numbers)
    output.print(table)


def _together(reports: Sequence[ConnectionReport]) -> list[ConnectionReport]:
    """Reports with those of the six degrees of freedom as one, with * in its name, where they say the same."""
    result: list[ConnectionReport] = []
    for each in reports:
        name = each.connection
        for degree in DEGREES_OF_FREEDOM:
            if name.endswith(f".{degree}"):
                name = name.replace(f".{degree}", ".*")
        general = replace(each, connection=name)
        if not result or result[-1] != general:
            result.append(general)
    return result


def _measured(value: float) -> str:
    return "–" if math.isnan(value) else _short(value)


def _short(value: float) -> str:
    return f"{value:.1e}".replace("e-0", "e-").replace("e+00", "")


def _rounded(delay: float) -> float:
    """Without what is left of rounding."""
    return 0.0 if abs(delay) < 1e-12 else delay
