"""The hydrodynamic database of a hull: coefficients against frequency, kept in HDF5 under a hash of all they depend on.

Conventions, in every file as attributes: SI units, z up from the still water level, forces and moments about the
origin, amplitudes exp(+i omega t), headings in rad of propagation anticlockwise from +x, excitation for a wave of unit
amplitude with its crest at the origin at t = 0. What an imported file does not tell is NaN, or not there.

With a second mesh of panels twice as long and wide, all coefficients are those of ever finer panels, each with an error
bar (`tlpsim.loads.bem.convergence`); motions and drift are extrapolated from what each mesh gives.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import platformdirs
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.convergence import Limit, limit, resolved_share
from tlpsim.loads.bem.discretization import Discretization, discretize
from tlpsim.loads.bem.hydrostatics import Hydrostatics, hydrostatics
from tlpsim.loads.bem.mesh import Mesh
from tlpsim.loads.bem.near_field import near_field_drift
from tlpsim.loads.bem.response import mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import Solution, added_mass_limit, solve
from tlpsim.loads.bem.surface import Hull, hull_surface
from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import whole_file

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SCHEMA_NAME = "tlpsim hydrodynamic database"
SCHEMA_VERSION = 2
SCHEMA = f"{SCHEMA_NAME} {SCHEMA_VERSION}"

CONVENTIONS = {
    "time_factor": "exp(+i omega t)",
    "heading": "direction of propagation, anticlockwise from +x",
    "axes": "z up from the still water level",
    "reference_point": "origin",
    "wave": "unit amplitude, crest at the origin at t = 0",
    "modes": "surge, sway, heave, roll, pitch, yaw",
    "mean_drift_components": "surge, sway, yaw; or surge, sway, heave, roll, pitch, yaw",
    "missing": "NaN",
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
_DIMENSIONS = {
    "omega": "frequency",
    "heading": "heading",
    "added_mass": "frequency, mode of the force, mode of the motion",
    "radiation_damping": "frequency, mode of the force, mode of the motion",
    "excitation_force": "heading, frequency, mode",
    "froude_krylov_force": "heading, frequency, mode",
    "added_mass_infinite": "mode of the force, mode of the motion",
    "added_mass_zero": "mode of the force, mode of the motion",
    "mean_drift": "heading, frequency, component",
    "response_amplitude": "heading, frequency, mode",
}
_HYDROSTATIC_UNITS = {
    "volume": "m3",
    "centre_of_buoyancy": "m",
    "waterplane_area": "m2",
    "waterplane_first_moments": "m3",
    "waterplane_second_moments": "m4",
    "stiffness": "N/m, N, N m",
}
ERROR_BARS = (
    "added_mass",  # before its limit at infinite frequency, of which it takes the difference of the meshes
    "radiation_damping",
    "excitation_force",
    "froude_krylov_force",
    "added_mass_infinite",
    "added_mass_zero",
    "mean_drift",
    "response_amplitude",
)
"""What is extrapolated, and has an error bar."""
_SOLVER = (
    "control_surface.py",
    "convergence.py",
    "database.py",
    "discretization.py",
    "field_points.py",
    "gradient.py",
    "green_deep.py",
    "green_finite.py",
    "green_path.py",
    "green_polynomials.py",
    "incident.py",
    "influence.py",
    "mesh.py",
    "near_field.py",
    "quadratic.py",
    "rankine.py",
    "response.py",
    "solver.py",
    "surface.py",
    "symmetry.py",
    "../waves/airy.py",
)
"""What the numbers of a database come from: a change in one of these files makes other numbers."""


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
        (headings, frequencies, 3): surge, sway, yaw; or (headings, frequencies, 6) through a control surface.
    key
        Hash of what the numbers depend on; "" for imported ones.
    response_amplitude
        (headings, frequencies, 6) complex, m/m and rad/m, of the body that the drift belongs to; None without a body.
    hydrostatics
        Of the hull; None where it is not known.
    mesh
        Wetted hull; None where it is not known.
    error
        Name of `ERROR_BARS` -> half-width of the bar, positive, of the shape of the value; empty where the values are
        those of one mesh.
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
    response_amplitude: ComplexArray | None = None
    hydrostatics: Hydrostatics | None = None
    mesh: Mesh | None = None
    error: Mapping[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """All that a database depends on. With `mass` and `stiffness` None the drift is that of the fixed body.

    `coarse` is a mesh of the same hull with panels twice as long and wide, `coarse_lid` its lid: with them the
    coefficients are extrapolated. The mean drift is that of the far field in surge, sway and yaw; with `vertical_drift`
    it is that through a control surface in all six degrees of freedom, which takes most of the time.
    """

    mesh: Mesh
    omega: FloatArray
    heading: FloatArray
    lid: Mesh | None = None
    depth: float = np.inf
    density: float = 1025.0
    gravity: float = STANDARD_GRAVITY
    mass: FloatArray | None = None
    stiffness: FloatArray | None = None
    coarse: Mesh | None = None
    coarse_lid: Mesh | None = None
    vertical_drift: bool = False


@cache
def _solver_digest() -> str:
    """Hash of the solver itself: numbers of another solver are other numbers."""
    digest = hashlib.sha256()
    for name in _SOLVER:
        digest.update((Path(__file__).parent / name).read_bytes())
    return digest.hexdigest()


def problem_key(problem: Problem) -> str:
    """SHA-256 of the content of a problem and of the solver; names and the order of attributes do not matter."""
    digest = hashlib.sha256(f"{SCHEMA}/{_solver_digest()}".encode())
    parts: list[ArrayLike | None] = [
        problem.mesh.vertices,
        None if problem.lid is None else problem.lid.vertices,
        np.atleast_1d(problem.omega),
        np.atleast_1d(problem.heading),
        [problem.depth, problem.density, problem.gravity, problem.vertical_drift],
        problem.mass,
        problem.stiffness,
        None if problem.coarse is None else problem.coarse.vertices,
        None if problem.coarse_lid is None else problem.coarse_lid.vertices,
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
    still = hydrostatics(problem.mesh, problem.density, problem.gravity)
    bodies = [discretize(problem.mesh, problem.depth, problem.lid)]
    if problem.coarse is not None:
        bodies.append(discretize(problem.coarse, problem.depth, problem.coarse_lid))
    surfaces = [hull_surface(body) if problem.vertical_drift else None for body in bodies]
    solved: list[list[_AtFrequency]] = [[] for _ in bodies]
    for index, value in enumerate(omega):
        for body, surface, results in zip(bodies, surfaces, solved, strict=True):
            results.append(_at_frequency(problem, body, surface, float(value)))
        progress(index + 1, len(omega))
    content, *coarse = (_coefficients(problem, *pair) for pair in zip(bodies, solved, strict=True))
    error: dict[str, FloatArray] = {}
    for rough in coarse:
        numbers = [result.solution.wavenumber for result in solved[0]]
        share = resolved_share(problem.coarse, numbers)  # type: ignore[arg-type]
        for name in ERROR_BARS:
            if content[name] is None:
                continue
            axes = _DIMENSIONS[name].split(", ")
            part = share.reshape([-1 if axis == "frequency" else 1 for axis in axes]) if "frequency" in axes else 1.0
            steady = 0.0
            if name == "added_mass":  # of which the part without waves keeps its correction in short waves
                steady = content["added_mass_infinite"] - rough["added_mass_infinite"]
            content[name], error[name] = limit_where_finite(content[name], rough[name], part, steady)
    return HydrodynamicDatabase(
        omega=omega,
        heading=np.atleast_1d(np.asarray(problem.heading, dtype=np.float64)),
        depth=problem.depth,
        density=problem.density,
        gravity=problem.gravity,
        key=problem_key(problem),
        hydrostatics=still,
        mesh=problem.mesh,
        error=error,
        **content,
    )


def limit_where_finite(fine: NDArray, coarse: NDArray, share: ArrayLike = 1.0, steady: ArrayLike = 0.0) -> Limit:
    """Limit of two meshes; an infinite value stays, with a bar that is NaN."""
    finite = np.isfinite(fine) & np.isfinite(coarse)
    value, error = limit(np.where(finite, fine, 0.0), np.where(finite, coarse, 0.0), share, steady)
    return Limit(np.where(finite, value, fine), np.where(finite, error, np.nan))


class _AtFrequency(NamedTuple):
    solution: Solution
    motion: ComplexArray
    drift: FloatArray


def _at_frequency(problem: Problem, body: Discretization, surface: Hull | None, omega: float) -> _AtFrequency:
    solution = solve(body, omega, problem.heading, problem.density, problem.gravity)
    motion = np.zeros((len(solution.headings), 6), dtype=np.complex128)
    if problem.mass is not None and problem.stiffness is not None:
        motion = response_amplitudes(solution, problem.mass, problem.stiffness)
    if problem.vertical_drift:
        drift = near_field_drift(body, solution, motion, hull=surface)
    else:
        drift = mean_drift(body, solution, motion)
    nothing = np.zeros(0, dtype=np.complex128)
    light = replace(solution, radiation=nothing, diffraction=nothing)  # potentials are not kept
    return _AtFrequency(solution=light, motion=motion, drift=drift)


def _coefficients(problem: Problem, body: Discretization, results: Sequence[_AtFrequency]) -> dict[str, Any]:
    """Coefficients on one mesh, by the names of the database's fields."""
    solutions = [result.solution for result in results]
    return {
        "added_mass": np.stack([s.added_mass for s in solutions]),
        "radiation_damping": np.stack([s.radiation_damping for s in solutions]),
        "excitation_force": np.stack([s.excitation_force for s in solutions], axis=1),
        "froude_krylov_force": np.stack([s.froude_krylov_force for s in solutions], axis=1),
        "added_mass_infinite": added_mass_limit(body, -1.0, problem.density),
        "added_mass_zero": added_mass_limit(body, 1.0, problem.density),
        "mean_drift": np.stack([result.drift for result in results], axis=1),
        "response_amplitude": None if problem.mass is None else np.stack([result.motion for result in results], axis=1),
    }


def write(database: HydrodynamicDatabase, path: str | Path) -> None:
    """Write a database as HDF5; the file is there when it is complete.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    with whole_file(path, "the database") as part, h5py.File(part, "w") as file:
        _fill(file, database)


def _fill(file: h5py.File, database: HydrodynamicDatabase) -> None:
    file.attrs["schema"] = SCHEMA
    for name, text in CONVENTIONS.items():
        file.attrs[name] = text
    for name in ("depth", "density", "gravity", "key"):
        file.attrs[name] = getattr(database, name)
    for name, unit in _UNITS.items():
        _dataset(file, name, getattr(database, name), unit).attrs["dimensions"] = _DIMENSIONS[name]
    if database.response_amplitude is not None:
        name = "response_amplitude"
        _dataset(file, name, database.response_amplitude, "m/m, rad/m").attrs["dimensions"] = _DIMENSIONS[name]
    if database.error:
        group = file.create_group("error")
        group.attrs["note"] = "half-width of the bar about the value of the same name, from two meshes"
        for name, data in database.error.items():
            group.create_dataset(name, data=data)
    if database.mesh is not None:
        group = file.create_group("mesh")
        group.attrs["name"] = database.mesh.name
        group.attrs["planes"] = " ".join(database.mesh.planes)
        _dataset(group, "vertices", database.mesh.vertices, "m").attrs["dimensions"] = "panel, vertex, coordinate"
    if database.hydrostatics is not None:
        group = file.create_group("hydrostatics")
        for name, unit in _HYDROSTATIC_UNITS.items():
            _dataset(group, name, getattr(database.hydrostatics, name), unit)
        group["stiffness"].attrs["note"] = "of buoyancy and water plane; without the terms of the centre of gravity"


def _dataset(group: h5py.Group, name: str, data: Any, unit: str) -> h5py.Dataset:
    dataset = group.create_dataset(name, data=data)
    dataset.attrs["unit"] = unit
    return dataset


def is_database(path: str | Path) -> bool:
    """Whether a file is a hydrodynamic database, of this or another schema."""
    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs.get("schema", "")).startswith(SCHEMA_NAME)
    except OSError:
        return False


def read(path: str | Path) -> HydrodynamicDatabase:
    """Read a database.

    Raises
    ------
    ScenarioError
        If the file is missing or is no database of this schema.
    """
    try:
        with h5py.File(path, "r") as file:
            _require_schema(path, str(file.attrs.get("schema", "none")))
            content: dict[str, Any] = {name: np.asarray(file[name]) for name in _UNITS}
            content |= {name: float(file.attrs[name]) for name in ("depth", "density", "gravity")}
            if "response_amplitude" in file:
                content["response_amplitude"] = np.asarray(file["response_amplitude"])
            if "mesh" in file:
                planes = tuple(str(file["mesh"].attrs["planes"]).split())
                vertices = np.asarray(file["mesh/vertices"])
                content["mesh"] = Mesh(name=str(file["mesh"].attrs["name"]), vertices=vertices, planes=planes)
            if "error" in file:
                content["error"] = {
                    name: np.asarray(file["error"][name]) for name in ERROR_BARS if name in file["error"]
                }
            if "hydrostatics" in file:
                content["hydrostatics"] = _read_hydrostatics(file["hydrostatics"])
            return HydrodynamicDatabase(**content, key=str(file.attrs["key"]))
    except (OSError, KeyError) as error:
        raise ScenarioError(
            f"{path}: not a hydrodynamic database ({error}); make one with `tlpsim bem HULL -o {path}`"
        ) from error


def _require_schema(path: str | Path, found: str) -> None:
    name, _, version = found.rpartition(" ")
    if found == SCHEMA:
        return
    remedy = f"make it with `tlpsim bem HULL -o {path}`"
    if name == SCHEMA_NAME and version.isdigit():
        remedy = f"compute it again with `tlpsim bem HULL -o {path}`"
        if int(version) > SCHEMA_VERSION:
            remedy = "it comes from a newer tlpsim: install that one"
    raise ScenarioError(f"{path}: schema is '{found}', '{SCHEMA}' is needed; {remedy}")


def _read_hydrostatics(group: h5py.Group) -> Hydrostatics:
    content = {item.name: np.asarray(group[item.name]) for item in fields(Hydrostatics)}
    scalars = {name: float(value) for name, value in content.items() if value.ndim == 0}
    return Hydrostatics(**{**content, **scalars})  # type: ignore[arg-type]


def cache_path(problem: Problem, directory: str | Path | None = None) -> Path:
    """File that keeps the database of a problem: in `directory`, in the user's cache if None."""
    folder = platformdirs.user_cache_path("tlpsim") / "bem" if directory is None else Path(directory)
    return folder / f"{problem_key(problem)}.h5"


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
    progress
        Called as `progress(done, total)` after each frequency that is solved.
    """
    path = cache_path(problem, directory)
    if path.exists():
        try:
            return read(path)
        except ScenarioError:  # a damaged file is made again
            path.unlink()
    database = compute(problem, progress)
    try:
        write(database, path)
    except ScenarioError as error:  # the numbers are there, but for this time only
        warnings.warn(str(error), stacklevel=2)
    return database
