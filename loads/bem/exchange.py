"""Hydrodynamic coefficients in the files of other codes: WAMIT .1 and .3, and Capytaine's NetCDF.

Each convention stands in this table; all of them have amplitudes turned into exp(+i omega t) and SI units here.

    file           time factor       heading         numbers
    here           exp(+i omega t)   propagation     SI
    WAMIT          exp(+i omega t)   propagation     A / ρL^k, B / (ρ L^k ω), X / (ρ g A L^m), moduli and phases in °
    Capytaine      exp(-i omega t)   propagation     SI; infinite depth as inf; conjugated when read

with k = 3, 4, 5 and m = 2, 3 for a force or a moment by a translation or a rotation, and L = 1 m. WAMIT writes
a line for each period; period 0 is infinite frequency and period -1 zero frequency.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

_INFINITE_FREQUENCY, _ZERO_FREQUENCY = 0.0, -1.0


def write_wamit(database: HydrodynamicDatabase, stem: str | Path) -> tuple[Path, Path]:
    """Write `stem`.1 (added mass and damping) and `stem`.3 (excitation), and return their paths."""
    first, third = Path(f"{stem}.1"), Path(f"{stem}.3")
    density, gravity = database.density, database.gravity
    rows = []
    for period, matrix in (
        (_ZERO_FREQUENCY, database.added_mass_zero),
        (_INFINITE_FREQUENCY, database.added_mass_infinite),
    ):
        if np.all(np.isfinite(matrix)):
            rows += [
                f"{period:14.6E} {i + 1:5d} {j + 1:5d} {matrix[i, j] / density:17.9E}" for i, j in np.ndindex(6, 6)
            ]
    for index, omega in enumerate(database.omega):
        mass, damping = database.added_mass[index] / density, database.radiation_damping[index] / density / omega
        rows += [
            f"{2 * np.pi / omega:14.9E} {i + 1:5d} {j + 1:5d} {mass[i, j]:17.9E} {damping[i, j]:17.9E}"
            for i, j in np.ndindex(6, 6)
        ]
    first.write_text("\n".join(rows) + "\n")
    rows = []
    for index, omega in enumerate(database.omega):
        for place, heading in enumerate(np.degrees(database.heading)):
            for mode, force in enumerate(database.excitation_force[place, index] / density / gravity):
                rows.append(
                    f"{2 * np.pi / omega:14.9E} {heading:14.6E} {mode + 1:5d} {abs(force):17.9E} "
                    f"{np.degrees(np.angle(force)):14.6E} {force.real:17.9E} {force.imag:17.9E}"
                )
    third.write_text("\n".join(rows) + "\n")
    return first, third


def read_wamit(
    stem: str | Path, depth: float, density: float = 1025.0, gravity: float = 9.80665
) -> HydrodynamicDatabase:
    """Database of `stem`.1 and `stem`.3 with periods in s and a length scale of 1 m; no drift in these files.

    Raises
    ------
    ScenarioError
        If a file is missing or is not a table of the expected columns.
    """
    radiation, excitation = _table(Path(f"{stem}.1"), 4), _table(Path(f"{stem}.3"), 7)
    periods = np.array(sorted({row[0] for row in radiation if row[0] > 0.0}, reverse=True))
    headings = np.array(sorted({row[1] for row in excitation}))
    place = {period: index for index, period in enumerate(periods)}
    column = {heading: index for index, heading in enumerate(headings)}
    omega = 2.0 * np.pi / periods
    mass, damping = np.zeros((len(omega), 6, 6)), np.zeros((len(omega), 6, 6))
    limits = {_ZERO_FREQUENCY: np.full((6, 6), np.nan), _INFINITE_FREQUENCY: np.full((6, 6), np.nan)}
    for row in radiation:
        i, j = int(row[1]) - 1, int(row[2]) - 1
        if row[0] in limits:
            limits[row[0]][i, j] = row[3] * density
        else:
            mass[place[row[0]], i, j] = row[3] * density
            damping[place[row[0]], i, j] = row[4] * density * omega[place[row[0]]]
    force = np.zeros((len(headings), len(omega), 6), dtype=np.complex128)
    for row in excitation:
        if row[0] not in place:
            raise ScenarioError(f"{stem}.3 has period {row[0]} s, which {stem}.1 has not; write both in one run")
        force[column[row[1]], place[row[0]], int(row[2]) - 1] = complex(row[5], row[6]) * density * gravity
    return _database(omega, np.radians(headings), depth, density, gravity, mass, damping, force, limits)


def read_capytaine(path: str | Path, depth: float) -> HydrodynamicDatabase:
    """Database of one water depth (m, or infinity) in a NetCDF file of Capytaine, in its six rigid-body modes.

    Raises
    ------
    ScenarioError
        If the file is missing, lacks a variable, or has no such depth.
    """
    try:
        with h5py.File(path, "r") as file:
            depths = np.atleast_1d(np.asarray(file["water_depth"], dtype=np.float64))
            found = np.flatnonzero(np.isclose(depths, depth, rtol=1e-6, atol=0.0))
            if len(found) == 0:
                raise ScenarioError(f"{path}: depths are {depths.tolist()} m, not {depth} m; choose one of these")
            index = int(found[0])
            several = np.asarray(file["added_mass"]).ndim == 4
            take = (lambda array: array[index]) if several else (lambda array: array)
            mass = take(np.asarray(file["added_mass"]))
            damping = take(np.asarray(file["radiation_damping"]))
            parts = np.asarray(file["excitation_force"])
            force = np.stack([take(part) for part in parts])
            return _database(
                np.asarray(file["omega"], dtype=np.float64),
                np.asarray(file["wave_direction"], dtype=np.float64),
                depth,
                float(np.asarray(file["rho"])),
                float(np.asarray(file["g"])),
                mass,
                damping,
                np.moveaxis(force[0] - 1j * force[1], 1, 0),
                {},
            )
    except (OSError, KeyError) as error:
        raise ScenarioError(f"{path}: not a NetCDF file of Capytaine ({error})") from error


def _database(
    omega: FloatArray,
    heading: FloatArray,
    depth: float,
    density: float,
    gravity: float,
    mass: FloatArray,
    damping: FloatArray,
    force: NDArray[np.complex128],
    limits: dict[float, FloatArray],
) -> HydrodynamicDatabase:
    unknown = np.full((6, 6), np.nan)
    result = HydrodynamicDatabase(
        omega=omega,
        heading=heading,
        depth=depth,
        density=density,
        gravity=gravity,
        added_mass=mass,
        radiation_damping=damping,
        excitation_force=force,
        froude_krylov_force=np.full(force.shape, np.nan, dtype=np.complex128),
        added_mass_infinite=limits.get(_INFINITE_FREQUENCY, unknown),
        added_mass_zero=limits.get(_ZERO_FREQUENCY, unknown),
        mean_drift=np.full((*force.shape[:2], 3), np.nan),
    )
    order = np.argsort(omega)
    return replace(
        result,
        omega=omega[order],
        added_mass=mass[order],
        radiation_damping=damping[order],
        excitation_force=force[:, order],
    )


def _table(path: Path, columns: int) -> list[list[float]]:
    try:
        rows = [[float(word) for word in line.split()] for line in path.read_text().splitlines() if line.strip()]
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read ({error.strerror}); give the stem of WAMIT's output") from error
    except ValueError:  # a heading line, which WAMIT writes or not
        rows = [[float(word) for word in line.split()] for line in path.read_text().splitlines()[1:] if line.strip()]
    if not rows or min(len(row) for row in rows) < columns:
        raise ScenarioError(f"{path}: rows of at least {columns} numbers are needed; write the WAMIT numeric output")
    return rows
