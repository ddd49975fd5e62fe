"""What the report of results shows, as data: head, findings, figures and tables, in their order."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tlpsim.scenarios.report.analysis import POSITIONS, Analysis, analysed, recorded, samples, tensions
from tlpsim.scenarios.report.cases import Case, cases
from tlpsim.scenarios.report.document import Block, Checks, Document, Facts, Fold, Row, Section, Table, Text
from tlpsim.scenarios.report.extremes import exceedance_chart, key_figures, tendon_blocks
from tlpsim.scenarios.report.loads import load_blocks
from tlpsim.scenarios.report.processes import process_blocks
from tlpsim.scenarios.report.response import summary_blocks
from tlpsim.scenarios.report.running import (
    coupling_blocks,
    largest_coupling_errors,
    origin_blocks,
    records_of,
    share,
    simulated,
    speed_of,
    timing_blocks,
)
from tlpsim.scenarios.report.scene import scene_content
from tlpsim.scenarios.report.series import series_chart
from tlpsim.scenarios.report.setting import setting_blocks, setting_facts
from tlpsim.scenarios.report.spectra import spectra_blocks
from tlpsim.scenarios.report.track import track_blocks
from tlpsim.scenarios.report.words import UNKNOWN, listed, seconds, short, typeset
from tlpsim.scenarios.results import Results

LARGEST_DEVIATION = 0.1
"""Of standard deviations of the two domains, beyond which the report asks for a look"""

_OPEN_ENDS = {"running": "the run goes on, or was killed"}


def report_document(results: Sequence[Results], start: float | None = None, wanted: Sequence[str] = ()) -> Document:
    """The report of one or more results.

    Parameters
    ----------
    results
        Records of one case, which are taken together, or of several, which stand side by side.
    start
        Time before which samples are left out of statistics, s; the scenario's ``outputs.statistics_from`` without it.
    wanted
        Patterns of the signals whose time series are shown at first.

    Raises
    ------
    ResultsError
        When a file is given twice, or a run holds no samples.
    ScenarioError
        When a pattern matches no signal.
    """
    found = cases(results)
    analyses = [analysed(case, start) for case in found]
    series = series_chart(analyses, wanted)
    processes, trusted = process_blocks(analyses)
    scenes = ((label, scene_content(each)) for label, each in records_of(found))
    which, scene = next(((label, content) for label, content in scenes if content is not None), ("", None))
    sections = (
        Section(anchor="summary", title="Response", blocks=tuple(_response_blocks(analyses))),
        Section(anchor="series", title="Time series", blocks=(series,)),
        Section(anchor="track", title="Track", blocks=tuple(track_blocks(analyses))),
        Section(anchor="spectra", title="Spectra", blocks=tuple(spectra_blocks(analyses))),
        Section(anchor="loads", title="Loads", blocks=tuple(load_blocks(analyses))),
        Section(anchor="tendons", title="Tendons", blocks=tuple(tendon_blocks(analyses))),
        Section(anchor="processes", title="Wind and waves as made", blocks=tuple(processes)),
        Section(anchor="coupling", title="Coupling", blocks=tuple(coupling_blocks(found))),
        Section(anchor="timing", title="Timing", blocks=tuple(timing_blocks(found))),
        Section(anchor="scenario", title="Scenario", blocks=tuple(setting_blocks(found))),
        Section(anchor="origin", title="Origin", blocks=tuple(origin_blocks(found))),
    )
    return Document(
        title=listed(list(dict.fromkeys(each.title for each in results))),
        subtitle=_subtitle(found),
        status=_status(results),
        complete=all(each.complete for each in results),
        head=tuple(_head(analyses, trusted)),
        sections=sections,
        scene=scene,
        scene_of=which if len(results) > 1 else "",
    )


def _subtitle(found: Sequence[Case]) -> str:
    """How many records of how many cases, and of when."""
    results = [each for case in found for each in case.results]
    days = list(dict.fromkeys(str(each.attributes.get("created", ""))[:10] for each in results))
    count = "one record" if len(results) == 1 else f"{len(results)} records"
    kinds = "" if len(found) == 1 else f", {len(found)} cases"
    lengths = list(dict.fromkeys(seconds(simulated(each)) for each in results))
    names = f": {'; '.join(case.label for case in found)}" if len(found) > 1 else ""
    return f"{count} of {listed(lengths)}{kinds}, made on {listed(days)}{names}"


def _status(results: Sequence[Results]) -> str:
    """ "complete", or which records are not, and what their files say."""
    open_ends = [each for each in results if not each.complete]
    if not open_ends:
        return "complete"
    return "incomplete: " + "; ".join(
        f"{each.path.name} ends at {seconds(simulated(each))}, {_OPEN_ENDS.get(each.status, each.status)}"
        for each in open_ends
    )


def _head(analyses: Sequence[Analysis], trusted: bool | None) -> list[Block]:
    """Setting, findings and largest values."""
    blocks: list[Block] = []
    first = analyses[0].case.scenario
    if first is not None and len(analyses) == 1:
        blocks.append(setting_facts(first))
    for each in analyses:
        figures = key_figures(each)
        if figures:
            blocks += [Text(text=f"{each.case.label}:")] if len(analyses) > 1 else []
            blocks.append(Facts(entries=tuple(figures), large=True))
    blocks.append(Checks(entries=tuple(_checks(analyses, trusted))))
    return blocks


def _checks(analyses: Sequence[Analysis], trusted: bool | None) -> list[tuple[bool | None, str, str]]:
    """Findings: whether it is good (None where it cannot be told), what was looked at, what was found."""
    results = [each for analysis in analyses for each in analysis.case.results]
    found: list[tuple[bool | None, str, str]] = [(all(e.complete for e in results), "Run", _status(results))]
    for each in analyses:
        which = f" ({each.case.label})" if len(analyses) > 1 else ""
        found += [(good, f"{what}{which}", text) for good, what, text in (*_slack(each), *_domains(each))]
    if trusted is not None:
        text = (
            "meet their spectra within the limits of their certificates" if trusted else "miss their spectra, see below"
        )
        found.append((trusted, "Digital filters", text))
    errors = [f"{share(error)} {where}" for error, where in largest_coupling_errors([a.case for a in analyses])]
    if errors:
        found.append((None, "Coupling", f"largest measured errors, of a standard deviation: {'; '.join(errors)}"))
    speeds = [speed for each in results if (speed := speed_of(each))]
    if len(speeds) == 1:
        found.append((None, "Speed", speeds[0]))
    return found


def _slack(analysis: Analysis) -> list[tuple[bool | None, str, str]]:
    """Whether a tendon lost its tension, at the anchor where that was recorded."""
    names = recorded(analysis.case.results[0])
    chosen = tensions(names, bottom=True) or tensions(names)
    if not chosen:
        return []
    slack = []
    for tendon, name in chosen.items():
        values = [samples(each, name, analysis.start)[1] for each in analysis.case.results if name in recorded(each)]
        if any(len(each) and np.nanmin(each) <= 0.0 for each in values):
            slack.append(tendon)
    if slack:
        return [(False, "Tendons", f"without tension at times, or lost: {listed(slack)}")]
    return [(True, "Tendons", "none goes slack")]


def _domains(analysis: Analysis) -> list[tuple[bool | None, str, str]]:
    """Whether the standard deviations of both domains agree."""
    if analysis.response is None or not analysis.statistics:
        return []
    worst, beyond, known = (0.0, ""), [], True
    for name in POSITIONS:
        found, expected = analysis.statistics.get(name), analysis.expected(name)
        if found is None or expected is None or not found.std.value > 0.0:
            continue
        factor, degree = analysis.factor(name), name.rpartition(".")[2]
        deviation = abs(expected.std / (factor * found.std.value) - 1.0)
        worst = max(worst, (deviation, degree))
        # Where the record does not know its own spread, a deviation says nothing of the domains.
        known = known and math.isfinite(found.std.low)
        outside = not factor * found.std.low <= expected.std <= factor * found.std.high
        if deviation > LARGEST_DEVIATION and outside:
            beyond.append(degree)
    text = f"standard deviations of the motions differ by at most {100.0 * worst[0]:.1f} % ({worst[1]})"
    if not known:
        return [(None, "Both domains", f"{text}; the record is too short to tell its own interval")]
    if beyond:
        return [(False, "Both domains", f"{text}; beyond the record's own interval: {listed(beyond)}")]
    within = "" if worst[0] <= LARGEST_DEVIATION else ", within the record's own interval"
    return [(True, "Both domains", f"{text}{within}")]


def _response_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    blocks = summary_blocks(analyses) if any(each.case.scenario is not None for each in analyses) else []
    names = {n: n.rpartition(".")[2] for n in POSITIONS if any(n in each.statistics for each in analyses)}
    chart = exceedance_chart(analyses, names, "motions")
    blocks += [chart] if chart else []
    bare = [each for each in analyses if not each.statistics]
    for each in bare:
        table = _outputs(each)
        plain = each.case.scenario is None
        blocks.append(table if plain else Fold(summary=f"All signals: {each.case.label}", blocks=(table,)))
    return blocks


def _outputs(analysis: Analysis) -> Table:
    """Mean, extremes and standard deviation of every output over the whole of its record."""
    rows = []
    for results in analysis.case.results:
        for name in recorded(results):
            values = results.signal(name)
            known = values[np.isfinite(values)]
            found = (known.mean(), known.std(), known.min(), known.max()) if len(known) else ()
            cells = [short(float(value), 6) for value in found] or [UNKNOWN] * 4
            rows.append(Row(heading=name, cells=(*cells, typeset(results.unit(name)))))
    headings = ("output", "mean", "std", "minimum", "maximum", "unit")
    which = f"All outputs over the whole record: {analysis.case.label}"
    return Table(caption=which, headings=headings, rows=tuple(rows), text_columns=(4,))
