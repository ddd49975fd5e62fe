"""Capytaine's NetCDF datasets, read and written; conventions in `tlpsim.loads.bem.exchange.conventions`.

Dimensions are told by their names (water_depth, omega, wave_direction, influenced_dof, radiating_dof, complex), in any
order. Frequencies 0 and infinity become A(0) and A(∞). Written files hold finite frequencies, so that any reader
can take them, and A(0), A(∞) and the mean drift as variables of their own, which Capytaine does not know.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.exchange.conventions import CONVENTIONS, MODES, about_origin, assembled, turned
from tlpsim.loads.constants import HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.whole_file import whole_file

FloatArray = NDArray[np.float64]

DEGREES_OF_FREEDOM = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
_SIGN = CONVENTIONS["Capytaine"].time_sign
_MATRIX = ("water_depth", "omega", "influenced_dof", "radiating_dof")
_FORCE = ("complex", "water_depth", "wave_direction", "omega", "influenced_dof")
# Order in which Capytaine writes the dimensions, for a file without names of them, by their number.
_USUAL: dict[int, tuple[str, ...]] = {4: _MATRIX, 3: _MATRIX[1:]}
_USUAL_FORCE: dict[int, tuple[str, ...]] = {
    5: ("complex", "water_depth", "omega", "wave_direction", "influenced_dof"),
    4: ("complex", "omega", "wave_direction", "influenced_dof"),
}
_EXTRAS = {"added_mass_infinite": "kg", "added_mass_zero": "kg"}


def read_capytaine(path: str | Path, depth: float) -> HydrodynamicDatabase:
    """Database of one water depth (m, or infinity) in a NetCDF file of Capytaine, in its six rigid-body modes.

    Raises
    ------
    ScenarioError
        If the file is missing, lacks a variable, a mode or a frequency, or has no such depth.
    """
    try:
        with h5py.File(path, "r") as file:
            return _database(file, path, depth)
    except (OSError, KeyError, ValueError) as error:
        raise ScenarioError(f"{path}: not a NetCDF file of Capytaine ({error})") from error


def _database(file: h5py.File, path: str | Path, depth: float) -> HydrodynamicDatabase:
    depths = np.atleast_1d(np.asarray(file["water_depth"], dtype=np.float64))
    found = np.flatnonzero(np.isclose(depths, depth, rtol=1e-6, atol=0.0))
    if len(found) == 0:
        raise ScenarioError(f"{path}: depths are {depths.tolist()} m, not {depth} m; choose one of these")
    index = int(found[0])
    omega = np.atleast_1d(np.asarray(file["omega"], dtype=np.float64))
    finite = np.isfinite(omega) & (omega > 0.0)
    if not np.any(finite):
        raise ScenarioError(f"{path}: no frequency between zero and infinity; solve for some")
    forces, motions = _places(file, path, "influenced_dof"), _places(file, path, "radiating_dof")

    def matrix(name: str) -> FloatArray:
        return _ordered(file[name], _MATRIX, _USUAL, index)[:, forces][:, :, motions]

    def force(name: str) -> NDArray[np.complex128]:
        parts = _ordered(file[name], _FORCE, _USUAL_FORCE, index)[..., forces]
        return turned(parts[0] + 1j * parts[1], _SIGN)[:, finite]

    mass = matrix("added_mass")
    heading = np.atleast_1d(np.asarray(file["wave_direction"], dtype=np.float64))
    unit = file["wave_direction"].attrs.get("units", b"rad")
    if (unit.decode() if isinstance(unit, bytes) else str(unit)).startswith("deg"):
        heading = np.radians(heading)
    known: dict[str, Any] = {name: np.asarray(file[name]) for name in _EXTRAS if name in file}
    for name, value in (("added_mass_zero", 0.0), ("added_mass_infinite", np.inf)):
        if np.any(omega == value):
            known[name] = mass[np.flatnonzero(omega == value)[0]]
    if "Froude_Krylov_force" in file:
        known["froude_krylov_force"] = force("Froude_Krylov_force")
    if "mean_drift" in file:
        known["mean_drift"] = np.asarray(file["mean_drift"])
    database = assembled(
        omega=omega[finite],
        heading=heading,
        depth=depth,
        density=float(np.asarray(file["rho"])),
        gravity=float(np.asarray(file["g"])),
        added_mass=mass[finite],
        radiation_damping=matrix("radiation_damping")[finite],
        excitation_force=force("excitation_force"),
        **known,
    )
    point = np.asarray(file["rotation_center"], dtype=np.float64) if "rotation_center" in file else np.zeros(3)
    return about_origin(database, point)


def _places(file: h5py.File, path: str | Path, axis: str) -> list[int]:
    """Where the six modes stand among the degrees of freedom of a file; in their order where it has no names."""
    if axis not in file:
        return list(range(MODES))
    names = [
        (name.decode() if isinstance(name, bytes) else str(name)).rpartition("__")[2].strip().lower()
        for name in np.atleast_1d(np.asarray(file[axis]))
    ]
    wanted = [name.lower() for name in DEGREES_OF_FREEDOM]
    missing = [name for name in wanted if name not in names]
    if missing or len(set(names)) < len(names):
        raise ScenarioError(
            f"{path}: degrees of freedom are {', '.join(names)}; the six of one rigid body are needed: "
            "give the body add_all_rigid_body_dofs() and solve it alone"
        )
    return [names.index(name) for name in wanted]


def _ordered(
    dataset: h5py.Dataset, wanted: tuple[str, ...], usual: dict[int, tuple[str, ...]], depth_index: int
) -> FloatArray:
    """A variable at one depth with its dimensions in the order `wanted`; others must have length 1."""
    array = np.asarray(dataset, dtype=np.float64)
    names = [str(dim[0].name).rpartition("/")[2] if len(dim) else "" for dim in dataset.dims]
    if not all(names):
        names = list(usual[array.ndim])
    for axis in reversed(range(array.ndim)):
        if names[axis] not in wanted:
            if array.shape[axis] != 1:
                raise ValueError(f"{dataset.name} depends on {names[axis]}")
            array, names = array.squeeze(axis), names[:axis] + names[axis + 1 :]
    for name in wanted:
        if name not in names:  # a scalar coordinate
            if name == "complex":
                raise ValueError(f"{dataset.name} has no real and imaginary part")
            array, names = array[None], [name, *names]
    array = np.transpose(array, [names.index(name) for name in wanted])
    depth_axis = wanted.index("water_depth")
    taken = depth_index if array.shape[depth_axis] > 1 else 0
    return np.asarray(np.take(array, taken, axis=depth_axis))


def write_capytaine(database: HydrodynamicDatabase, path: str | Path) -> None:
    """Write a database as Capytaine writes its datasets: HDF5 that netCDF4 and xarray read.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    with whole_file(path, "the dataset") as part, h5py.File(part, "w", track_order=True) as file:
        _fill(file, database)


def _fill(file: h5py.File, database: HydrodynamicDatabase) -> None:
    axes = {
        "complex": np.array(["re", "im"], dtype=object),
        "omega": database.omega,
        "wave_direction": database.heading,
        "influenced_dof": np.array(DEGREES_OF_FREEDOM, dtype=object),
        "radiating_dof": np.array(DEGREES_OF_FREEDOM, dtype=object),
    }
    if database.mean_drift.shape[2] == MODES:
        axes["drift_component"] = axes["influenced_dof"]
    else:
        axes["drift_component"] = np.array([DEGREES_OF_FREEDOM[mode] for mode in HORIZONTAL], dtype=object)
    units = {"omega": "rad/s", "wave_direction": "rad"}
    for name, values in axes.items():
        kind = h5py.string_dtype() if values.dtype == object else None
        axis = file.create_dataset(name, data=values, dtype=kind)
        axis.make_scale(name)
        if name in units:
            axis.attrs["units"] = units[name]
    for name, unit, value in (
        ("water_depth", "m", database.depth),
        ("rho", "kg/m3", database.density),
        ("g", "m/s2", database.gravity),
        ("forward_speed", "m/s", 0.0),
    ):
        file.create_dataset(name, data=float(value)).attrs["units"] = unit
    number = np.array([float(wavenumber(omega, database.depth, database.gravity)) for omega in database.omega])
    _variable(file, "period", 2.0 * np.pi / database.omega, ("omega",))
    _variable(file, "wavenumber", number, ("omega",))
    _variable(file, "wavelength", 2.0 * np.pi / number, ("omega",))
    modes = ("influenced_dof", "radiating_dof")
    _variable(file, "added_mass", database.added_mass, ("omega", *modes))
    _variable(file, "radiation_damping", database.radiation_damping, ("omega", *modes))
    waves = ("complex", "omega", "wave_direction", "influenced_dof")
    for name, force in (
        ("excitation_force", database.excitation_force),
        ("Froude_Krylov_force", database.froude_krylov_force),
        ("diffraction_force", database.excitation_force - database.froude_krylov_force),
    ):
        there = np.moveaxis(turned(force, _SIGN), 0, 1)
        _variable(file, name, np.stack([there.real, there.imag]), waves)
    for name in _EXTRAS:
        _variable(file, name, getattr(database, name), modes)
    _variable(file, "mean_drift", database.mean_drift, ("wave_direction", "omega", "drift_component"))
    if database.hydrostatics is not None:  # as for a centre of mass in the origin
        _variable(file, "hydrostatic_stiffness", database.hydrostatics.stiffness, modes)


def _variable(file: h5py.File, name: str, data: FloatArray, dims: tuple[str, ...]) -> None:
    variable = file.create_dataset(name, data=data)
    for axis, dim in enumerate(dims):
        variable.dims[axis].attach_scale(file[dim])
