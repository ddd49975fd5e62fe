"""What `tlpsim sensitivity` leaves: tables, CSV, HDF5, JSON, and the tornado figure."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from rich.table import Table

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sensitivity import STATISTICS, Change, Sensitivity
from tlpsim.scenarios.spectral_file import head, opened
from tlpsim.scenarios.spectral_tables import number
from tlpsim.scenarios.terminal import output

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMAT = "tlpsim sensitivity"
SCHEMA_VERSION = 1
FIGURE = "sensitivity.png"
PANELS = (
    *(f"{degree} {what}" for degree in ("surge", "sway", "yaw") for what in ("mean", "LF", "WF")),
    "heave mean",
    "tension std",
    "tension max",
)
"""Statistics that have a panel in the figure."""

_GROUPS = tuple(tuple(STATISTICS)[k : k + 6] for k in (0, 6, 12, 18))  # columns of a table
_COLOURS = {"-": "#4ba3e3", "+": "#d9822b"}


def print_sensitivity(found: Sensitivity) -> None:
    """Relative change of every statistic for each change, in tables of two degrees of freedom each."""
    changes = ", ".join(dict.fromkeys(f"±{change.label[1:]}" for change in found.changes))
    output.print(f"{found.scenario.title}: what {changes} of one key does, in %", soft_wrap=True)
    for group in _GROUPS:
        table = Table()
        table.add_column("", no_wrap=True)
        table.add_column("", no_wrap=True)
        for name in group:
            table.add_column(name.replace(" ", "\n"), justify="right")
        places = [tuple(STATISTICS).index(name) for name in group]
        units = [f"{found.base[k]:.2f}\n{STATISTICS[name][0]}" for k, name in zip(places, group, strict=True)]
        table.add_row("as it is", "", *units, end_section=True)
        for place, change in enumerate(found.changes):
            relative = found.relative(change)
            cells = ["failed"] if change.problem else [_percent(relative[k]) for k in places]
            known = place and found.changes[place - 1].parameter == change.parameter
            table.add_row("" if known else short_name(change.parameter), change.label[0], *cells)
        output.print(table)
    for line in _remarks(found):
        output.print(line, soft_wrap=True)


def _percent(part: float) -> str:
    """Part in per cent, of five characters as a rule."""
    return number(100.0 * part, 1 if abs(part) < 0.9995 else 0)


def short_name(parameter: str) -> str:
    """A key as it is shown: those of the platform without its name."""
    return parameter.removeprefix("platform.")


def _remarks(found: Sensitivity) -> Iterator[str]:
    for change in found.changes:
        if change.problem:
            yield f"failed: {change.parameter} {change.label}: {change.problem}"
    for note in found.notes:
        yield f"note: {note}"


def sensitivity_rows(found: Sensitivity) -> list[dict[str, Any]]:
    """A row for each change and statistic; NaN where a case failed."""
    return [
        {
            "parameter": change.parameter,
            "change": change.label,
            "value": list(change.value) if isinstance(change.value, tuple) else change.value,
            "statistic": name,
            "unit": unit,
            "base": base,
            "changed": float("nan") if change.problem else change.statistics[place],
            "relative_change": relative,
            "problem": change.problem,
        }
        for change in found.changes
        for place, ((name, (unit, _)), base, relative) in enumerate(
            zip(STATISTICS.items(), found.base, found.relative(change), strict=True)
        )
    ]


def sensitivity_json(found: Sensitivity) -> str:
    """Rows and notes as JSON; what is not known is null."""
    content = {
        "kind": "sensitivity",
        "title": found.scenario.title,
        "notes": list(found.notes),
        "rows": sensitivity_rows(found),
    }
    return json_text(content)


def require_output(path: Path) -> None:
    """Refuse a name of an output whose suffix says no format.

    Raises
    ------
    ScenarioError
        When it is neither .csv nor .h5.
    """
    if path.suffix not in (".csv", ".h5"):
        raise ScenarioError(f"--output {path}: its suffix must say the format, .csv or .h5")


def write_sensitivity(found: Sensitivity, path: Path) -> None:
    """Write as CSV, a line for each row, or as HDF5, by the suffix; the file is there when it is complete.

    In HDF5 ``statistics`` (changes, statistics) and ``base`` (statistics,) are in ``units``, and ``parameters``,
    ``changes``, ``values`` (JSON) and ``problems`` (changes,) tell what was changed.

    Raises
    ------
    ScenarioError
        If the file cannot be written, or its suffix says no format.
    """
    require_output(path)
    with whole_file(path, "the sensitivity") as part:
        if path.suffix == ".csv":
            rows = sensitivity_rows(found)
            with part.open("w", newline="", encoding="utf-8") as text:
                writer = csv.DictWriter(text, list(rows[0]))
                writer.writeheader()
                writer.writerows(rows)
            return
        with h5py.File(part, "w") as file:
            file.attrs.update(head(FORMAT, SCHEMA_VERSION, found.scenario))
            unknown = (float("nan"),) * len(STATISTICS)
            data = np.array([change.statistics or unknown for change in found.changes])
            file.create_dataset("statistics", data=data)
            file.create_dataset("base", data=np.array(found.base))
            texts = {
                "names": list(STATISTICS),
                "units": [unit for unit, _ in STATISTICS.values()],
                "parameters": [change.parameter for change in found.changes],
                "changes": [change.label for change in found.changes],
                "values": [json.dumps(change.value) for change in found.changes],
                "problems": [change.problem for change in found.changes],
                "notes": list(found.notes),
            }
            for name, words in texts.items():
                file.create_dataset(name, data=words, dtype=h5py.string_dtype())


def read_sensitivity(path: str | Path) -> Sensitivity:
    """Changes of an HDF5 file that `write_sensitivity` wrote.

    Raises
    ------
    ScenarioError
        If there is no such file, it is another kind of file, or its layout is newer than this version knows.
    """
    with opened(path, FORMAT, SCHEMA_VERSION, "tlpsim sensitivity") as file:
        columns = [file[name].asstr()[()] for name in ("parameters", "changes", "values", "problems")]
        changes = []
        for row, (parameter, label, text, problem) in zip(
            file["statistics"][()], zip(*columns, strict=True), strict=True
        ):
            value = json.loads(text)
            changes.append(
                Change(
                    parameter=parameter,
                    label=label,
                    value=tuple(value) if isinstance(value, list) else value,
                    statistics=() if problem else tuple(float(each) for each in row),
                    problem=problem,
                )
            )
        return Sensitivity(
            scenario=Scenario.from_json(str(file.attrs["scenario"])),
            base=tuple(float(each) for each in file["base"]),
            changes=tuple(changes),
            notes=tuple(file["notes"].asstr()[()]),
        )


def draw_sensitivity(folder: Path, found: Sensitivity) -> list[Path]:
    """Draw the tornado figure into a folder, which is made where it is missing, and return the file.

    Raises
    ------
    ScenarioError
        When the folder cannot be written.
    """
    from tlpsim.scenarios.figure_files import save

    return save(folder, {FIGURE: tornado_figure(found)})


def tornado_figure(found: Sensitivity) -> Figure:
    """Relative changes of a statistic in a panel each, those of the largest change at its top."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    from tlpsim.scenarios.compare_figures import typeset

    height = 0.24 * len(found.parameters) + 0.9
    figure = Figure(figsize=(14.0, 4 * height + 0.8), layout="constrained", dpi=110)
    for axes, name in zip(figure.subplots(4, 3).ravel(), PANELS, strict=True):
        place = tuple(STATISTICS).index(name)
        bars: dict[str, list[tuple[str, float]]] = {}
        for change in found.changes:
            bars.setdefault(change.parameter, []).append((change.label, 100.0 * found.relative(change)[place]))
        sizes = {key: max((abs(v) for _, v in pairs if np.isfinite(v)), default=0.0) for key, pairs in bars.items()}
        order = sorted(bars, key=sizes.__getitem__)
        for row, key in enumerate(order):
            # The longer bar first, so that two of one sign are both seen.
            for label, value in sorted(bars[key], key=lambda pair: -abs(np.nan_to_num(pair[1]))):
                if np.isfinite(value):
                    axes.barh(row, value, height=0.66, color=_COLOURS[label[0]], zorder=2)
                else:
                    axes.text(0.0, row, " ?", va="center", ha="left" if label[0] == "+" else "right", fontsize=8)
        axes.set_yticks(range(len(order)), [short_name(key) for key in order], fontsize=8)
        axes.axvline(0.0, color="0.3", linewidth=0.8, zorder=3)
        base, unit = found.base[place], STATISTICS[name][0]
        axes.set_title(f"{_title(name)}: {number(base)}{' × ' if unit[0] == '1' else ' '}{typeset(unit)}", fontsize=10)
        axes.set_xlabel("change, %", fontsize=8)
        axes.tick_params(axis="x", labelsize=8)
        axes.grid(True, axis="x", color="0.88", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    handles = [
        Patch(color=colour, label=" or ".join(dict.fromkeys(c.label for c in found.changes if c.label[0] == sign)))
        for sign, colour in _COLOURS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(f"Sensitivity of the response: {found.scenario.title}", fontsize=13)
    return figure


def _title(name: str) -> str:
    """`surge LF` in words."""
    words = {"LF": "low-frequency std", "WF": "wave-frequency std", "max": "expected maximum"}
    what, _, statistic = name.partition(" ")
    return f"{what}, {words.get(statistic, statistic)}"
