"""Capytaine's NetCDF: files as it writes them, made here by h5py, and our own as xarray reads them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.exchange import read_capytaine, write_capytaine
from tlpsim.loads.bem.exchange.capytaine import DEGREES_OF_FREEDOM
from tlpsim.loads.bem.exchange.conventions import moments_arm
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.bem.mesh import translated
from tlpsim.loads.errors import ScenarioError

MESH = translated(box(2.0, 1.0, 0.5, 0.5), [0.3, -0.2, 0.0])
DATABASE = compute(Problem(mesh=MESH, omega=np.array([0.5, 1.0]), heading=np.array([0.0, 0.4]), depth=8.0))
MATRICES = ("added_mass", "radiation_damping")


def sample(path: Path, order: list[int] | None = None, changes: Callable[[h5py.File], None] | None = None) -> Path:
    """A file as Capytaine 3 writes it: dimensions by name, two depths, frequencies 0 and infinity, conjugate phases."""
    order = order or list(range(6))
    omega = np.array([0.0, *DATABASE.omega, np.inf])
    mass = np.stack([DATABASE.added_mass_infinite * 2.0, *DATABASE.added_mass, DATABASE.added_mass_infinite])
    damping = np.concatenate([np.zeros((1, 6, 6)), DATABASE.radiation_damping, np.zeros((1, 6, 6))])
    waves = np.moveaxis(DATABASE.excitation_force, 0, 1)
    force = np.concatenate([np.full((1, 2, 6), np.nan), waves.conj(), np.full((1, 2, 6), np.nan)])[..., order]
    with h5py.File(path, "w") as file:
        axes = {
            "complex": np.array(["re", "im"], dtype=object),
            "water_depth": np.array([np.inf, 8.0]),
            "omega": omega,
            "wave_direction": DATABASE.heading,
            "influenced_dof": np.array([f"hull__{DEGREES_OF_FREEDOM[k]}" for k in order], dtype=object),
            "radiating_dof": np.array(DEGREES_OF_FREEDOM, dtype=object),
        }
        for name, values in axes.items():
            kind = h5py.string_dtype() if values.dtype == object else None
            file.create_dataset(name, data=values, dtype=kind).make_scale(name)
        file["rho"], file["g"] = 1025.0, 9.80665
        dims = ("water_depth", "omega", "influenced_dof", "radiating_dof")
        for name, values in zip(MATRICES, (mass[:, order], damping[:, order]), strict=True):
            attach(file, name, np.stack([np.zeros_like(values), values]), dims)
        parts = np.stack([force.real, force.imag])
        dims = ("complex", "water_depth", "omega", "wave_direction", "influenced_dof")
        attach(file, "excitation_force", np.stack([np.zeros_like(parts), parts], axis=1), dims)
        if changes is not None:
            changes(file)
    return path


def attach(file: h5py.File, name: str, values: np.ndarray, dims: tuple[str, ...]) -> None:
    variable = file.create_dataset(name, data=values)
    for axis, dim in enumerate(dims):
        variable.dims[axis].attach_scale(file[dim])


@pytest.mark.parametrize("order", [None, [5, 0, 3, 1, 2, 4]], ids=["usual", "shuffled"])
def test_file_of_capytaine_is_read(tmp_path: Path, order: list[int] | None) -> None:
    found = read_capytaine(sample(tmp_path / "capytaine.nc", order), 8.0)
    for name in ("omega", "heading", *MATRICES, "excitation_force", "added_mass_infinite"):
        np.testing.assert_array_equal(getattr(found, name), getattr(DATABASE, name), err_msg=name)
    np.testing.assert_array_equal(found.added_mass_zero, 2.0 * DATABASE.added_mass_infinite)
    assert np.all(np.isnan(found.mean_drift))
    assert found.depth == 8.0
    assert np.all(read_capytaine(tmp_path / "capytaine.nc", np.inf).added_mass == 0.0)


def test_headings_in_degrees_and_dimensions_in_another_order_are_taken(tmp_path: Path) -> None:
    def change(file: h5py.File) -> None:
        values = np.asarray(file["wave_direction"])
        file["wave_direction"][:] = np.degrees(values)
        file["wave_direction"].attrs["units"] = "degrees"
        force = np.asarray(file["excitation_force"])
        del file["excitation_force"]
        dims = ("wave_direction", "complex", "omega", "influenced_dof", "water_depth")
        attach(file, "excitation_force", np.transpose(force, (3, 0, 2, 4, 1)), dims)

    found = read_capytaine(sample(tmp_path / "capytaine.nc", changes=change), 8.0)
    np.testing.assert_allclose(found.heading, DATABASE.heading)
    np.testing.assert_array_equal(found.excitation_force, DATABASE.excitation_force)


def test_moments_about_another_point_are_moved(tmp_path: Path) -> None:
    point = np.array([0.5, -1.0, -2.0])
    found = read_capytaine(
        sample(tmp_path / "capytaine.nc", changes=lambda file: file.update({"rotation_center": point})), 8.0
    )
    turn = moments_arm(point)
    np.testing.assert_allclose(found.added_mass, turn @ DATABASE.added_mass @ turn.T)
    force = DATABASE.excitation_force
    np.testing.assert_allclose(found.excitation_force[..., 3:], force[..., 3:] + np.cross(point, force[..., :3]))


def test_written_file_gives_the_database_back(tmp_path: Path) -> None:
    write_capytaine(DATABASE, tmp_path / "hull.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["hull.nc"]
    found = read_capytaine(tmp_path / "hull.nc", 8.0)
    expected = replace(DATABASE, key="", hydrostatics=None, mesh=None)
    for name in expected.__dataclass_fields__:
        value = getattr(expected, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(found, name), value, err_msg=name)
        else:
            assert getattr(found, name) == value


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_written_file_is_one_for_xarray(tmp_path: Path, engine: str) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip({"h5netcdf": "h5netcdf", "netcdf4": "netCDF4"}[engine])
    write_capytaine(DATABASE, tmp_path / "hull.nc")
    with xarray.open_dataset(tmp_path / "hull.nc", engine=engine) as data:
        assert data.added_mass.dims == ("omega", "influenced_dof", "radiating_dof")
        chosen = data.added_mass.sel(omega=1.0, influenced_dof="Surge", radiating_dof="Pitch")
        assert float(chosen) == DATABASE.added_mass[1, 0, 4]
        force = data.excitation_force.sel(omega=0.5, influenced_dof="Heave")
        complete = force.sel(complex="re") + 1j * force.sel(complex="im")
        np.testing.assert_array_equal(complete.values, DATABASE.excitation_force[:, 0, 2].conj())
        assert float(data.period[0]) == pytest.approx(4.0 * np.pi)
        # k tanh kh = omega²/g
        number = data.wavenumber.values
        np.testing.assert_allclose(number * np.tanh(8.0 * number), DATABASE.omega**2 / 9.80665, rtol=1e-9)


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="Capytaine"):
        read_capytaine(tmp_path / "none.nc", np.inf)
    with pytest.raises(ScenarioError, match="depths are"):
        read_capytaine(sample(tmp_path / "one.nc"), 10.0)

    def spoil(file: h5py.File) -> None:
        del file["radiating_dof"]
        file["radiating_dof"] = np.array(["a", "b"], dtype=object)

    with pytest.raises(ScenarioError, match="rigid body"):
        read_capytaine(sample(tmp_path / "two.nc", changes=spoil), 8.0)
