"""Tables of sweeps whose numbers are known in closed form."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tlpsim.scenarios.sweep.sections import LongTerm
from tlpsim.scenarios.sweep.table import SweepTable

HEIGHTS, PERIODS, HEADINGS = (2.0, 4.0, 6.0, 8.0), (8.0, 10.0, 12.0), (0.0, 90.0)
HEIGHT, PERIOD, HEADING = "waves.significant_height", "waves.peak_period", "waves.heading_deg"
REPLICATES = (0.95, 1.0, 1.08)
"""Of each time domain's value to that of the frequency domain"""
MEAN = float(np.mean(REPLICATES))
SURGE, SWAY, TENSION = "platform.position.surge", "platform.position.sway", "platform.tendon_tension"

Change = Callable[[list[dict[str, Any]]], None]


def surge(height: float, period: float, heading: float) -> float:
    """Expected maximum of surge, m; its minimum is half as large."""
    return 0.1 * height * period * (1.5 - heading / 90.0)


def tensions(height: float, heading: float) -> tuple[float, float]:
    """Expected maximum of the first tendon and minimum of the second one, N; the others' are 1 MN within."""
    return 1.2e7 + 4e5 * height + 1e4 * heading, 8e6 - 5e5 * height


def rows_of(variant: int, domains: Sequence[str]) -> list[dict[str, Any]]:
    rows = []
    cells = [(h, t, b) for h in HEIGHTS for t in PERIODS for b in HEADINGS]
    for case, (height, period, heading) in enumerate(cells):
        for domain in domains:
            for replicate, factor in enumerate(REPLICATES, 1) if domain == "time" else [(0, 1.0)]:
                factor = factor * (1.0 + 0.1 * variant)
                largest, least = tensions(height, heading)
                x = surge(height, period, heading)
                rows.append(
                    {
                        "case": 100 * variant + case,
                        "name": "",
                        "variant": variant,
                        "domain": domain,
                        "replicate": replicate,
                        "status": "done",
                        "error": "",
                        "file": f"runs/{case}-{domain}-{replicate}.h5",
                        "probability": 1.0 / len(cells),
                        HEIGHT: height,
                        PERIOD: period,
                        HEADING: heading,
                        f"{SURGE}.mean": 0.2 * x,
                        f"{SURGE}.std": 0.25 * x * factor,
                        f"{SURGE}.expected_maximum": x * factor,
                        f"{SURGE}.expected_minimum": -0.5 * x,
                        f"{TENSION}[1].expected_maximum": largest * factor,
                        f"{TENSION}[2].expected_maximum": largest - 1e6,
                        f"{TENSION}[1].expected_minimum": least + 1e6,
                        f"{TENSION}[2].expected_minimum": least,
                        f"{TENSION}[1].minimum": least + 1.2e6 if domain == "time" else np.nan,
                        f"{TENSION}[2].minimum": least + 2e5 if domain == "time" else np.nan,
                    }
                )
    return rows


def fail(row: dict[str, Any], error: str) -> None:
    """Make a job one that failed."""
    row.update({"status": "failed", "error": error, "file": ""})
    row.update({name: np.nan for name in row if name.startswith("platform.") and "." in name and name[-1].isalpha()})


def table(
    *,
    domains: Sequence[str] = ("frequency", "time"),
    keys: Sequence[str] = (HEIGHT, PERIOD, HEADING),
    variants: Sequence[Mapping[str, Any]] = ({},),
    change: Change = lambda rows: None,
    planned: int | None = None,
    title: str = "By hand",
    units: Mapping[str, str] | None = None,
    notes: tuple[str, ...] = (),
) -> SweepTable:
    """A table of 4 x 3 x 2 sea states; `change` alters its rows."""
    rows = [row for variant in range(len(variants)) for row in rows_of(variant, domains)]
    for row in rows:
        row.update(variants[row["variant"]])
    change(rows)
    names = list(dict.fromkeys(name for row in rows for name in row)) or list(rows_of(0, ["time"])[0])
    columns = {}
    for name in names:
        values = [row.get(name, np.nan) for row in rows]
        texts = any(isinstance(value, str) for value in values) or (not rows and name in ("domain", "status", "file"))
        columns[name] = np.array(values, dtype=object) if texts else np.array(values)
    return SweepTable(
        title=title,
        keys=tuple(keys),
        variants=tuple(variants),
        weighted=True,
        units=units or {SURGE: "m", f"{TENSION}[1]": "N", f"{TENSION}[2]": "N"},
        columns=columns,
        duration=3600.0,
        exposure=10800.0,
        slope=4.0,
        long_term=LongTerm(),
        notes=notes,
        planned=len(rows) if planned is None else planned,
    )


def only(count: int) -> Change:
    """Leave so many rows."""

    def change(rows: list[dict[str, Any]]) -> None:
        del rows[count:]

    return change
