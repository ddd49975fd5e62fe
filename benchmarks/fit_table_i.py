"""How the inputs of `scenarios/table_i.toml` were inferred: the frequency domain fitted to the paper's Table I.

    .venv/bin/python benchmarks/fit_table_i.py [--rounds 12]

Li and Kareem (1990) publish the response of a "typical TLP", but neither the platform nor its environment. Here the
inputs of `INPUTS` are changed until all 18 cells come as near to the paper's as they can, by least squares of

    log(cell / nearer of the paper's two columns), zero between the two                                  (1)

from an environment that another program was fitted with. Different inputs lead to nearly the same table, so that what
is found is one environment among others. Mass and centre of gravity stay, since the hull's hydrodynamics depend on
them. The script prints the table, and the lines that a scenario needs.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tlpsim.loads.bem.database import cache_path
from tlpsim.loads.bem.issc import issc_problem
from tlpsim.loads.issc_tlp import DRAUGHT, Hull
from tlpsim.scenarios.paper import TABLE_I
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral import spectral_response
from tlpsim.scenarios.statistics.bands import BAND_EDGES
from tlpsim.scenarios.statistics.summary import TABLE_UNITS

FloatArray = NDArray[np.float64]

FILE = Path(__file__).parents[1] / "scenarios" / "table_i.toml"
FAR = 0.1
"""Distance of eq. (1) at which a cell counts as one."""
HOLD = 0.05
"""What a change of an input by its scale counts."""
STEP = 0.2
"""Of the differences that the fit goes by, in sizes of a change: well above what the iteration leaves."""
AREA, SHAPE_COEFFICIENT, ROWS = 3000.0, 1.2, (-10.0, 10.0)
# Start, and size of a change: a factor of e to it where the input must stay positive, else in m or degrees.
INPUTS = {
    "wind speed": (29.4, 0.05),
    "wind heading": (38.2, 2.0),
    "roughness": (3e-4, 0.5),
    "height of the wind's centre": (60.0, 0.1),
    "offset across the wind": (-13.4, 1.0),
    "width across the wind": (30.0, 0.2),
    "significant height": (7.2, 0.05),
    "peak period": (14.21, 0.03),
    "wave heading": (21.6, 1.0),
    "current speed": (0.24, 0.2),
    "current heading": (80.0, 10.0),
    "drag coefficient": (1.2, 0.1),
    "tether length": (486.7, 0.02),
    "axial stiffness": (1.76e11, 0.05),
}
ADDED = ("wind heading", "offset across the wind", "wave heading", "current heading")


def segments(heading: float, centre: float, offset: float, width: float) -> list[dict[str, object]]:
    """Six equal segments at two heights, three across the wind."""
    angle = math.radians(heading)
    return [
        {
            "position": [-math.sin(angle) * (side + offset), math.cos(angle) * (side + offset), centre + rise],
            "area": AREA / 6.0,
            "shape_coefficient": SHAPE_COEFFICIENT,
        }
        for rise in ROWS
        for side in (-width, 0.0, width)
    ]


def inputs(values: FloatArray) -> dict[str, float]:
    """The inputs of scaled changes."""
    return {
        name: start + size * float(value) if name in ADDED else start * math.exp(size * float(value))
        for (name, (start, size)), value in zip(INPUTS.items(), values, strict=True)
    }


def scenario(base: Scenario, values: FloatArray) -> Scenario:
    """The scenario of scaled changes of the inputs."""
    at = inputs(values)
    shape = (at[name] for name in ("height of the wind's centre", "offset across the wind", "width across the wind"))
    return base.with_(
        site={"water_depth": DRAUGHT + at["tether length"]},
        platform={
            "drag_coefficient": at["drag coefficient"],
            "tendons": {"axial_stiffness": at["axial stiffness"]},
        },
        wind={
            "speed": at["wind speed"],
            "heading_deg": at["wind heading"],
            "roughness": at["roughness"],
            "segments": segments(at["wind heading"], *shape),
        },
        waves={
            "significant_height": at["significant height"],
            "peak_period": at["peak period"],
            "heading_deg": at["wave heading"],
        },
        current={"speed": at["current speed"], "heading_deg": at["current heading"]},
    )


def cells(chosen: Scenario) -> FloatArray:
    """Mean and both spreads of the six degrees of freedom in the table's units, (6, 3)."""
    response = spectral_response(chosen)
    rows = []
    for degree, (_, factor) in TABLE_UNITS.items():
        found = response.quantities[f"position.{degree}"]
        rows.append([found.mean, found.spread(0.0, BAND_EDGES[0]), found.spread(*BAND_EDGES)])
        rows[-1] = [factor * value for value in rows[-1]]
    return np.array(rows)


def distances(found: FloatArray) -> FloatArray:
    """Eq. (1), (18,)."""
    paper = np.array([list(rows.values()) for rows in TABLE_I.values()])
    low, high = (edge(np.abs(paper), axis=2) for edge in (np.min, np.max))
    size = np.abs(found) * np.where(found * paper[..., 0] > 0.0, 1.0, 1e-3)
    return np.asarray(np.log(np.where(size < low, size / low, np.where(size > high, size / high, 1.0)))).ravel()


def _with_one_database(base: Scenario) -> Scenario:
    """The scenario with its hydrodynamics as they are, at whatever depth of the deep water."""
    spectral_response(base)  # makes the database
    site, platform = base.site, base.platform
    hull = Hull(mass=platform.mass, centre_of_gravity=platform.centre_of_gravity)
    path = cache_path(issc_problem(site.water_depth, site.water_density, site.gravity, hull))
    return base.with_(platform={"hydrodynamics": str(path)})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=12, help="of the fit")
    base, rounds = _with_one_database(Scenario.load(FILE)), parser.parse_args().rounds

    def residual(values: FloatArray) -> FloatArray:
        found = distances(cells(scenario(base, values)))
        # The farthest cell counts most: fourth powers in the sum of squares.
        pulled = np.sign(found) * (found / FAR) ** 2
        print(f"farthest {100.0 * (math.exp(np.abs(found).max()) - 1.0):.1f} %", flush=True)
        return np.concatenate([pulled, HOLD * values])

    def slopes(values: FloatArray) -> FloatArray:
        here = residual(values)
        units = STEP * np.eye(len(values))
        return np.column_stack([(residual(values + unit) - here) / STEP for unit in units])

    fit = least_squares(residual, np.zeros(len(INPUTS)), jac=slopes, max_nfev=rounds)
    table = cells(scenario(base, fit.x))
    paper = np.array([list(rows.values()) for rows in TABLE_I.values()])
    off = np.exp(distances(table).reshape(6, 3)) - 1.0
    for degree, ours, theirs, away in zip(TABLE_I, table, paper, off, strict=True):
        columns = [
            f"{v:8.3f} ({a:g}, {b:g}) {100 * d:+5.1f} %" for v, (a, b), d in zip(ours, theirs, away, strict=True)
        ]
        print(f"{degree:6}", "  ".join(columns))
    for name, value in inputs(fit.x).items():
        print(f"{name:30} {value:.6g}")
    chosen = scenario(base, fit.x)
    print("segments:", [[round(x, 3) for x in each.position] for each in chosen.wind.segments or ()])


if __name__ == "__main__":
    main()
