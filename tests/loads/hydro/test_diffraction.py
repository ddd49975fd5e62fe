"""Excitation by interpolation: planes of symmetry, long waves, the boundary elements themselves, the kernels."""

from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import HydrodynamicDatabase, compute
from tlpsim.loads.bem.issc import HIGHEST_FREQUENCY, LOWEST_FREQUENCY, issc_database, issc_problem
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.convolution import kernel_response
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.hydro.diffraction import (
    TAPER,
    band_of_energy,
    excitation,
    excitation_transfer,
    reflection,
    require_coverage,
    require_site,
    round_the_circle,
)
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.elevation import ArmaSea, transition
from tlpsim.loads.waves.field import regular_wave
from tlpsim.loads.waves.sea import SeaState
from tlpsim.loads.waves.spectra import SpectrumTable


@pytest.fixture(scope="module")
def issc() -> HydrodynamicDatabase:
    return issc_database()


STORM = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=14.5, heading=0.4, water_depth=450.0)


def morison(heading: float, omega: float = 0.7) -> np.ndarray:
    """Force (6,) of Morison's equation, whose symmetry is that of the members, to which no plane was ever told."""
    sea = regular_wave(amplitude=1.0, period=2.0 * np.pi / omega, heading=heading, water_depth=450.0)
    return inertia_transfer(issc_members(), sea)[:, 0]


@pytest.mark.parametrize("plane", [0.0, 0.25 * np.pi, 0.5 * np.pi])
def test_reflection_of_the_wave_reflects_the_force(plane: float) -> None:
    for heading in (0.0, 0.3, 1.2):
        there = morison(2.0 * plane - heading)
        np.testing.assert_allclose(there, reflection(plane) @ morison(heading), atol=1e-9 * np.abs(there).max())


@pytest.mark.parametrize(("last", "count"), [(45.0, 4), (90.0, 7), (180.0, 13)])
def test_headings_are_completed_by_symmetry(last: float, count: int) -> None:
    given = np.radians(np.linspace(0.0, last, count))
    headings, forces = round_the_circle(given, np.array([[morison(b)] for b in given]))
    np.testing.assert_allclose(headings, np.radians(15.0) * np.arange(24), atol=1e-9)
    expected = np.array([[morison(b)] for b in headings])
    np.testing.assert_allclose(forces, expected, atol=1e-9 * np.abs(expected).max())


def test_a_hull_without_symmetry_is_left_alone() -> None:
    given = np.radians([0.0, 15.0, 30.0, 45.0])
    turned = np.array([[morison(b + 0.2)] for b in given])
    headings, _ = round_the_circle(given, turned)
    np.testing.assert_allclose(headings, given)


def test_between_the_grid_points_it_is_what_the_panels_give(issc: HydrodynamicDatabase) -> None:
    """A frequency half way between two of the database and a heading that it has not, solved for on their own."""
    heading, frequencies = np.radians(-163.1), np.array([0.43, 0.71])
    panels = compute(replace(issc_problem(), omega=frequencies, heading=np.array([heading])))
    for omega, exact in zip(frequencies, panels.excitation_force[0], strict=True):
        found = excitation_transfer(issc, np.array([omega]), np.array([heading]), 450.0)[:, 0]
        # A cubic spline through half a radian of phase a step: 0.1 %; of the largest of force and of moment.
        for part in (slice(0, 3), slice(3, 6)):
            np.testing.assert_allclose(found[part], exact[part], atol=2e-3 * np.abs(exact[part]).max())


def test_long_waves_lift_the_water_plane_and_push_the_mass(issc: HydrodynamicDatabase) -> None:
    """Far below the database: rho g A_w in heave, and (rho V + A11) i g k in surge, the water accelerated with it."""
    omega = np.array([0.02])
    assert omega[0] < LOWEST_FREQUENCY
    found = excitation_transfer(issc, omega, np.zeros(1), 450.0)[:, 0]
    number = wavenumber(omega, 450.0)[0]
    displaced = issc.density * issc_tlp.DISPLACED_VOLUME + issc.added_mass_zero[0, 0]
    # Heave is that of the lowest frequency, where the water's vertical acceleration has taken a little of it.
    lift = issc.density * issc.gravity * issc_tlp.WATERPLANE_AREA
    lift -= (issc.density * issc_tlp.DISPLACED_VOLUME + issc.added_mass[0, 2, 2]) * issc.omega[0] ** 2
    assert found[2].real == pytest.approx(lift, rel=0.015)
    assert found[0].imag == pytest.approx(displaced * issc.gravity * number, rel=0.02)
    assert np.abs(found[[1, 3, 5]]).max() < 1e-3 * np.abs(found[0])


def test_above_the_database_the_force_goes_to_zero(issc: HydrodynamicDatabase) -> None:
    top = issc.omega[-1]
    assert top == pytest.approx(HIGHEST_FREQUENCY)
    at = top * np.array([1.0, 1.0 + 0.5 * TAPER, 1.0 + TAPER, 2.0])
    found = np.abs(excitation_transfer(issc, at, np.full(4, 0.3), 450.0))
    np.testing.assert_allclose(found[:, 1], 0.5 * found[:, 0])
    np.testing.assert_allclose(found[:, 2:], 0.0, atol=1e-9 * found.max())


def test_kernels_have_the_spectrum_of_the_transfer_functions(issc: HydrodynamicDatabase) -> None:
    """Standard deviation of each force by the response of the kernels, and by X² S in the band where waves act."""
    sea = ArmaSea(STORM, sampling_step=0.5, reach=100.0)
    kernels = sea.kernels(excitation(issc)(sea))
    frequency = np.linspace(1e-4, 0.999, 8000)
    gain = kernel_response(kernels, frequency, 0.5, sea.half)
    made = spectrum(sea.model, frequency)[:, 0, 0].real
    found = np.sqrt(np.abs(gain.T) ** 2 @ made)
    transfer = excitation_transfer(issc, 2.0 * np.pi * frequency, np.full(len(frequency), 0.4), 450.0)
    wanted = STORM.density(frequency) * transition(frequency, STORM.highest_frequency) ** 2
    exact = np.sqrt(np.abs(transfer) ** 2 @ wanted)
    np.testing.assert_allclose(found, exact, rtol=0.01)


def test_a_database_must_cover_the_waves(issc: HydrodynamicDatabase) -> None:
    require_coverage(issc, STORM)
    low, high = band_of_energy(STORM)
    share = [np.trapezoid(STORM.density(f), f) for f in (np.linspace(0.001, 0.35, 9999), np.linspace(low, high, 9999))]
    assert share[1] / share[0] == pytest.approx(0.999, abs=2e-4)
    narrow = SpectrumTable(frequency=np.array([0.10003, 0.10005, 0.10007]), density=np.array([0.0, 1.0, 0.0]))
    assert band_of_energy(SeaState(table=narrow, water_depth=450.0)) == (0.10005, 0.10005)
    cut = issc.omega <= 1.0
    part = replace(issc, omega=issc.omega[cut], excitation_force=issc.excitation_force[:, cut])
    message = (
        r"x\.h5 covers 0\.0079\d* to 0\.15\d* Hz .*energy from 0\.04\d* to 0\.33\d* Hz .*compute it for that range"
    )
    with pytest.raises(ScenarioError, match=message):
        require_coverage(part, STORM, "x.h5")


def test_a_database_must_be_for_the_site(issc: HydrodynamicDatabase) -> None:
    site = {"depth": 450.0, "density": 1025.0, "gravity": 9.80665, "frequency": 0.24}
    require_site(issc, **site)
    require_site(issc, **(site | {"depth": 3000.0, "frequency": 0.3}))  # deep for both
    for change, message in (
        ({"depth": 100.0}, "water depth of 450 m, the site has 100 m"),
        ({"density": 1000.0}, "density of 1025 kg/m³, the site has 1000 kg/m³"),
        ({"gravity": 9.7}, "gravity of 9.80665"),
    ):
        with pytest.raises(ScenarioError, match=message):
            require_site(issc, **(site | change))


def test_what_an_imported_database_does_not_tell(issc: HydrodynamicDatabase) -> None:
    imported = replace(issc, depth=np.nan, density=np.nan, gravity=np.nan)
    require_site(imported, depth=450.0, density=1025.0, gravity=9.80665, frequency=0.24)
    at = np.array([0.02, 0.7])
    found, exact = (excitation_transfer(each, at, np.zeros(2), 450.0) for each in (imported, issc))
    np.testing.assert_array_equal(found, exact)
    with pytest.raises(ScenarioError, match="excitation that is not known"):
        excitation_transfer(replace(issc, excitation_force=issc.excitation_force * np.nan), at, np.zeros(2), 450.0)


def test_a_heading_that_the_database_has_not(issc: HydrodynamicDatabase) -> None:
    few = replace(issc, heading=issc.heading[[1, 3]], excitation_force=issc.excitation_force[[1, 3]])
    at = np.array([0.5])
    found = excitation_transfer(few, at, issc.heading[[3]], 450.0)
    np.testing.assert_allclose(found, excitation_transfer(issc, at, issc.heading[[3]], 450.0), rtol=1e-9)
    with pytest.raises(ScenarioError, match=r"has headings 3\.75, 11\.25° .* not the 22\.92° of the waves"):
        excitation_transfer(few, at, np.array([0.4]), 450.0)
