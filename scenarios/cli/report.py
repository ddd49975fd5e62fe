"""The command `tlpsim report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.terminal import say

SUMMARY = ".parquet"
"""Suffix of a sweep's summary, which stands for its folder."""


def report(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="RESULTS...", help="Results files (HDF5) of `tlpsim run`, or the folder of a sweep."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="Page (HTML).")],
    signal: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Signals shown at first, as platform.velocity.*; may be given again."),
    ] = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="S", help="Beginning of statistics, in s or with a unit: 20min.")
    ] = None,
    show: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
) -> None:
    """Make a page of results: figures, statistics, extremes, checks; a single file that needs no network.

    Records of one scenario from other seeds are taken together; other scenarios stand side by side. The page of a sweep
    has its linked figures.
    """
    with interruptible(lambda: "nothing was written"):
        if any(file.is_dir() or file.suffix == SUMMARY for file in files):
            size = _sweep_report(files, output, signal, start)
        else:
            from tlpsim.scenarios.report.writing import write_report

            size = write_report(files, output, start=start, signals=signal or [])
    say(f"report: {output} ({size / 1e6:.1f} MB)")
    if show:
        import webbrowser

        webbrowser.open(output.resolve().as_uri())


def _sweep_report(files: list[Path], output: Path, signal: list[str] | None, start: str | None) -> int:
    from tlpsim.loads.errors import ScenarioError
    from tlpsim.loads.whole_file import require_writable
    from tlpsim.scenarios.sweep.outlook import outlook
    from tlpsim.scenarios.sweep.page import write_sweep_report
    from tlpsim.scenarios.sweep.table import read_table

    if len(files) > 1:
        raise ScenarioError("report: the page of a sweep is of one sweep: give its folder alone")
    if signal or start is not None:
        raise ScenarioError(
            "report: --signal and --from are for results of runs; a sweep's file has its own [statistics]"
        )
    require_writable(output)
    table = read_table(files[0])
    return write_sweep_report(table, outlook(table), output)
