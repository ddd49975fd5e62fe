"""The hydrodynamic database of a hull: coefficients against frequency, kept in HDF5 under a hash of all they depend on.

Conventions, in every file as attributes: SI units, z up from the still water level, forces and moments about the
origin, amplitudes exp(+i omega t), headings in rad of propagation anticlockwise from +x, excitation for a wave of unit
amplitude with its crest at the origin at t = 0.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import platformdirs
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.mesh import Mesh
from tlpsim.loads.bem.response import mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import added_mass_limit, discretize, solve
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import STANDARD_GRAVITY, require_positive

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SCHEMA = "tlpsim hydrodynamic database 1"
_REVISION = "1"  # of the solver: a change of its numbers changes every key

CONVENTIONS = {
    "time_factor": "exp(+i omega t)",
    "heading": "direction of propagation, anticlockwise from +x",
    "axes": "z up from the still water level",
    "reference_point": "origin",
    "modes": "surge, sway, heave, roll, pitch, yaw",
    "mean_drift_components": "surge, sway, yaw; far field",
}

_UNITS = {
    "omega": "rad/s",
    "heading": "rad",
    "added_mass": "kg, kg m, kg m2",
    "radiation_damping": "kg/s, kg m/s, kg m2/s",
    "excitation_force": "N/m, N",
    "froude_krylov_force": "N/m, N",
    "added_mass_infinite": "kg, kg m, kg m2",
    "added_mass_zero": "kg, kg m, kg m2",
    "mean_drift": "N/m2, N/m",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class HydrodynamicDatabase:
    """Coefficients of one hull in six degrees of freedom.

    Attributes
    ----------
    omega, heading
        (frequencies,) in rad/s, ascending; (headings,) in rad.
    depth, density, gravity
        In m (infinity for deep water), kg/m³, m/s².
    added_mass, radiation_damping
        (frequencies, 6, 6).
    excitation_force, froude_krylov_force
        (headings, frequencies, 6) complex.
    added_mass_infinite, added_mass_zero
        (6, 6) at infinite and zero frequency.
    mean_drift
        (headings, frequencies, 3): surge, sway, yaw.
    key
        Hash of what the numbers depend on.
    """

    omega: FloatArray
    heading: FloatArray
    depth: float
    density: float
    gravity: float
    added_mass: FloatArray
    radiation_damping: FloatArray
    excitation_force: ComplexArray
    froude_krylov_force: ComplexArray
    added_mass_infinite: FloatArray
    added_mass_zero: FloatArray
    mean_drift: FloatArray
    key: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """All that a database depends on. With `mass` and `stiffness` None the drift is that of the fixed body."""

    mesh: Mesh
    omega: FloatArray
    heading: FloatArray
    lid: Mesh | None = None
    depth: float = np.inf
    density: float = 1025.0
    gravity: float = STANDARD_GRAVITY
    mass: FloatArray | None = None
    stiffness: FloatArray | None = None


def problem_key(problem: Problem) -> str:
    """SHA-256 of the content of a problem; names and the order of attributes do not matter."""
    digest = hashlib.sha256(f"{SCHEMA}/{_REVISION}".encode())
    parts: list[ArrayLike | None] = [
        problem.mesh.vertices,
        None if problem.lid is None else problem.lid.vertices,
        problem.omega,
        problem.heading,
        [problem.depth, problem.density, problem.gravity],
        problem.mass,
        problem.stiffness,
    ]
    digest.update(repr(problem.mesh.planes).encode())
    for part in parts:
        array = np.zeros(0) if part is None else np.ascontiguousarray(part, dtype=np.float64) + 0.0
        digest.update(repr(array.shape).encode() + array.tobytes())
    return digest.hexdigest()


def compute(problem: Problem, progress: Callable[[int, int], None] = lambda done, total: None) -> HydrodynamicDatabase:
    """Solve a problem at all its frequencies; `progress(done, total)` is called after each.

    Raises
    ------
    ScenarioError
        If frequencies are not positive and ascending, or only one of mass and stiffness is given.
    """
    omega = np.atleast_1d(np.asarray(problem.omega, dtype=np.float64))
    require_positive("angular frequency", omega, "rad/s")
    if np.any(np.diff(omega) <= 0.0):
        raise ScenarioError(f"frequencies {np.array2string(omega, threshold=6)} rad/s do not ascend; sort them")
    if (problem.mass is None) != (problem.stiffness is None):
        raise ScenarioError("the mean drift of a moving body needs both its mass and its stiffness; give both or none")
    body = discretize(problem.mesh, problem.depth, problem.lid)
    solutions, drift = [], []
    for index, value in enumerate(omega):
        solution = solve(body, float(value), problem.heading, problem.density, problem.gravity)
        motion = np.zeros((len(solution.headings), 6), dtype=np.complex128)
        if problem.mass is not None and problem.stiffness is not None:
            motion = response_amplitudes(solution, problem.mass, problem.stiffness)
        drift.append(mean_drift(body, solution, motion))
        solutions.append(solution)
        progress(index + 1, len(omega))
    return HydrodynamicDatabase(
        omega=omega,
        heading=solutions[0].headings,
        depth=problem.depth,
        density=problem.density,
        gravity=problem.gravity,
        added_mass=np.stack([s.added_mass for s in solutions]),
        radiation_damping=np.stack([s.radiation_damping for s in solutions]),
        excitation_force=np.stack([s.excitation_force for s in solutions], axis=1),
        froude_krylov_force=np.stack([s.froude_krylov_force for s in solutions], axis=1),
        added_mass_infinite=added_mass_limit(body, -1.0, problem.density),
        added_mass_zero=added_mass_limit(body, 1.0, problem.density),
        mean_drift=np.stack(drift, axis=1),
        key=problem_key(problem),
    )


def write(database: HydrodynamicDatabase, path: str | Path) -> None:
    """Write a database as HDF5."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(target.name + ".part")
    with h5py.File(part, "w") as file:
        file.attrs["schema"] = SCHEMA
        for name, text in CONVENTIONS.items():
            file.attrs[name] = text
        for name in ("depth", "density", "gravity", "key"):
            file.attrs[name] = getattr(database, name)
        for name, unit in _UNITS.items():
            file.create_dataset(name, data=getattr(database, name)).attrs["unit"] = unit
    part.replace(target)  # a reader never sees half a file


def read(path: str | Path) -> HydrodynamicDatabase:
    """Read a database.

    Raises
    ------
    ScenarioError
        If the file is missing or is no database of this schema.
    """
    try:
        with h5py.File(path, "r") as file:
            schema = file.attrs.get("schema", "none")
            if schema != SCHEMA:
                raise ScenarioError(f"{path}: schema is '{schema}', '{SCHEMA}' is needed; compute it again")
            content: dict[str, Any] = {name: np.asarray(file[name]) for name in _UNITS}
            content |= {name: float(file.attrs[name]) for name in ("depth", "density", "gravity")}
            return HydrodynamicDatabase(**content, key=str(file.attrs["key"]))
    except (OSError, KeyError) as error:
        raise ScenarioError(f"{path}: not a hydrodynamic database ({error}); compute it again") from error


def cached(
    problem: Problem,
    directory: str | Path | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> HydrodynamicDatabase:
    """Database of a problem, read from the cache if the same problem was solved before.

    Parameters
    ----------
    directory
        Where databases are kept; the user's cache directory if None.
    """
    folder = platformdirs.user_cache_path("tlpsim") / "bem" if directory is None else Path(directory)
    path = folder / f"{problem_key(problem)}.h5"
    if path.exists():
        return read(path)
    database = compute(problem, progress)
    write(database, path)
    return database
