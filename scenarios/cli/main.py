"""The command `tlpsim`: what commands there are, and how errors and warnings are shown.

Heavy imports stand inside the commands, so that `tlpsim --help` answers at once.
"""

from __future__ import annotations

import sys
import warnings

import typer

from tlpsim.loads.errors import TlpsimError
from tlpsim.scenarios.cli import figures, hydro, run, spectral, system
from tlpsim.scenarios.cli.options import show_warning

app = typer.Typer(
    name="tlpsim",
    help="Co-simulation of tension leg platforms in wind, waves and current as a system of FMUs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (
    system.build,
    run.run,
    run.resume,
    spectral.spectral,
    spectral.compare,
    spectral.sensitivity,
    system.export,
    system.check,
    system.swap,
    hydro.bem,
    system.info,
    figures.figures,
):
    app.command()(command)


def main() -> None:
    """Entry point: a warning is one line, and so is an error that tlpsim raised on purpose, with exit code 2."""
    warnings.showwarning = show_warning
    try:
        app()
    except TlpsimError as error:
        typer.echo(f"tlpsim: error: {error}", err=True)
        sys.exit(2)
