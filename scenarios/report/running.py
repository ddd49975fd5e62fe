"""How the run went: what the components took, what the coupling cost, and what it was made with."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.coupling_report import ConnectionMeasure
from tlpsim.scenarios.report.cases import Case
from tlpsim.scenarios.report.document import Block, Cell, Fold, Row, Table, Text
from tlpsim.scenarios.report.words import UNKNOWN, seconds, short
from tlpsim.scenarios.results import Results

_COUPLING_NOTE = (
    "Root mean square error relative to the standard deviation of the signal. Between samples: each from its "
    "neighbours by the connection's filter, hence the error at twice the step. Beyond: each from those one horizon "
    "earlier; eqs. (1) and (2) of tlpsim.orchestrator.coupling_report, docs/coupling.md. Of the six degrees of freedom "
    "the worst is shown."
)
_SHORT_HASH = 12


def records_of(cases: Sequence[Case]) -> list[tuple[str, Results]]:
    """All records with what tells them apart."""
    found = []
    for case in cases:
        for label, results in zip(case.records, case.results, strict=True):
            alone = len(case.results) == 1
            found.append((case.label if alone else label if len(cases) == 1 else f"{case.label}, {label}", results))
    return found


def timing_blocks(cases: Sequence[Case]) -> list[Block]:
    """Steps, wall time and share of each component, and the speed of each record."""
    rows = []
    records = records_of(cases)
    for label, results in records:
        total = float(results.attributes.get("wall_time", math.nan))
        named = label if len(records) > 1 else ""
        for position, (name, attributes) in enumerate(results.components.items()):
            wall = float(attributes.get("wall_time", math.nan))
            share = wall / total if total > 0.0 else math.nan
            cells = (
                short(float(attributes.get("step", math.nan))),
                f"{int(attributes['steps']):,}".replace(",", "\u202f") if "steps" in attributes else UNKNOWN,
                short(wall),
                Cell(text=_percent(share), share=share if math.isfinite(share) else -1.0),
                short(1e6 * wall / int(attributes["steps"])) if attributes.get("steps") else UNKNOWN,
            )
            rows.append(
                Row(heading=Cell(text=name, below=named if position == 0 else ""), cells=cells, lead=position == 0)
            )
        spent = sum(float(a.get("wall_time", math.nan)) for a in results.components.values())
        rest = max(total - spent, 0.0)
        if math.isfinite(rest):
            share = rest / total
            cells = ("", "", short(rest), Cell(text=_percent(share), share=share), "")
            rows.append(Row(heading="master, coupling, recording", cells=cells))
    if not rows:
        return []
    headings = ("component", "step, s", "steps", "wall time, s", "share", "µs a step")
    note = "Wall time of the run itself, without loading the FMUs and fitting the filters."
    table = Table(caption="Time by component", headings=headings, rows=tuple(rows), note=note)
    return [*(Text(text=f"{label}: {speed}.") for label, r in records if (speed := speed_of(r))), table]


def speed_of(results: Results) -> str:
    """Simulated and wall time of a record and their ratio, "" where it is not known."""
    total = float(results.attributes.get("wall_time", math.nan))
    duration = simulated(results)
    if not total > 0.0 or not duration > 0.0:
        return ""
    return f"{seconds(duration)} in {short(total)} s of wall time, {short(duration / total)} × real time"


def simulated(results: Results) -> float:
    """Simulated time that a record holds, s; that of the component that came farthest."""
    spans = [time[-1] - time[0] for name in results.components if len(time := results.time(name))]
    return float(max(spans, default=0.0))


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else UNKNOWN


def coupling_blocks(cases: Sequence[Case]) -> list[Block]:
    """Measured errors of the connections, six degrees of freedom together, of the first record of each case."""
    blocks: list[Block] = []
    for case in cases:
        measures = [each for each in case.results[0].coupling if each.samples]
        if not measures:
            continue
        which = f": {case.label}, {case.records[0]}" if len(cases) > 1 or len(case.results) > 1 else ""
        rows = [_grouped(name, group) for name, group in _groups(measures).items()]
        headings = ("connection", "samples", "between samples", "beyond samples")
        caption = f"Errors of the coupling, measured{which}"
        blocks.append(Table(caption=caption, headings=headings, rows=tuple(rows), note=_COUPLING_NOTE))
        single = tuple(
            Row(
                heading=each.connection,
                cells=(
                    f"{each.samples}",
                    short(each.deviation),
                    share(each.interpolation),
                    share(each.extrapolation),
                ),
            )
            for each in measures
        )
        every = Table(
            caption=f"Each connection{which}", headings=(headings[0], "samples", "std", *headings[2:]), rows=single
        )
        blocks.append(Fold(summary="Each connection", blocks=(every,)))
    return blocks


def _groups(measures: Sequence[ConnectionMeasure]) -> dict[str, list[tuple[str, ConnectionMeasure]]]:
    """Measures by the connection's name with * for the degree of freedom, each with its degree."""
    found: dict[str, list[tuple[str, ConnectionMeasure]]] = {}
    for each in measures:
        degree = next((d for d in DEGREES_OF_FREEDOM if each.connection.endswith(f".{d}")), "")
        name = each.connection.replace(f".{degree}", ".*") if degree else each.connection
        found.setdefault(name, []).append((degree, each))
    return found


def _grouped(name: str, group: Sequence[tuple[str, ConnectionMeasure]]) -> Row:
    cells: list[str | Cell] = [f"{max(each.samples for _, each in group)}"]
    for column in ("interpolation", "extrapolation"):
        known = [(getattr(each, column), degree) for degree, each in group if math.isfinite(getattr(each, column))]
        worst, degree = max(known, default=(math.nan, ""))
        cells.append(Cell(text=share(worst), below=degree if len(known) > 1 else ""))
    heading = group[0][1].connection if len(group) == 1 else name
    return Row(heading=heading.replace("->", "→"), cells=tuple(cells))


def share(value: float) -> str:
    """A part of one as percentage with two figures."""
    return f"{short(100.0 * value, 2)} %" if math.isfinite(value) else UNKNOWN


def largest_coupling_errors(cases: Sequence[Case]) -> list[tuple[float, str]]:
    """Largest measured error, between or beyond samples, of what goes to the platform and of what comes from it.

    Each is of one connection, which is told with it. Where there is no component "platform", it is the largest of all.
    """
    found: dict[bool, tuple[float, str]] = {}
    for measure in (each for case in cases for results in case.results for each in results.coupling):
        to_platform = measure.connection.partition(" -> ")[2].startswith("platform.")
        for value in (measure.interpolation, measure.extrapolation):
            if measure.samples and math.isfinite(value):
                found[to_platform] = max(found.get(to_platform, (0.0, "")), (value, measure.connection))
    return [(value, connection.replace("->", "→")) for value, connection in found.values()]


def origin_blocks(cases: Sequence[Case]) -> list[Block]:
    """Files, seeds, versions of packages, and the FMUs with their hashes."""
    records = records_of(cases)
    files = tuple(
        Row(
            heading=label,
            cells=(
                results.path.name,
                str(results.attributes.get("created", UNKNOWN)).replace("T", " "),
                ", ".join(f"{name} {seed}" for name, seed in results.seeds.items()) or UNKNOWN,
                Cell(text=results.status, tone="good" if results.complete else "attention"),
            ),
        )
        for label, results in records
    )
    headings = ("record", "file", "begun (UTC)", "seeds", "status")
    blocks: list[Block] = [Table(caption="Records", headings=headings, rows=files, text_columns=(0, 1, 2, 3))]
    fmus: dict[tuple[str, ...], Row] = {}
    for _, results in records:
        for name, attributes in results.components.items():
            source, digest = (
                str(attributes.get("fmu") or attributes.get("table") or ""),
                str(attributes.get("sha256", "")),
            )
            model = " ".join(str(attributes[key]) for key in ("model_name", "version") if attributes.get(key))
            cells = (
                Cell(text=source.replace("\\", "/").rpartition("/")[2] or UNKNOWN, hint=source),
                model or UNKNOWN,
                str(attributes.get("generation_tool", "")) or UNKNOWN,
                Cell(text=f"{digest[:_SHORT_HASH]}…" if digest else UNKNOWN, hint=digest),
            )
            fmus.setdefault((name, source, digest), Row(heading=name, cells=cells))
    headings = ("component", "FMU", "model", "made by", "SHA-256")
    blocks.append(Table(caption="Components", headings=headings, rows=tuple(fmus.values()), text_columns=(0, 1, 2, 3)))
    digests = tuple(Row(heading=name, cells=(digest,)) for name, _, digest in fmus if digest)
    if digests:
        table = Table(caption="SHA-256", headings=("component", "of the FMU"), rows=digests, text_columns=(0,))
        blocks.append(Fold(summary="Hashes in full", blocks=(table,)))
    versions = dict.fromkeys(", ".join(f"{n} {v}" for n, v in results.versions.items()) for _, results in records)
    blocks += [Text(text=f"Made with {text}.", small=True) for text in versions if text]
    return blocks
