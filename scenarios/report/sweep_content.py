"""What the page of a sweep shows, as data: what governs, what needs a look, and the linked figures of all its jobs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tlpsim.scenarios.report.document import (
    Block,
    Chart,
    Checks,
    Document,
    Facts,
    Row,
    Section,
    Table,
    Text,
)
from tlpsim.scenarios.report.sweep_data import DOMAINS, Sweep, levels, packed_sweep, sweep
from tlpsim.scenarios.report.sweep_head import (
    COMPLETE,
    alternative_blocks,
    counted,
    findings,
    governing_cards,
    status_text,
)
from tlpsim.scenarios.report.sweep_long_term import (
    FatigueFigures,
    LongTermFigures,
    governing_extremes,
    governing_fact,
    long_term_blocks,
)
from tlpsim.scenarios.report.sweep_words import (
    key_labels,
    key_unit,
    value_text,
)
from tlpsim.scenarios.report.words import UNKNOWN, seconds

if TYPE_CHECKING:
    from tlpsim.scenarios.sweep.table import SweepTable

_MOST_FAILED = 200  # rows of the table
_MOST_LEVELS = 12  # written out of a key


def sweep_document(
    table: SweepTable,
    long_term: Sequence[LongTermFigures] = (),
    fatigue: Sequence[FatigueFigures] = (),
) -> Document:
    """The report of a sweep.

    Parameters
    ----------
    table
        With a row a finished or failed job; without rows the page says so.
    long_term, fatigue
        Long-term results, in the order in which they are shown.
    """
    found = sweep(table)
    text = _case_texts(found)
    status = status_text(found)
    sections = (
        *_linked(found),
        Section(
            anchor="long-term",
            title="Long-term",
            blocks=tuple(long_term_blocks(long_term, fatigue, text, len(table.variants))),
        ),
        Section(anchor="failed", title="Failed jobs", blocks=tuple(_failed(found))),
        Section(anchor="settings", title="What was varied", blocks=tuple(_settings(found))),
    )
    return Document(
        kind="report of a sweep",
        title=table.title,
        subtitle=_subtitle(found),
        status=status,
        complete=status == COMPLETE,
        head=tuple(_head(found, long_term, text)),
        sections=sections,
    )


def _subtitle(found: Sweep) -> str:
    """How many jobs of how many cases, in which domains, and their lengths."""
    cases = len(np.unique(found.cases))
    parts = [counted(found.rows, "job"), counted(cases, "case")]
    if len(found.table.variants) > 1:
        parts.append(counted(len(found.table.variants), "variant"))
    for number, domain in enumerate(DOMAINS):
        rows = np.flatnonzero(found.domain == number)
        if len(rows):
            replicates = len(np.unique(found.table.columns["replicate"][rows]))
            parts.append(f"{domain} domain" + (f" with {replicates} replicates" if replicates > 1 else ""))
    if np.any(found.domain == 1):
        parts.append(f"records of {seconds(found.table.duration)}")
    return ", ".join(parts) + f"; extremes of {seconds(found.table.exposure)}"


def _case_texts(found: Sweep) -> Callable[[int, int], str]:
    """What is said of a case, by its variant and number."""
    columns = found.table.columns
    rows = {
        (int(variant), int(case)): row
        for row, (variant, case) in enumerate(zip(columns["variant"], columns["case"], strict=True))
    }

    def text(variant: int, case: int) -> str:
        row = rows.get((variant, case))
        settings = "" if row is None else found.settings(row)
        return f"case {case}" + (f", {settings}" if settings else "")

    return text


# The head


def _head(found: Sweep, long_term: Sequence[LongTermFigures], text: Callable[[int, int], str]) -> list[Block]:
    blocks: list[Block] = []
    cards = [
        *governing_cards(found),
        *(governing_fact(each, text, len(found.table.variants)) for each in governing_extremes(long_term)),
    ]
    if cards:
        blocks.append(Facts(entries=tuple(cards), large=True))
    blocks += alternative_blocks(found)
    blocks.append(Checks(entries=tuple(findings(found))))
    if found.values:
        blocks.append(Chart(kind="sweep", title="", content=packed_sweep(found)))
    elif not found.done.any():
        blocks.append(Text(text="No job has ended well: there is nothing to show."))
    return blocks


# The linked figures


def _linked(found: Sweep) -> list[Section]:
    """Sections of the figures that are linked, those for which the table has something."""
    if not found.values:
        return []
    numbers = [key for key in found.varied if not isinstance(levels(found.table.columns[key])[0][0], str)]
    both = bool(set(found.cases[found.domain == 0]) & set(found.cases[found.domain == 1]))
    cells = Chart(
        kind="sweep_cells",
        title="Over two settings",
        content={},
        caption=(
            "Each cell is the worst of its cases, each of which is the mean over its replicates. The worst is the "
            "largest, of minima the lowest, of means and of extremes ± (maximum or minimum, whichever is larger in "
            "magnitude) the largest in magnitude. A cross marks cells with failed jobs and no value. Click or drag to "
            "select cells, with Shift to add more; arrow keys and Enter do so too."
        ),
    )
    scatter = Chart(
        kind="sweep_scatter",
        title="Against a setting",
        content={"x": next((k for k in numbers if k.endswith("heading_deg")), "")},
        caption=(
            "A point is a job; lines join the worst of each colour, where the colour is a setting of a few values. "
            "Drag over points to select them, click one to select its case. A heading is the direction of "
            "propagation, counter-clockwise from x."
        ),
    )
    parallel = Chart(
        kind="sweep_parallel",
        title="All settings and responses",
        content={},
        caption=(
            "A line is a job. Drag along an axis to keep the jobs within (Shift for a further range), drag a name to "
            "move its axis, double-click an axis to clear it; the fields below do the same from the keyboard."
        ),
    )
    domains = Chart(
        kind="sweep_domains",
        title="Time against frequency domain",
        content={},
        caption=(
            "A point is a case: the mean over its replicates, with a bar from the lowest to the highest. The solid "
            "line is 1:1, the dashed lines are 10 % off. Maxima of records are compared with what is expected of them."
        ),
    )
    worst = Chart(
        kind="sweep_worst", title="Worst jobs", content={}, caption="Headings sort; a number selects its job."
    )
    return [
        Section(anchor="map", title="Response map", blocks=(cells,) if len(found.varied) > 1 else ()),
        Section(anchor="trend", title="Response against a setting", blocks=(scatter,) if found.varied else ()),
        Section(anchor="parallel", title="All together", blocks=(parallel,)),
        Section(anchor="domains", title="Time and frequency domain", blocks=(domains,) if both else ()),
        Section(anchor="worst", title="Worst cases", blocks=(worst,)),
    ]


# Tables


def _failed(found: Sweep) -> list[Block]:
    """Failed jobs with what their errors say."""
    columns = found.table.columns
    rows = np.flatnonzero(~found.done)
    if not len(rows):
        return []
    replicates = len(np.unique(columns["replicate"])) > 1
    several = len(found.table.variants) > 1
    lines = []
    for row in rows[:_MOST_FAILED].tolist():
        job = [str(int(columns["variant"][row]) + 1)] if several else []
        job += [str(columns["domain"][row])]
        job += [str(int(columns["replicate"][row]))] if replicates else []
        words = (found.settings(row) or UNKNOWN, str(columns["error"][row]) or UNKNOWN)
        lines.append(Row(heading=str(int(columns["case"][row])), cells=(*job, *words)))
    headings = ["case", *(["variant"] if several else []), "domain", *(["replicate"] if replicates else [])]
    texts = tuple(range(int(several), len(headings) + 1))
    note = f"The first {_MOST_FAILED} of {len(rows)}; the table has all." if len(rows) > _MOST_FAILED else ""
    table = Table(
        caption="Jobs without results",
        headings=(*headings, "settings", "error"),
        rows=tuple(lines),
        note=note,
        text_columns=texts,
    )
    return [table]


def _settings(found: Sweep) -> list[Block]:
    """Keys with their values, and the design alternatives."""
    blocks: list[Block] = []
    labels = key_labels(found.table.keys)
    rows = []
    for key in found.table.keys:
        different, _ = levels(found.table.columns[key])
        unit = key_unit(key)
        shown = [value_text(value) for value in different[:_MOST_LEVELS]]
        if len(different) > _MOST_LEVELS:
            shown = [*shown[:4], "…", value_text(different[-1])]
        rows.append(Row(heading=labels[key], cells=(key, str(len(different)), ", ".join(shown), unit)))
    if rows:
        headings = ("setting", "key", "values", "which", "unit")
        blocks.append(Table(caption="Settings", headings=headings, rows=tuple(rows), text_columns=(0, 2, 3)))
    return [*blocks, *(Text(text=note, small=True) for note in found.table.notes)]
