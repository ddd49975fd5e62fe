"""The command `tlpsim bem`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.cli.options import Json, print_json, show_warning
from tlpsim.scenarios.terminal import say

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
    json: Json = False,
) -> None:
    """Radiation, diffraction and mean drift of a hull by boundary elements, into a hydrodynamic database."""
    with interruptible(lambda: "nothing was written"):
        from tlpsim.loads.bem.quadratic_transfer import write_quadratic_transfer
        from tlpsim.scenarios.hull import read_hull
        from tlpsim.scenarios.hydro import (
            make_problem,
            print_database,
            print_quadratic_transfer,
            quantity,
            require_quadratic,
            solved,
            solved_quadratic,
            write_output,
        )
        from tlpsim.scenarios.json_content import database_content, quadratic_content
        from tlpsim.scenarios.quantities import LENGTH

        require_writable(output)
        require_quadratic(qtf, output, omega, qtf_omega, qtf_pairs)
        read = read_hull(hull, None if panel is None else quantity(panel, "--panel", LENGTH), symmetry)
        problem, found = make_problem(read, omega, headings, depth, rho, gravity, lid, vertical_drift)
        for text in found:
            show_warning(text)
        database, from_cache = solved(problem)
        table = None if qtf is None else solved_quadratic(problem, qtf_omega, qtf_pairs)
        paths = [str(path) for path in write_output(database, output)]
        if table is not None and qtf is not None:
            write_quadratic_transfer(table, qtf)
    if json:
        content = {**database_content(database), "paths": paths, "from_cache": from_cache}
        told = None if table is None else {**quadratic_content(table), "path": str(qtf)}
        print_json({**content, "quadratic_transfer": told})
    else:
        print_database(database)
        if table is not None:
            print_quadratic_transfer(table, database)
    if from_cache:
        say("from the cache: this problem was solved before", aside=json)
    say(f"database: {', '.join(paths)}", aside=json)
    if qtf is not None:
        say(f"quadratic transfer function: {qtf}", aside=json)
