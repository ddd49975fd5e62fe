"""The command `tlpsim`: build, run, resume, check, swap, export, spectral, compare, sensitivity, info, figures, bem.

Heavy imports stand inside the commands, so that `tlpsim --help` answers at once.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.scenarios.cli_options import Duration, Seed, Settings, interruptible, load
from tlpsim.scenarios.cli_run import resume, run
from tlpsim.scenarios.cli_spectral import compare, compare_figures, print_spectral_file, sensitivity, spectral

if TYPE_CHECKING:
    from tlpsim.orchestrator.system import System

app = typer.Typer(
    name="tlpsim",
    help="Co-simulation of tension leg platforms in wind, waves and current as a system of FMUs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
HullFile = Annotated[Path, typer.Argument(metavar="HULL", help="HULL.toml, or a mesh: .gdf, .dat, .mar, .stl.")]
DatabaseFile = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="FILE", help="Database (HDF5); .nc for Capytaine's format, .1 for WAMIT's."),
]
Frequencies = Annotated[
    str, typer.Option("--omega", metavar="W", help="Frequencies in rad/s, START:STOP:COUNT or a list: 0.1:1.2:23.")
]
Headings = Annotated[
    str, typer.Option("--headings", metavar="B", help="Directions of propagation in degrees, 0,22.5,45 or 0:90:7.")
]


@app.command()
def build(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the FMUs.")],
    bundle: Annotated[bool, typer.Option("--bundle", help="Pack the sources in, for a Python without tlpsim.")] = False,
) -> None:
    """Build wind.fmu, wave.fmu and platform.fmu."""
    from tlpsim.fmus.build import build as build_fmus

    for path in build_fmus(output, bundle=bundle):
        typer.echo(path)


app.command()(run)
app.command()(resume)
app.command()(spectral)
app.command()(compare)
app.command()(sensitivity)


@app.command()
def export(
    scenario: ScenarioFile,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="System description, .ssp or .ssd.")],
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
) -> None:
    """Write a scenario's FMUs, parameters and wiring as a system description of the standard SSP."""
    from tlpsim.scenarios.generic import export as export_scenario

    typer.echo(f"system: {export_scenario(load(scenario, duration, seed, settings), output)}")


@app.command()
def check(
    file: Annotated[
        Path, typer.Argument(metavar="SYSTEM", help="Scenario (.toml) or system description (.ssp, .ssd).")
    ],
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
    coupling: Annotated[
        bool, typer.Option("--coupling", help="Errors of filters and extrapolations of each connection, too.")
    ] = False,
    band: Annotated[
        float, typer.Option("--band", metavar="B", help="End of their band, cycles a sample of the slower component.")
    ] = 0.1,
) -> None:
    """Check a system, its FMUs, their parameters and wiring: all but the run itself."""
    from tlpsim.orchestrator.execution import Master
    from tlpsim.scenarios.console import print_system

    with _checked(file, duration, seed, settings) as (title, system, notes, origins, start):
        Master(system).initialize(start)
        print_system(title, system, notes, origins)
        if coupling:
            from tlpsim.orchestrator.coupling_report import coupling_report
            from tlpsim.scenarios.coupling import print_coupling

            print_coupling(coupling_report(system, band), band)
    typer.echo(f"The {'scenario' if file.suffix == '.toml' else 'system'} is valid; its FMUs load, initialize and fit.")


@app.command()
def swap(
    scenario: ScenarioFile,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Component to replace: wind, wave or platform.")],
    fmu: Annotated[Path, typer.Argument(metavar="VENDOR.FMU", help="What is to take its place.")],
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE.toml", help="Write a scenario with the FMU in place.")
    ] = None,
    settings: Settings = None,
) -> None:
    """Check whether an FMU can take a component's place, and draft the lines of a scenario for it.

    The exit code is 0 if it fits, and 1 if not.
    """
    from tlpsim.scenarios.swap import print_swap, write_scenario
    from tlpsim.scenarios.swap import swap as compare

    found = compare(load(scenario, None, None, settings), name, fmu)
    print_swap(found)
    if write is not None:
        write_scenario(found, scenario, write)
        typer.echo(f"scenario: {write}")
    if found.faults:
        raise typer.Exit(1)


@contextmanager
def _checked(
    file: Path, duration: str | None = None, seed: int | None = None, settings: list[str] | None = None
) -> Iterator[tuple[str, System, tuple[str, ...], dict[str, str], int]]:
    """Title, system, notes, origins of the components and start time (ns) of a scenario or a system description."""
    if file.suffix == ".toml":
        from tlpsim.scenarios.assemble import assembled

        chosen = load(file, duration, seed, settings)
        with assembled(chosen) as assembly:
            origins = {name: entry.fmu for name, entry in chosen.components.items()}
            yield chosen.title, assembly.system, assembly.notes, origins, 0
        return
    if seed is not None or duration is not None:
        raise ScenarioError("--seed and --duration are for scenarios: use --set")
    from tlpsim.orchestrator.clock import to_ticks
    from tlpsim.orchestrator.system import check as check_system
    from tlpsim.scenarios.generic import opened

    with opened([str(file)], settings=settings or []) as description:
        system = description.system
        parts = {each.name: each.instance.describe() for each in system.components}
        origins = {name: Path(part.get("fmu") or part.get("table", "")).name for name, part in parts.items()}
        start = to_ticks(description.start or 0.0, "start time")
        yield description.name, system, (*description.notes, *check_system(system)), origins, start


@app.command()
def bem(
    hull: HullFile,
    output: DatabaseFile,
    omega: Frequencies = "0.1:1.2:23",
    headings: Headings = "0",
    depth: Annotated[str, typer.Option(metavar="M", help="Water depth in m; inf is deep water.")] = "inf",
    rho: Annotated[str, typer.Option("--rho", metavar="RHO", help="Density of the water in kg/m³.")] = "1025",
    gravity: Annotated[str, typer.Option(metavar="G", help="Gravity in m/s².")] = "9.80665",
    lid: Annotated[bool, typer.Option("--lid/--no-lid", help="A lid removes irregular frequencies.")] = True,
    vertical_drift: Annotated[
        bool, typer.Option("--vertical-drift", help="Mean drift in heave, roll and pitch too; takes minutes.")
    ] = False,
    qtf: Annotated[
        Path | None,
        typer.Option(
            "--qtf",
            metavar="FILE",
            help="Difference-frequency quadratic transfer function too, into this file (HDF5): its quadratic part, "
            "without the potential of second order. Takes minutes.",
        ),
    ] = None,
    qtf_omega: Annotated[
        str | None, typer.Option("--qtf-omega", metavar="W", help="Its frequencies, instead of those of --omega.")
    ] = None,
    qtf_pairs: Annotated[
        bool, typer.Option("--qtf-pairs", help="With waves of two headings, for spread seas, not of one only.")
    ] = False,
    panel: Annotated[str | None, typer.Option(metavar="M", help="Size of the panels, instead of the file's.")] = None,
    symmetry: Annotated[
        str | None, typer.Option(metavar="XY", help="Planes of symmetry of a mesh file: x, y or xy.")
    ] = None,
) -> None:
    """Radiation, diffraction and mean drift of a hull by boundary elements, into a hydrodynamic database."""
    with interruptible(lambda: "interrupted; nothing was written"):
        from tlpsim.loads.bem.quadratic_transfer import write_quadratic_transfer
        from tlpsim.scenarios.hull import read_hull
        from tlpsim.scenarios.hydro import (
            make_problem,
            print_database,
            print_quadratic_transfer,
            quantity,
            require_quadratic,
            require_writable,
            solved,
            solved_quadratic,
            write_output,
        )
        from tlpsim.scenarios.quantities import LENGTH

        require_writable(output)
        require_quadratic(qtf, output, omega, qtf_omega, qtf_pairs)
        read = read_hull(hull, None if panel is None else quantity(panel, "--panel", LENGTH), symmetry)
        problem, found = make_problem(read, omega, headings, depth, rho, gravity, lid, vertical_drift)
        for text in found:
            _show_warning(text)
        database, from_cache = solved(problem)
        table = None if qtf is None else solved_quadratic(problem, qtf_omega, qtf_pairs)
        paths = write_output(database, output)
        print_database(database)
        if table is not None and qtf is not None:
            write_quadratic_transfer(table, qtf)
            print_quadratic_transfer(table, database)
    if from_cache:
        typer.echo("from the cache: this problem was solved before")
    typer.echo("database: " + ", ".join(str(path) for path in paths))
    if qtf is not None:
        typer.echo(f"quadratic transfer function: {qtf}")


@app.command()
def info(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="An .fmu, .ssp or .ssd, or any .h5 that tlpsim wrote."),
    ],
) -> None:
    """Print what an FMU, a system, a results file, a hydrodynamic database or a quadratic transfer function holds."""
    from tlpsim.scenarios.console import print_fmu, print_results, print_system

    if file.suffix in (".ssp", ".ssd"):
        with _checked(file) as (title, system, notes, origins, _):
            print_system(title, system, notes, origins)
        return
    if file.suffix == ".fmu":
        from tlpsim.orchestrator.fmi.description import read_description

        print_fmu(read_description(file))
        return
    from tlpsim.loads.bem.database import is_database, read
    from tlpsim.loads.bem.quadratic_transfer import is_quadratic_transfer, read_quadratic_transfer

    if is_quadratic_transfer(file):
        from tlpsim.scenarios.hydro import print_quadratic_transfer

        typer.echo(f"{file}: quadratic transfer function")
        print_quadratic_transfer(read_quadratic_transfer(file))
    elif is_database(file):
        from tlpsim.scenarios.hydro import print_database

        typer.echo(f"{file}: hydrodynamic database")
        print_database(read(file))
    elif not print_spectral_file(file):
        from tlpsim.scenarios.results import open_results

        print_results(open_results(file))


class FigureSet(StrEnum):
    """What `tlpsim figures` can draw."""

    PROCESSES = "processes"
    HYDRO = "hydro"
    COMPARE = "compare"


@app.command()
def figures(
    which: Annotated[
        FigureSet,
        typer.Argument(
            metavar="WHICH",
            help="processes: spectra of wind and waves; hydro: coefficients and mesh of a hull; compare: spectra of "
            "the response by both domains, and what each load does.",
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the PNG files.")],
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Scenario whose wind and waves (processes) or response (compare) is drawn."),
    ] = None,
    settings: Settings = None,
    database: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Database of `tlpsim bem` (hydro); the ISSC TLP's without it.")
    ] = None,
    comparison: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Comparison of `tlpsim compare -o` (compare).")
    ] = None,
) -> None:
    """Draw the digital filters that make wind and waves, the hydrodynamics of a hull, or a response by both domains."""
    if settings and scenario is None:
        raise ScenarioError("--set changes a scenario: name its file with --scenario")
    if comparison is not None and which is not FigureSet.COMPARE:
        raise ScenarioError("--comparison is for the figures 'compare': leave it out")
    if which is FigureSet.HYDRO:
        if scenario is not None:
            raise ScenarioError("--scenario is not for the figures 'hydro': name a database with --database")
        _hydro_figures(output, database)
        return
    if database is not None:
        raise ScenarioError("--database is for the figures 'hydro': name a scenario with --scenario")
    if which is FigureSet.COMPARE:
        compare_figures(output, scenario, settings, comparison)
        return
    from tlpsim.scenarios.figures import draw_processes

    for path in draw_processes(output, load(scenario, None, None, settings) if scenario else None):
        typer.echo(path)


def _hydro_figures(folder: Path, database: Path | None) -> None:
    from tlpsim.loads.bem.database import read
    from tlpsim.scenarios.hydro_figures import draw_hydrodynamics, reference_database

    with interruptible(lambda: "interrupted"):
        for path in draw_hydrodynamics(folder, read(database) if database else reference_database()):
            typer.echo(path)


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
