"""The command `tlpsim figures`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.cli.options import Settings, load
from tlpsim.scenarios.cli.spectral import compare_figures
from tlpsim.scenarios.terminal import say


class FigureSet(StrEnum):
    """What `tlpsim figures` can draw."""

    PROCESSES = "processes"
    HYDRO = "hydro"
    COMPARE = "compare"


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

    with interruptible(lambda: "nothing was drawn"):
        for path in draw_processes(output, load(scenario, None, None, settings) if scenario else None):
            say(path)


def _hydro_figures(folder: Path, database: Path | None) -> None:
    from tlpsim.loads.bem.database import read
    from tlpsim.scenarios.hydro_figures import draw_hydrodynamics, reference_database

    with interruptible(lambda: "nothing was drawn"):
        for path in draw_hydrodynamics(folder, read(database) if database else reference_database()):
            say(path)
