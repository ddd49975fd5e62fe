"""Second-order loads against double sums over pairs of components, and drift against its own spectra."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.hydro.drift import Waves, drift_spectrum
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.spectral.bispectral import mean
from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.spectral.products import joined, no_products, pairs
from tlpsim.loads.spectral.second_order import (
    SLOW_DRIFT,
    EvenSpectrum,
    SecondOrder,
    displaced_products,
    drift_matrix,
    matrices,
    means,
    spectra,
    tether_products,
    whole,
)
from tlpsim.loads.spectral.wave_grid import WaveGrid, wave_grid
from tlpsim.loads.waves.sea import SeaState

STATE = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=13.0, heading=0.4, water_depth=450.0)
SPREAD = replace(STATE, directions=2, spreading_exponent=6.0)


def grid_of(state: SeaState, step: float) -> WaveGrid:
    return wave_grid(SpectralWaves(state=state, members=issc_members()), step)


def smooth_rows(grid: WaveGrid, count: int, seed: int = 1) -> NDArray[np.complex128]:
    """Decomposed functions (count, N) of any phases."""
    rng = np.random.default_rng(seed)
    size = (count, len(grid.root))
    return np.asarray((rng.normal(size=size) + 1j * rng.normal(size=size)) * grid.root)


def kernel(first: Waves, second: Waves, component: int) -> NDArray[np.complex128]:
    """A transfer function with phases, Hermitian, not a product of functions of either wave."""
    a, b = first.omega[:, None], second.omega[None, :]
    angle = np.cos(0.5 * (first.heading[:, None] + second.heading[None, :]) - 0.3 * component)
    return np.asarray(1e4 * (component + 1.0) * angle * np.exp(-((a - b) ** 2)) * (a * b) * np.exp(2j * (a - b)))


def brute(grid: WaveGrid, force: NDArray[np.complex128], position: NDArray[np.complex128]) -> dict[str, NDArray]:
    """Mean and spectra of sum_c x_c dF/dx_c by pairs of components, one after the other."""
    sea, step, count = grid.sea, grid.step, len(grid.frequency)
    size = len(grid.root)
    difference, total = np.zeros((count, 6)), np.zeros((2 * count - 1, 6))
    average = np.zeros(6)
    for n in range(size):
        for m in range(size):
            # Displacement of the component n times the force of m, and the other way round: z = Re{...} of either kind.
            slope = [-1j * sea.wavenumber[k] * force[:, k] for k in (m, n)]
            along = [
                position[0, a] * np.cos(sea.heading[b]) + position[1, a] * np.sin(sea.heading[b])
                for a, b in ((n, m), (m, n))
            ]
            apart, place = n % count - m % count, n % count + m % count
            minus = 0.5 * (along[0] * np.conj(slope[0]) + np.conj(along[1]) * slope[1])
            plus = 0.5 * (along[0] * slope[0] + along[1] * slope[1])
            if n == m:
                average += step * minus.real
            if apart >= 0:
                difference[apart] += 2.0 * step * np.abs(minus) ** 2
            total[place] += step * np.abs(plus) ** 2
    return {"mean": average, "difference": difference, "total": total}


@pytest.mark.parametrize("state", [STATE, SPREAD], ids=["one direction", "two directions"])
def test_displaced_position_by_pairs_of_components(state: SeaState) -> None:
    grid = grid_of(state, 6e-3)
    force = inertia_transfer(issc_members(), grid.sea) * grid.root
    position = 1e-7 * force * np.exp(0.3j * grid.omega)
    parts = SecondOrder(products={"displaced position": displaced_products(position, force, grid)}, drift=None)
    found = spectra(whole(parts, grid), grid)
    expected = brute(grid, force, position)
    size = np.abs(expected["mean"]).max()
    assert size > 0.0
    np.testing.assert_allclose(means(parts, grid)["displaced position"], expected["mean"], atol=1e-9 * size)
    for part, name in ((found.difference, "difference"), (found.total, "total")):
        np.testing.assert_allclose(np.einsum("fii->fi", part.values).real, expected[name], rtol=1e-9, atol=1e-3)


def test_displaced_position_is_the_change_of_the_force_with_the_place() -> None:
    """In time: the force of waves where the platform is, less that at the origin, for a small motion."""
    grid = grid_of(SPREAD, 4e-3)
    force = inertia_transfer(issc_members(), grid.sea) * grid.root
    motion = 1e-4 * smooth_rows(grid, 6)
    products = displaced_products(motion, force, grid)
    phase = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, len(grid.root))
    for time in (0.0, 31.7, 100.2):
        wave = np.exp(1j * (grid.omega * time + phase))
        x, y = (motion[:2] @ wave).real
        travel = x * np.cos(grid.sea.heading) + y * np.sin(grid.sea.heading)
        moved = (force @ (wave * np.exp(-1j * grid.sea.wavenumber * travel))).real
        expected = moved - (force @ wave).real
        found = products.weights @ ((products.first @ wave).real * (products.second @ wave).real)
        # What is quadratic in the motion is k x = 1e-4 of it.
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_tethers_are_an_exact_quadratic_form() -> None:
    grid = grid_of(STATE, 5e-3)
    rng = np.random.default_rng(8)
    curvature = rng.normal(size=(4, 6, 6))
    curvature += curvature.swapaxes(1, 2)
    curvature[:, 5] = curvature[:, :, 5] = 0.0
    position = smooth_rows(grid, 6)
    products = tether_products(position, curvature)
    assert len(products.first) == 15  # pairs of five
    for time in (0.0, 13.3):
        wave = np.exp(1j * grid.omega * time)
        x = (position @ wave).real
        found = products.weights @ ((products.first @ wave).real * (products.second @ wave).real)
        np.testing.assert_allclose(found, 0.5 * np.einsum("qij,i,j->q", curvature, x, x), rtol=1e-9)
    covariance = grid.step * (position @ position.conj().T).real
    expected = 0.5 * np.einsum("qij,ij->q", curvature, covariance)
    parts = SecondOrder(products={"tethers": products}, drift=None)
    np.testing.assert_allclose(means(parts, grid)["tethers"], expected, rtol=1e-9)
    np.testing.assert_allclose(mean(dict(matrices(parts, grid))["tethers"]), expected, rtol=1e-9)


@pytest.mark.parametrize("state", [STATE, SPREAD], ids=["one direction", "two directions"])
def test_drift_has_the_mean_and_the_spectrum_of_its_own_sums(state: SeaState) -> None:
    """`drift_spectrum` sums over the middles of steps, the grid over their ends: smooth functions, to 1e-3."""
    grid = grid_of(state, 2e-3)
    parts = SecondOrder(products={"tethers": no_products(len(grid.root))}, drift=drift_matrix(kernel, grid))
    found, expected = spectra(whole(parts, grid), grid), drift_spectrum(kernel, state, 2e-3)
    np.testing.assert_allclose(means(parts, grid)[SLOW_DRIFT], expected.mean, rtol=1e-3)
    density = np.einsum("fii->if", found.difference.at(expected.frequency)).real
    np.testing.assert_allclose(density, expected.density, atol=2e-3 * expected.density.max(axis=1, keepdims=True).max())
    ratio = density[:, :40] / expected.density[:, :40]
    np.testing.assert_allclose(ratio, 1.0, atol=5e-3)
    assert not found.total.values.any()
    assert {name for name, _ in matrices(parts, grid)} == {"tethers", SLOW_DRIFT}


def test_all_parts_together_are_coherent() -> None:
    """The whole is the sum of the matrices of the parts, whose spectra do not add."""
    grid = grid_of(STATE, 4e-3)
    rows = smooth_rows(grid, 4)
    weights = np.random.default_rng(2).normal(size=(6, 2))
    products = {"a": pairs(rows[:2], rows[2:], weights), "b": pairs(rows[:2], rows[2:], 0.5 * weights)}
    parts = SecondOrder(products=products, drift=drift_matrix(kernel, grid) * 1e-3)
    together, single = whole(parts, grid), dict(matrices(parts, grid))
    np.testing.assert_allclose(together.difference, sum(each.difference for each in single.values()), rtol=1e-9)
    np.testing.assert_allclose(together.total, sum(each.total for each in single.values()), rtol=1e-9)
    alone = SecondOrder(products=products, drift=None)
    both = spectra(whole(alone, grid), grid).difference.values
    one = spectra(dict(matrices(alone, grid))["a"], grid).difference.values
    np.testing.assert_allclose(both, 2.25 * one, rtol=1e-9, atol=1e-12 * np.abs(both).max())


def test_products_are_joined_in_order() -> None:
    rows = np.arange(12.0).reshape(3, 4) + 0j
    one, none = pairs(rows, 2.0 * rows, np.ones((6, 3))), no_products(4)
    for both in (joined(one, none), joined(none, one)):
        np.testing.assert_array_equal(both.first, rows)
        np.testing.assert_array_equal(both.weights, one.weights)
    assert joined(one, one).second.shape == (6, 4)
    assert no_products(4, 2).weights.shape == (2, 0)


def test_spectra_are_linear_between_and_zero_outside_of_their_frequencies() -> None:
    values = (np.array([1.0, 3.0, 2.0])[:, None, None] * np.array([[1.0, 1j], [-1j, 2.0]])).astype(complex)
    spectrum = EvenSpectrum(first=0.1, step=0.02, values=values)
    at = np.array([0.0999, 0.1, 0.105, 0.12, 0.135, 0.14, 0.1401, 5.0])
    expected = np.array([0.0, 1.0, 1.5, 3.0, 2.25, 2.0, 0.0, 0.0])
    found = spectrum.at(at)
    np.testing.assert_allclose(found[:, 0, 0], expected, rtol=1e-9)
    np.testing.assert_allclose(found[:, 0, 1], 1j * expected, rtol=1e-9)
    np.testing.assert_allclose(found[:, 1, 1], 2.0 * expected, rtol=1e-9)
