from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.exchange import read_capytaine, read_wamit, write_wamit
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.errors import ScenarioError

DATABASE = compute(Problem(mesh=box(2.0, 1.0, 0.5, 0.5), omega=np.array([0.5, 1.0]), heading=np.array([0.0, 0.4])))


def test_wamit_files_give_the_coefficients_back(tmp_path: Path) -> None:
    write_wamit(DATABASE, tmp_path / "hull")
    again = read_wamit(tmp_path / "hull", np.inf)
    names = ("omega", "heading", "added_mass", "radiation_damping", "excitation_force", "added_mass_infinite")
    for name in (*names, "added_mass_zero"):
        expected = getattr(DATABASE, name)
        np.testing.assert_allclose(getattr(again, name), expected, rtol=1e-6, atol=1e-6 * np.max(np.abs(expected)))


def test_phase_of_wamit_is_the_lead_over_the_wave(tmp_path: Path) -> None:
    write_wamit(DATABASE, tmp_path / "hull")
    row = next(line.split() for line in (tmp_path / "hull.3").read_text().splitlines() if line.split()[2] == "3")
    force = DATABASE.excitation_force[0, 0, 2]
    assert float(row[4]) == pytest.approx(np.degrees(np.angle(force)), abs=1e-4)


def test_capytaine_phases_are_turned(tmp_path: Path) -> None:
    path = tmp_path / "capytaine.nc"
    force = np.moveaxis(DATABASE.excitation_force, 0, 1).conj()
    with h5py.File(path, "w") as file:
        file["water_depth"], file["rho"], file["g"] = np.inf, 1025.0, 9.80665
        file["omega"], file["wave_direction"] = DATABASE.omega, DATABASE.heading
        file["added_mass"], file["radiation_damping"] = DATABASE.added_mass, DATABASE.radiation_damping
        file["excitation_force"] = np.stack([force.real, force.imag])
    again = read_capytaine(path, np.inf)
    np.testing.assert_array_equal(again.excitation_force, DATABASE.excitation_force)
    np.testing.assert_array_equal(again.added_mass, DATABASE.added_mass)
    with pytest.raises(ScenarioError, match="depths are"):
        read_capytaine(path, 10.0)


def test_files_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="stem"):
        read_wamit(tmp_path / "none", np.inf)
    with pytest.raises(ScenarioError, match="Capytaine"):
        read_capytaine(tmp_path / "none.nc", np.inf)
