"""WAMIT's numeric output files, read and written; conventions in `tlpsim.loads.bem.exchange.conventions`.

    .1     PER I J A [B]                     added mass and damping; PER = 0 infinite, PER = -1 zero frequency
    .3     PER BETA I MOD PHA RE IM          excitation by pressure; .3fk the same of the incident wave alone
    .4     PER BETA I MOD PHA RE IM          response amplitude operators
    .8     PER BETA1 BETA2 I MOD PHA RE IM   mean drift by momentum: surge, sway, yaw
    .9     PER BETA1 BETA2 I MOD PHA RE IM   mean drift by pressure: all six
    .12d   PER1 PER2 BETA1 BETA2 I ...       difference-frequency QTF; its diagonal is the mean drift (all of it by
                                             `tlpsim.loads.bem.exchange.wamit_quadratic`)
    .hst   I J C                             hydrostatic and gravitational restoring

Only .1 and .3 must be there. Elements that a file leaves out for a period and heading that it has are zero. Of the
drift, surge, sway and yaw are taken from .8, .9 or .12d in this order, heave, roll and pitch from .9 or .12d.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.exchange.conventions import (
    CONVENTIONS,
    MODES,
    Convention,
    about_origin,
    assembled,
    told_time_sign,
    turned,
)
from tlpsim.loads.bem.exchange.wamit_rows import ROTATES, drift_scale, is_in, mode_of, numeric_rows, place_in
from tlpsim.loads.bem.hydrostatics import Hydrostatics, weight_stiffness
from tlpsim.loads.constants import HORIZONTAL, SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_PAIRS = ROTATES[:, None] + ROTATES[None, :]
# What stands for zero and infinite frequency in the first column, by what that column is.
_LIMITS = {"period": {-1.0: "added_mass_zero", 0.0: "added_mass_infinite"}}
_LIMITS["omega"] = {0.0: "added_mass_zero", -1.0: "added_mass_infinite"}


def read_wamit(
    stem: str | Path,
    depth: float,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
    *,
    length: float = 1.0,
    reference_point: ArrayLike = (0.0, 0.0, 0.0),
    mass: float = 0.0,
    centre_of_gravity: ArrayLike = (0.0, 0.0, 0.0),
) -> HydrodynamicDatabase:
    """Database of the files `stem`.1, `stem`.3 and, where they are, .3fk, .4, .8, .9, .12d and .hst of one body.

    Parameters
    ----------
    stem
        Path without suffix.
    depth, density, gravity
        Of the run, in m (infinity for deep water), kg/m³, m/s²; the files do not tell them.
    length
        ULEN of the run, m.
    reference_point
        (3,) m, origin of the body's axes (XBODY), that moments and motions of the run refer to.
    mass, centre_of_gravity
        Of the run, kg and (3,) m from the origin: the weight's share is taken out of the .hst. Without a mass, the
        .hst is read where the reference point is the origin, as that of a centre of gravity there.

    Raises
    ------
    ScenarioError
        If a needed file is missing, is no table of its columns, or is of several bodies.
    """
    return read_tables(
        Path(stem), depth, density, gravity, CONVENTIONS["WAMIT"], length, reference_point, mass, centre_of_gravity
    )


def read_tables(
    stem: Path,
    depth: float,
    density: float,
    gravity: float,
    convention: Convention,
    length: float = 1.0,
    reference_point: ArrayLike = (0.0, 0.0, 0.0),
    mass: float = 0.0,
    centre_of_gravity: ArrayLike = (0.0, 0.0, 0.0),
    column: str = "period",
) -> HydrodynamicDatabase:
    """As `read_wamit`, for codes that write WAMIT's tables; `column` is what stands first, "period" or "omega"."""
    radiation, excitation = numeric_rows(Path(f"{stem}.1"), 4), numeric_rows(Path(f"{stem}.3"), 7)
    limits = _LIMITS[column]
    grid = np.unique([row[0] for row in radiation if row[0] > 0.0])
    headings = np.unique([row[1] for row in excitation])
    if len(grid) == 0:
        raise ScenarioError(f"{stem}.1 has zero or infinite frequency only; run the code at some wave periods")
    omega = 2.0 * np.pi / grid if column == "period" else grid
    matrices, added_mass_limits = _radiation(Path(f"{stem}.1"), radiation, grid, limits)
    scale = density * length ** (3 + _PAIRS)
    force_scale = density * gravity * length ** (2 + ROTATES)
    heading = headings * convention.heading_unit

    def waves(suffix: str, rows: list[list[float]]) -> ComplexArray:
        return _by_wave(Path(f"{stem}{suffix}"), rows, grid, headings, 1)

    force = waves(".3", excitation) * force_scale
    ascending = force if omega[0] < omega[-1] else force[:, ::-1]
    sign = convention.time_sign or told_time_sign(heading, ascending)
    found: dict[str, object] = {name: limit * scale for name, limit in added_mass_limits.items()}
    if (path := Path(f"{stem}.3fk")).exists():
        found["froude_krylov_force"] = turned(waves(".3fk", numeric_rows(path, 7)) * force_scale, sign)
    if (path := Path(f"{stem}.4")).exists():
        found["response_amplitude"] = turned(waves(".4", numeric_rows(path, 7)) / length**ROTATES, sign)
    drift = _drift(stem, grid, headings)
    if drift is not None:
        found["mean_drift"] = drift * drift_scale(density, gravity, length)[_drift_modes(drift)]
    point = np.asarray(reference_point, dtype=np.float64)
    told = not np.any(point) or (mass > 0.0 and not np.any(point[:2]))
    if told and (path := Path(f"{stem}.hst")).exists():
        restoring = _restoring(path) * density * gravity * length ** (2 + _PAIRS)
        found["hydrostatics"] = _hydrostatics(
            restoring - weight_stiffness(mass, centre_of_gravity, gravity), density * gravity
        )
    database = assembled(
        omega=omega,
        heading=heading,
        depth=depth,
        density=density,
        gravity=gravity,
        added_mass=matrices[0] * scale,
        radiation_damping=matrices[1] * scale * omega[:, None, None],
        excitation_force=turned(force, sign),
        **found,
    )
    return about_origin(database, point)


def _radiation(
    path: Path, rows: list[list[float]], grid: FloatArray, limits: dict[float, str]
) -> tuple[FloatArray, dict[str, FloatArray]]:
    matrices = np.zeros((2, len(grid), MODES, MODES))
    found: dict[str, FloatArray] = {}
    for row in rows:
        i, j = mode_of(path, row[1]), mode_of(path, row[2])
        if row[0] in limits:
            found.setdefault(limits[row[0]], np.zeros((MODES, MODES)))[i, j] = row[3]
            continue
        if len(row) < 5:
            raise ScenarioError(f"{path}: a row of {row[0]:g} lacks the damping; write PER I J A B")
        matrices[:, place_in(path, row[0], grid, "period or frequency"), i, j] = row[3:5]
    return matrices, found


def _by_wave(path: Path, rows: list[list[float]], grid: FloatArray, headings: FloatArray, column: int) -> ComplexArray:
    """Amplitudes (headings, frequencies, 6); NaN where the file has no row for a wave at all."""
    result = np.full((len(headings), len(grid), MODES), np.nan, dtype=np.complex128)
    for row in rows:
        wave = result[
            place_in(path, row[column], headings, "heading"), place_in(path, row[0], grid, "period or frequency")
        ]
        if np.all(np.isnan(wave)):
            wave[:] = 0.0
        wave[mode_of(path, abs(row[column + 1]))] = complex(row[-2], row[-1])
    return result


def _drift(stem: Path, grid: FloatArray, headings: FloatArray) -> FloatArray | None:
    """Mean drift (headings, frequencies, 3 or 6), None without any file; rows of two waves are left out.

    In a .8 or .9 file the second heading stands before the mode, in a .12d too, behind two periods.
    """
    found: dict[str, FloatArray] = {}
    for suffix, columns, head in ((".12d", 9, 2), (".9", 8, 1), (".8", 8, 1)):
        if (path := Path(f"{stem}{suffix}")).exists():
            rows = [
                row for row in numeric_rows(path, columns) if row[head] == row[head + 1] and is_in(row[head], headings)
            ]
            if suffix == ".12d":
                rows = [row for row in rows if row[0] == row[1] and is_in(row[0], grid)]
            found[suffix] = _by_wave(path, rows, grid, headings, head + 1).real
    if not found:
        return None
    result = np.full((len(headings), len(grid), MODES), np.nan)
    for suffix, values in found.items():  # the strongest comes last
        modes = list(HORIZONTAL) if suffix == ".8" else list(range(MODES))
        known = ~np.isnan(values[..., modes])
        result[..., modes] = np.where(known, values[..., modes], result[..., modes])
    return result[..., HORIZONTAL] if set(found) == {".8"} else result


def _drift_modes(drift: FloatArray) -> list[int]:
    return list(HORIZONTAL) if drift.shape[2] == len(HORIZONTAL) else list(range(MODES))


def _restoring(path: Path) -> FloatArray:
    result = np.zeros((MODES, MODES))
    for row in numeric_rows(path, 3):
        result[mode_of(path, row[0]), mode_of(path, row[1])] = row[2]
    return result


def _hydrostatics(stiffness: FloatArray, weight_density: float) -> Hydrostatics:
    """What a restoring matrix tells: the water plane, but not the volume by itself."""
    figures = stiffness / weight_density
    return Hydrostatics(
        volume=np.nan,
        centre_of_buoyancy=np.full(3, np.nan),
        waterplane_area=float(figures[2, 2]),
        waterplane_first_moments=np.array([-figures[2, 4], figures[2, 3]]),
        waterplane_second_moments=np.array([np.nan, np.nan, -figures[3, 4]]),
        stiffness=stiffness,
    )


def write_wamit(database: HydrodynamicDatabase, stem: str | Path, length: float = 1.0) -> tuple[Path, ...]:
    """Write what a database holds of .1, .3, .3fk, .4, .8, .9 and .hst, and return the paths written.

    Parameters
    ----------
    database
        What to write; its .hst has the terms of buoyancy and water plane only, as if the weight pulled at the origin.
    stem
        Path without suffix.
    length
        ULEN, m.

    Raises
    ------
    ScenarioError
        If a file cannot be written.
    """
    files = {".1": _radiation_rows(database, length)}
    weight = database.density * database.gravity
    for suffix, amplitude, scale in (
        (".3", database.excitation_force, weight * length ** (2 + ROTATES)),
        (".3fk", database.froude_krylov_force, weight * length ** (2 + ROTATES)),
        (".4", database.response_amplitude, 1.0 / length**ROTATES),
    ):
        if amplitude is not None and np.any(np.isfinite(amplitude)):
            files[suffix] = list(_wave_rows(database, amplitude / scale, range(MODES), twice=False))
    modes = np.array(_drift_modes(database.mean_drift))
    drift = database.mean_drift / drift_scale(database.density, database.gravity, length)[modes] + 0j
    if np.any(np.isfinite(drift)):
        momentum = [int(np.flatnonzero(modes == mode)[0]) for mode in HORIZONTAL]
        files[".8"] = list(_wave_rows(database, drift[..., momentum], HORIZONTAL, twice=True))
        if len(modes) == MODES:
            files[".9"] = list(_wave_rows(database, drift, range(MODES), twice=True))
    if database.hydrostatics is not None:
        restoring = database.hydrostatics.stiffness / (weight * length ** (2 + _PAIRS))
        files[".hst"] = [f"{i + 1:6d} {j + 1:5d} {restoring[i, j]:17.9E}" for i, j in np.ndindex(MODES, MODES)]
    paths = []
    for suffix, rows in files.items():
        path = Path(f"{stem}{suffix}")
        try:
            path.write_text("\n".join(rows) + "\n")
        except OSError as error:
            raise ScenarioError(f"{path}: cannot be written ({error.strerror}); name another stem") from error
        paths.append(path)
    return tuple(paths)


def _radiation_rows(database: HydrodynamicDatabase, length: float) -> list[str]:
    scale = database.density * length ** (3 + _PAIRS)
    rows = []
    for mark, name in _LIMITS["period"].items():
        matrix = getattr(database, name) / scale
        if np.all(np.isfinite(matrix)):
            rows += [f"{mark:16.9E} {i + 1:5d} {j + 1:5d} {matrix[i, j]:17.9E}" for i, j in np.ndindex(MODES, MODES)]
    for omega, mass, damping in zip(database.omega, database.added_mass, database.radiation_damping, strict=True):
        a, b = mass / scale, damping / scale / omega
        rows += [
            f"{2 * np.pi / omega:16.9E} {i + 1:5d} {j + 1:5d} {a[i, j]:17.9E} {b[i, j]:17.9E}"
            for i, j in np.ndindex(MODES, MODES)
        ]
    return rows


def _wave_rows(
    database: HydrodynamicDatabase, amplitude: ComplexArray, modes: range | tuple[int, ...], twice: bool
) -> Iterator[str]:
    """Rows of a table by period, heading (written twice for a drift) and mode."""
    for index, omega in enumerate(database.omega):
        for place, heading in enumerate(np.degrees(database.heading)):
            direction = f"{heading:14.6E} " * (2 if twice else 1)
            for mode, value in zip(modes, amplitude[place, index], strict=True):
                if np.isfinite(value):
                    yield (
                        f"{2 * np.pi / omega:16.9E} {direction}{mode + 1:5d} {abs(value):17.9E} "
                        f"{np.degrees(np.angle(value)):14.6E} {value.real:17.9E} {value.imag:17.9E}"
                    )
