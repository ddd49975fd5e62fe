"""The command `tlpsim`: what commands there are, the options of all of them, and how errors and warnings are shown.

Heavy imports stand inside the commands, so that `tlpsim --help` answers at once.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from tlpsim.scenarios.cli import figures, hydro, report, run, schema, spectral, statistics, sweep, system
from tlpsim.scenarios.cli.endings import ended_by, last_words
from tlpsim.scenarios.cli.options import show_warning
from tlpsim.scenarios.interruption import interrupts_told
from tlpsim.scenarios.terminal import hush, unhush

COMMANDS: Mapping[str, tuple[Callable[..., None], ...]] = {
    "Run": (run.run, run.resume, sweep.sweep),
    "Frequency domain": (spectral.spectral, spectral.compare, spectral.sensitivity),
    "Look at results": (system.info, statistics.statistics, figures.figures, report.report),
    "Check and swap": (system.check, system.swap),
    "Prepare": (system.build, hydro.bem, system.export, schema.schema),
}
"""Commands in the order of the help, by its panels."""


class Commands(TyperGroup):
    """All commands; Ctrl-C and SIGTERM end them with exit codes of their own wherever they are."""

    def invoke(self, context: Any) -> Any:
        """See above."""
        try:
            return super().invoke(context)
        except KeyboardInterrupt as reason:
            raise typer.Exit(last_words(reason)) from None


class Command(TyperCommand):
    """A command that takes --quiet after its name, too."""

    def get_params(self, context: Any) -> list[Any]:
        """Parameters of its own, --quiet of the whole, and --help."""
        *own, helping = super().get_params(context)
        return [*own, *(each for each in context.find_root().command.params if each.name == "quiet"), helping]


def _quiet(context: typer.Context, wanted: bool) -> None:
    if wanted:
        hush()
        context.call_on_close(unhush)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"tlpsim {version('tlpsim')}")
        raise typer.Exit


def tlpsim(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    quiet: Annotated[
        bool,
        typer.Option(
            "--quiet",
            "-q",
            callback=_quiet,
            expose_value=False,
            help="Show no progress, tables and notes; only warnings and errors.",
        ),
    ] = False,
) -> None:
    """Co-simulation of tension leg platforms in wind, waves and current as a system of FMUs."""


app = typer.Typer(
    name="tlpsim",
    cls=Commands,
    callback=tlpsim,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    epilog="Exit codes: 0 done, 1 the answer is no, 2 bad input or a run that failed, 130 and 143 interrupted.",
)
for panel, commands in COMMANDS.items():
    for command in commands:
        app.command(cls=Command, rich_help_panel=panel)(command)


def _interrupt(reason: KeyboardInterrupt) -> None:
    raise reason


def main() -> None:
    """Entry point: a warning is one line, and so is an error; see `tlpsim.scenarios.cli.endings` for exit codes."""
    warnings.showwarning = show_warning
    with interrupts_told(_interrupt):
        try:
            app()
        except SystemExit as end:
            code = ended_by(end)
        except BaseException as error:
            code = last_words(error)
    sys.exit(code)
