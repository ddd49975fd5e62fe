"""The command `tlpsim sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.scenarios.cli.endings import ExitCode, interruptible
from tlpsim.scenarios.cli.options import Json, Settings, print_json
from tlpsim.scenarios.cli.spectral import Workers
from tlpsim.scenarios.terminal import say

if TYPE_CHECKING:
    from tlpsim.scenarios.sweep.outlook import Outlook
    from tlpsim.scenarios.sweep.plan import Sweep
    from tlpsim.scenarios.sweep.table import SweepTable


def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="Sweep file (TOML).")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Folder of the sweep; one that a sweep left goes on."),
    ] = None,
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="A running Dask cluster, as tcp://10.0.0.1:8786."),
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Do failed jobs again.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the plan, and do nothing.")] = False,
    settings: Settings = None,
    json: Json = False,
) -> None:
    """Run many cases: scatter diagrams, grids, lists and samples, in either domain, on all cores or a Dask cluster.

    A sweep that was interrupted or killed goes on by the same command. Ends with exit code 1 where jobs failed.
    """
    done, total = 0, 0

    def remains() -> str:
        return f"{done} of {total} jobs are done and kept: the same command goes on" if total else "nothing was done"

    with interruptible(remains):
        from tlpsim.loads.errors import ScenarioError
        from tlpsim.scenarios.sweep.plan import Sweep

        chosen = Sweep.load(file, settings or [])
        if dry_run:
            _show_plan(chosen, json)
            return
        if output is None:
            raise ScenarioError("sweep: give a folder for its results: -o DIR, or --dry-run for the plan only")
        from tlpsim.scenarios.progress import progress_shown
        from tlpsim.scenarios.sweep.execution import run_sweep
        from tlpsim.scenarios.sweep.outlook import outlook
        from tlpsim.scenarios.sweep.page import NAME as PAGE
        from tlpsim.scenarios.sweep.page import write_sweep_report
        from tlpsim.scenarios.sweep.table import NAME as SUMMARY

        with progress_shown("starting workers") as show:

            def tell(now: int, of: int, failed: int) -> None:
                nonlocal done, total
                done, total = now, of
                show(now, of, f"{now} of {of} jobs" + (f", {failed} failed" if failed else ""))

            table = run_sweep(
                chosen, output, workers=workers, scheduler=scheduler, retry_failed=retry_failed, progress=tell
            )
        found = outlook(table)
        size = write_sweep_report(table, found, output / PAGE)
    _show(table, found, json)
    say(f"summary: {output / SUMMARY}", aside=json)
    say(f"report: {output / PAGE} ({size / 1e6:.1f} MB)", aside=json)
    if table.failed:
        raise typer.Exit(ExitCode.NO)


def _show_plan(chosen: Sweep, json: bool) -> None:
    plan = chosen.plan()
    if json:
        from tlpsim.scenarios.sweep.content import plan_content

        print_json(plan_content(chosen, plan))
    else:
        from tlpsim.scenarios.sweep.console import print_plan

        print_plan(chosen, plan)


def _show(table: SweepTable, found: Outlook, json: bool) -> None:
    if json:
        from tlpsim.scenarios.sweep.content import sweep_content

        print_json(sweep_content(table, found))
    else:
        from tlpsim.scenarios.sweep.console import print_sweep

        print_sweep(table, found)


def show_sweep(path: Path, json: bool) -> None:
    """Print what a sweep came to, from its folder or its summary.

    Raises
    ------
    ResultsError
        When there is none.
    """
    from tlpsim.scenarios.sweep.outlook import outlook
    from tlpsim.scenarios.sweep.table import read_table

    table = read_table(path)
    _show(table, outlook(table), json)
