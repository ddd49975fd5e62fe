"""The command `tlpsim`: build, run, check, info, figures.

Heavy imports stand inside the commands, so that `tlpsim --help` answers at once.
"""

from __future__ import annotations

import sys
import warnings
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.loads.errors import ScenarioError, TlpsimError

if TYPE_CHECKING:
    from tlpsim.scenarios.schema import Scenario

app = typer.Typer(
    name="tlpsim",
    help="Co-simulation of tension leg platforms in wind, waves and current as a system of FMUs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Set a key of the scenario, as in waves.significant_height=9."),
]
Duration = Annotated[str | None, typer.Option(metavar="S", help="Duration in s, or with a unit: 3h.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Seed of wind and waves.")]


@app.command()
def build(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the FMUs.")],
    bundle: Annotated[bool, typer.Option("--bundle", help="Pack the sources in, for a Python without tlpsim.")] = False,
) -> None:
    """Build wind.fmu, wave.fmu and platform.fmu."""
    from tlpsim.fmus.build import build as build_fmus

    for path in build_fmus(output, bundle=bundle):
        typer.echo(path)


@app.command()
def run(
    scenario: ScenarioFile,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="Results file (HDF5).")],
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
) -> None:
    """Run a scenario and print the response by degree of freedom."""
    from tlpsim.scenarios.console import print_summary, progress_bar
    from tlpsim.scenarios.run import run_scenario

    chosen = _load(scenario, duration, seed, settings)
    try:
        with progress_bar(chosen.simulation.duration) as progress:
            results = run_scenario(chosen, output, observers=[progress])
    except KeyboardInterrupt:
        typer.echo(f"tlpsim: interrupted; the samples so far are in {output}.part", err=True)
        raise typer.Exit(130) from None
    print_summary(results)
    typer.echo(f"results: {output}")


@app.command()
def check(scenario: ScenarioFile, duration: Duration = None, seed: Seed = None, settings: Settings = None) -> None:
    """Check a scenario, its FMUs, their parameters and wiring: all but the run itself."""
    from tlpsim.orchestrator.execution import Master
    from tlpsim.scenarios.assemble import assembled
    from tlpsim.scenarios.console import print_system

    chosen = _load(scenario, duration, seed, settings)
    with assembled(chosen) as assembly:
        Master(assembly.system).initialize()
        print_system(chosen, assembly)


@app.command()
def info(file: Annotated[Path, typer.Argument(metavar="FILE", help="An .fmu or a results .h5 file.")]) -> None:
    """Print what an FMU or a results file holds."""
    from tlpsim.scenarios.console import print_fmu, print_results

    if file.suffix == ".fmu":
        from tlpsim.orchestrator.description import read_description

        print_fmu(read_description(file))
    else:
        from tlpsim.scenarios.results import open_results

        print_results(open_results(file))


class FigureSet(StrEnum):
    """What `tlpsim figures` can draw."""

    PROCESSES = "processes"


@app.command()
def figures(
    which: Annotated[FigureSet, typer.Argument(metavar="WHICH", help="processes: spectra of wind and waves.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the PNG files.")],
    scenario: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Scenario whose wind and waves are drawn.")
    ] = None,
    settings: Settings = None,
) -> None:
    """Draw target, fitted and simulated spectra of the digital filters that make wind and waves."""
    from tlpsim.scenarios.figures import draw_processes

    if settings and scenario is None:
        raise ScenarioError("--set changes a scenario: name its file with --scenario")
    for path in draw_processes(output, _load(scenario, None, None, settings) if scenario else None):
        typer.echo(path)


def _load(path: Path, duration: str | None, seed: int | None, settings: list[str] | None) -> Scenario:
    from tlpsim.scenarios.schema import Scenario

    overrides = list(settings or [])
    if duration is not None:
        overrides.append(f"simulation.duration={duration}")
    if seed is not None:
        overrides.append(f"simulation.seed={seed}")
    return Scenario.load(path, overrides)


def _show_warning(message: Warning | str, *origin: object, **_: object) -> None:
    typer.echo(f"tlpsim: warning: {message}", err=True)


def main() -> None:
    """Entry point: a warning is one line, and so is an error that tlpsim raised on purpose, with exit code 2."""
    warnings.showwarning = _show_warning
    try:
        app()
    except TlpsimError as error:
        typer.echo(f"tlpsim: error: {error}", err=True)
        sys.exit(2)


if __name__ == "__main__":
    main()
