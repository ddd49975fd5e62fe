"""The command `tlpsim report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.terminal import say


def report(
    files: Annotated[list[Path], typer.Argument(metavar="RESULTS...", help="Results files (HDF5) of `tlpsim run`.")],
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

    Records of one scenario from other seeds are taken together; other scenarios stand side by side.
    """
    from tlpsim.scenarios.report.writing import write_report

    with interruptible(lambda: "nothing was written"):
        size = write_report(files, output, start=start, signals=signal or [])
    say(f"report: {output} ({size / 1e6:.1f} MB)")
    if show:
        import webbrowser

        webbrowser.open(output.resolve().as_uri())
