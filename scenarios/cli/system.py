"""The commands about FMUs and their wiring: `tlpsim build`, `export`, `check`, `swap`, `info`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.cli import completion
from tlpsim.scenarios.cli.endings import ExitCode
from tlpsim.scenarios.cli.options import Duration, Json, ScenarioFile, Seed, Settings, load, print_json
from tlpsim.scenarios.cli.spectral import print_spectral_file
from tlpsim.scenarios.cli.sweep import show_sweep
from tlpsim.scenarios.terminal import say

if TYPE_CHECKING:
    from tlpsim.orchestrator.system import System


def build(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the FMUs.")],
    bundle: Annotated[bool, typer.Option("--bundle", help="Pack the sources in, for a Python without tlpsim.")] = False,
) -> None:
    """Build wind.fmu, wave.fmu and platform.fmu."""
    from tlpsim.fmus.build import build as build_fmus

    for path in build_fmus(output, bundle=bundle):
        say(path)


def export(
    scenario: ScenarioFile,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="System description, .ssp or .ssd.")],
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
) -> None:
    """Write a scenario's FMUs, parameters and wiring as a system description of the standard SSP."""
    from tlpsim.scenarios.generic import export as export_scenario

    say(f"system: {export_scenario(load(scenario, duration, seed, settings), output)}")


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
    json: Json = False,
) -> None:
    """Check a system, its FMUs, their parameters and wiring: all but the run itself."""
    from tlpsim.orchestrator.coupling_report import coupling_report
    from tlpsim.orchestrator.execution import Master
    from tlpsim.scenarios.console import print_system
    from tlpsim.scenarios.coupling import print_coupling
    from tlpsim.scenarios.json_content import coupling_content, system_content

    with _checked(file, duration, seed, settings) as (title, system, notes, origins, start):
        Master(system).initialize(start)
        reports = coupling_report(system, band) if coupling else []
        if json:
            content = system_content(title, system, notes, origins)
            print_json({**content, "valid": True, "coupling": coupling_content(reports)})
            return
        print_system(title, system, notes, origins)
        if coupling:
            print_coupling(reports, band)
    say(f"The {'scenario' if file.suffix == '.toml' else 'system'} is valid; its FMUs load, initialize and fit.")


def swap(
    scenario: ScenarioFile,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Component to replace: wind, wave or platform.",
            autocompletion=completion.component_names,
        ),
    ],
    fmu: Annotated[Path, typer.Argument(metavar="VENDOR.FMU", help="What is to take its place.")],
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE.toml", help="Write a scenario with the FMU in place.")
    ] = None,
    settings: Settings = None,
    json: Json = False,
) -> None:
    """Check whether an FMU can take a component's place, and draft the lines of a scenario for it.

    The exit code is 0 if it fits, and 1 if not.
    """
    from tlpsim.scenarios.json_content import swap_content
    from tlpsim.scenarios.swap import print_swap, write_scenario
    from tlpsim.scenarios.swap import swap as compare

    require_writable(write)
    found = compare(load(scenario, None, None, settings), name, fmu)
    if write is not None:
        write_scenario(found, scenario, write)
    if json:
        print_json(swap_content(found))
    else:
        print_swap(found)
    if write is not None:
        say(f"scenario: {write}", aside=json)
    if found.faults:
        raise typer.Exit(ExitCode.NO)


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


def info(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="An .fmu, .ssp or .ssd, any .h5 that tlpsim wrote, or a sweep's folder."),
    ],
    json: Json = False,
) -> None:
    """Print what an FMU, a system, a results file, a sweep, hydrodynamics or a quadratic transfer function holds."""
    from tlpsim.scenarios import json_content
    from tlpsim.scenarios.console import print_fmu, print_results, print_system

    if file.is_dir() or file.suffix == ".parquet":
        show_sweep(file, json)
        return
    if file.suffix == ".toml":
        raise ScenarioError(f"{file}: is not a file of results; what a scenario comes to shows: tlpsim check {file}")
    if file.suffix in (".ssp", ".ssd"):
        with _checked(file) as (title, system, notes, origins, _):
            if json:
                print_json(json_content.system_content(title, system, notes, origins))
            else:
                print_system(title, system, notes, origins)
        return
    if file.suffix == ".fmu":
        from tlpsim.orchestrator.fmi.description import read_description

        description = read_description(file)
        if json:
            print_json(json_content.fmu_content(description))
        else:
            print_fmu(description)
        return
    from tlpsim.loads.bem.database import is_database, read
    from tlpsim.loads.bem.quadratic_transfer import is_quadratic_transfer, read_quadratic_transfer
    from tlpsim.scenarios import hydro

    if is_quadratic_transfer(file):
        table = read_quadratic_transfer(file)
        if json:
            print_json(json_content.quadratic_content(table))
        else:
            say(f"{file}: quadratic transfer function")
            hydro.print_quadratic_transfer(table)
    elif is_database(file):
        database = read(file)
        if json:
            print_json(json_content.database_content(database))
        else:
            say(f"{file}: hydrodynamic database")
            hydro.print_database(database)
    elif not print_spectral_file(file, json):
        from tlpsim.scenarios.results import open_results

        results = open_results(file)
        if json:
            print_json(json_content.results_content(results))
        else:
            print_results(results)
