"""The command `tlpsim statistics`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.cli.options import Json, print_json
from tlpsim.scenarios.terminal import say


def statistics(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS...",
            help="Results file (.h5, or .h5.part of a run that goes on), or the records of a case.",
        ),
    ],
    signals: Annotated[
        list[str] | None,
        typer.Option(
            "--signal",
            metavar="PATTERN",
            help="Signal or pattern, as in 'wave.force.*'; may be given again. Positions and tensions without it.",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="S", help="Time before which samples are left out; the scenario's own without it."
        ),
    ] = None,
    exposure: Annotated[str, typer.Option("--exposure", metavar="S", help="Duration for expected extremes.")] = "3h",
    slope: Annotated[
        float, typer.Option("--slope", metavar="M", help="Slope of the S-N curve for damage-equivalent ranges.")
    ] = 4.0,
    json: Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="All statistics, .csv or .json.")
    ] = None,
) -> None:
    """Evaluate a record, or several of one case: spreads, distributions, extremes, fatigue, with 95 % intervals.

    Several results files are taken as records of one case, whose scenarios differ in their seeds alone.
    """
    with interruptible(lambda: "nothing was written"):
        from tlpsim.scenarios.generic import seconds
        from tlpsim.scenarios.results import open_results
        from tlpsim.scenarios.statistics.output import (
            print_statistics,
            require_output,
            statistics_content,
            study,
            write_statistics,
        )
        from tlpsim.scenarios.statistics.signals import CONFIDENCE, run_statistics

        if output is not None:
            require_output(output)
        require_writable(output)
        begin = None if start is None else seconds(start, "--from")
        length = seconds(exposure, "--exposure")
        opened = [open_results(each) for each in results]
        made = run_statistics(opened, signals, start=begin, exposure=length, slope=slope, confidence=CONFIDENCE)
        found = study(opened, made, length, slope, CONFIDENCE)
        if output is not None:
            write_statistics(found, output)
    if json:
        print_json(statistics_content(found))
    else:
        print_statistics(found)
    if output is not None:
        say(f"statistics: {output}", aside=json)
