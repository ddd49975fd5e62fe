"""The waves' grid: energy and places of its components."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.spectral.problem import LONGEST_WAVE_STEP, MOST_COMPONENTS, WAVE_STEP, wave_step
from tlpsim.loads.spectral.wave_grid import acting_density, equivalent_width, part_of, wave_grid
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.current import uniform_current
from tlpsim.loads.waves.sea import SeaState
from tlpsim.loads.waves.spectra import SpectrumTable

STATE = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=14.0, heading=0.3, water_depth=450.0)
MEMBERS = issc_members()


def waves(state: SeaState = STATE, **changes: object) -> SpectralWaves:
    return SpectralWaves(state=state, members=MEMBERS, **changes)  # type: ignore[arg-type]


@settings(max_examples=20, deadline=None)
@given(
    step=st.floats(3e-4, 2e-3),
    height=st.floats(0.5, 15.0),
    period=st.floats(8.0, 18.0),
    directions=st.integers(1, 5),
)
def test_the_components_hold_the_energy_of_the_sea(step: float, height: float, period: float, directions: int) -> None:
    state = replace(STATE, significant_height=height, peak_period=period, directions=directions)
    grid = wave_grid(waves(state), step)
    one = np.array([1.0])
    energy, _ = quad(lambda f: float(acting_density(waves(state), f * one)[0]), 1e-3, 0.4, points=[1.0 / period])
    assert grid.order == directions
    # A smooth spectrum that fades out at both ends: sums are good to far more than 1e-4.
    assert step * np.sum(grid.root**2) == pytest.approx(energy, rel=1e-4)
    # Of Pierson and Moskowitz's spectrum, exp(-5/4 (fp/f)⁴) lies below f; equal powers fade on both sides of 0.35 Hz.
    assert energy == pytest.approx(height**2 / 16.0 * np.exp(-1.25 / (0.35 * period) ** 4), rel=1e-3)
    shares = step * np.sum(grid.root.reshape(directions, -1) ** 2, axis=1)
    np.testing.assert_allclose(shares / shares.sum(), state.spread().share, rtol=1e-12)
    np.testing.assert_array_equal(grid.sea.heading.reshape(directions, -1).T[0], state.spread().heading)
    np.testing.assert_allclose(grid.frequency / step, np.round(grid.frequency / step), atol=1e-9)
    np.testing.assert_allclose(
        grid.omega.reshape(directions, -1), np.tile(2.0 * np.pi * grid.frequency, (directions, 1))
    )


def test_the_lowest_waves_that_have_no_energy_are_left_out() -> None:
    grid = wave_grid(waves(), 1e-3)
    assert grid.frequency[0] > 0.02
    density = STATE.density(np.array([grid.frequency[0] - grid.step, 1.0 / STATE.peak_period]))
    assert density[0] < 1e-8 * density[1]


def test_harmonic_waves_end_with_the_band() -> None:
    state = replace(STATE, lowest_frequency=0.05, highest_frequency=0.2)
    grid = wave_grid(waves(state, sharp_band=True), 1e-3)
    assert grid.frequency[[0, -1]] == pytest.approx([0.05, 0.2])
    np.testing.assert_allclose(grid.root**2, state.density(grid.frequency), rtol=1e-12)
    faded = wave_grid(waves(state), 1e-3)
    at = np.searchsorted(faded.frequency, 0.2 - 1e-9)
    assert faded.root[at] ** 2 == pytest.approx(0.5 * state.density(np.array([0.2]))[0], rel=1e-9)
    assert faded.frequency[-1] == pytest.approx(0.22, abs=1.5e-3)


def test_a_band_is_a_part_of_the_grid() -> None:
    whole, part = wave_grid(waves(), 1e-3), wave_grid(waves(), 1e-3, band=(0.0605, 0.1))
    assert part.frequency[[0, -1]] == pytest.approx([0.061, 0.1])
    first = int(np.argmin(np.abs(whole.frequency - 0.061)))
    np.testing.assert_allclose(part.root, whole.root[first : first + len(part.root)], rtol=1e-12)


def test_calm_water_has_no_components() -> None:
    grid = wave_grid(waves(replace(STATE, significant_height=0.0, directions=3)), 1e-3)
    assert (len(grid.frequency), len(grid.root), len(grid.sea.wavenumber), grid.order) == (0, 0, 0, 0)


def test_waves_on_a_current_keep_the_frequency_at_a_fixed_place() -> None:
    current = uniform_current(1.2, 0.3)
    still, moving = wave_grid(waves(current=current), 2e-3), wave_grid(waves(current=current, doppler=True), 2e-3)
    np.testing.assert_array_equal(moving.omega, still.omega)
    np.testing.assert_array_equal(still.sea.angular_frequency, still.omega)
    # (omega - k U)² = g k tanh k d of the frequency that the water sees.
    seen = moving.sea.angular_frequency
    np.testing.assert_allclose(seen, moving.omega - 1.2 * moving.sea.wavenumber, rtol=1e-9)
    np.testing.assert_allclose(moving.sea.wavenumber, wavenumber(seen, 450.0, STATE.gravity), rtol=1e-9)
    assert np.all(moving.sea.wavenumber < still.sea.wavenumber)


def test_the_sea_of_a_grid_has_no_realization() -> None:
    with pytest.raises(NotImplementedError, match="no amplitudes at 3"):
        wave_grid(waves(), 2e-3).sea.amplitudes(3.0)


def test_equivalent_width_of_a_box_and_of_a_bell() -> None:
    frequency = np.linspace(0.05, 0.15, 201)
    bell = np.exp(-0.5 * ((frequency - 0.1) / 0.01) ** 2)
    box = np.where(np.abs(frequency - 0.1) < 0.0301, 1.0, 0.0)
    for density, width in ((bell, 2.0 * np.sqrt(np.pi) * 0.01), (box, 0.06)):
        table = SpectrumTable(frequency=frequency, density=density + 1e-12)
        found = equivalent_width(replace(STATE, table=table, peak_period=10.0))
        # Of the box the table's edges are as wide as its rows.
        assert found == pytest.approx(width, rel=0.02)
    assert equivalent_width(replace(STATE, significant_height=0.0)) == STATE.highest_frequency


def test_the_step_follows_the_width_and_the_number_of_directions() -> None:
    assert wave_step(waves()) <= WAVE_STEP
    narrow = replace(STATE, spectrum="jonswap", peak_period=18.0, peak_enhancement=7.0)
    assert equivalent_width(narrow) / 20.0 < wave_step(waves(narrow)) < min(equivalent_width(narrow) / 9.0, WAVE_STEP)
    many = replace(STATE, directions=9)
    assert len(wave_grid(waves(many), wave_step(waves(many))).root) <= MOST_COMPONENTS
    assert wave_step(waves(replace(STATE, directions=32))) == LONGEST_WAVE_STEP
    assert wave_step(waves(replace(STATE, significant_height=0.0))) == WAVE_STEP


def test_a_regular_wave_has_no_spectrum_to_follow() -> None:
    table = SpectrumTable(frequency=np.array([0.0699, 0.07, 0.0701]), density=np.array([0.0, 600.0, 0.0]))
    state = SeaState(table=table, significant_height=1.0, water_depth=450.0)
    with pytest.raises(ScenarioError, match=r"spectrum of the waves is .* Hz wide, less than 0\.002 Hz"):
        wave_step(SpectralWaves(state=state, members=MEMBERS))


@pytest.mark.parametrize("doppler", [False, True])
def test_parts_of_a_grid_are_its_components(doppler: bool) -> None:
    """Blocks of frequencies of three directions, put side by side, are the whole."""
    current = uniform_current(0.8, 1.0) if doppler else None
    whole = wave_grid(waves(replace(STATE, directions=3), current=current, doppler=doppler), 2e-3)
    count = len(whole.frequency)
    parts = [part_of(whole, slice(first, first + 50)) for first in range(0, count, 50)]
    assert len(parts) > 2
    np.testing.assert_array_equal(np.concatenate([each.frequency for each in parts]), whole.frequency)
    for name in ("angular_frequency", "wavenumber", "heading"):
        together = [getattr(each.sea, name).reshape(3, -1) for each in parts]
        np.testing.assert_array_equal(np.concatenate(together, axis=1).ravel(), getattr(whole.sea, name))
    for name in ("omega", "root"):
        together = [getattr(each, name).reshape(3, -1) for each in parts]
        np.testing.assert_array_equal(np.concatenate(together, axis=1).ravel(), getattr(whole, name))
