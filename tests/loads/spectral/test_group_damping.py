"""Damping that follows the wave groups: its cumulants as those of quadratic forms, and drag in two sizes of waves."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.spectral import viscous
from tlpsim.loads.spectral.bispectral import quadratic
from tlpsim.loads.spectral.cumulants import from_waves
from tlpsim.loads.spectral.group_damping import (
    damping_matrices,
    damping_products,
    group_damping,
    third_cumulant_change,
)
from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.spectral.problem import SeaOnGrid, sea_on_grid
from tlpsim.loads.spectral.products import pairs
from tlpsim.loads.waves.current import Current, uniform_current
from tlpsim.loads.waves.sea import SeaState

STATE = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=13.0, heading=0.4, water_depth=450.0)
PLANE = [0, 1, 5]


def expanded(current: Current | None, factor: float = 1.0) -> tuple[SeaOnGrid, viscous.Drag]:
    """A fixed hull, and its drag expanded for velocities `factor` as large."""
    waves = SpectralWaves(state=STATE, members=issc_members(), current=current, splash=False)
    sea = sea_on_grid(waves, 8e-3)
    covariances, cross = zip(
        *(
            viscous.covariances(elements, factor * rows.water, rows.elevation, sea.grid.step, np.zeros((6, 6)))
            for elements, rows in zip(sea.elements, sea.rows, strict=True)
        ),
        strict=True,
    )
    return sea, viscous.expanded(sea.elements, covariances, cross[1], np.zeros(0))


@pytest.mark.parametrize("current", [None, uniform_current(0.7, 1.0)], ids=["still", "current"])
def test_mean_damping_changes_with_the_waves_as_its_cubic_coefficient_says(current: Current | None) -> None:
    """dC1/dS = 3 C3 for normal velocities: of the mean of eq. (1), and of what groups of 1 % higher waves have."""
    sea, drag = expanded(current)
    step = 0.01
    higher, lower = (viscous.linear_drag(expanded(current, np.sqrt(1.0 + d))[1]).damping for d in (step, -step))
    products = damping_products(drag, sea.rows[0].water)
    mean = products.weights @ (sea.grid.step * np.einsum("mn,mn->m", products.first, products.second.conj()).real)
    expected = ((higher - lower) / (2.0 * step))[np.ix_(PLANE, PLANE)]
    np.testing.assert_allclose(mean.reshape(3, 3), expected, atol=1e-3 * np.abs(expected).max())


def form(matrix: NDArray[np.complex128], step: float) -> NDArray[np.float64]:
    """Symmetric matrix of a quadratic form of standard normal variables."""
    nothing = np.zeros(len(matrix), dtype=np.complex128)
    return from_waves(nothing, matrix, np.zeros_like(matrix), step).matrix


def test_damping_and_load_by_the_cumulants_of_quadratic_forms() -> None:
    """Cov = 2 tr A B, third cumulant 8 tr A B C of the velocities that a flat response makes of the forces."""
    sea, drag = expanded(uniform_current(0.7, 1.0))
    grid, rng = sea.grid, np.random.default_rng(4)
    count = len(grid.frequency)
    rows = rng.normal(size=(2, count, 2)) @ np.array([1.0, 1.0j]) * grid.root
    forces = quadratic(grid.frequency, pairs(rows, rows, 1e5 * rng.normal(size=(6, 2)))).difference
    gain = np.diag([1e-6, 2e-6, 0.0, 0.0, 0.0, 3e-6])
    response = np.tile(gain, (count, 1, 1)).astype(np.complex128)
    velocities = [form(np.tensordot(gain[i], forces, axes=1), grid.step) for i in PLANE]
    variance = np.zeros((6, 6))
    variance[np.ix_(PLANE, PLANE)] = [[2.0 * np.trace(a @ b) for b in velocities] for a in velocities]
    variance += 0.1 * np.trace(variance) * np.eye(6)
    damping, load = group_damping(drag, sea.rows[0].water, forces, response, variance, grid)
    fluctuation = [form(each, grid.step) for each in damping_matrices(drag, sea.rows[0].water, grid)]
    along, mean = np.zeros((3, 3)), np.zeros(3)
    for i in range(3):
        for j in range(3):
            b = fluctuation[3 * i + j]
            mean[i] -= 2.0 * np.trace(b @ velocities[j])
            for k in range(3):
                along[i, k] += 8.0 * np.trace(b @ velocities[j] @ velocities[k])
    beta = along @ np.linalg.inv(variance[np.ix_(PLANE, PLANE)])
    np.testing.assert_allclose(load[PLANE], mean, rtol=1e-9, atol=1e-9 * np.abs(mean).max())
    np.testing.assert_allclose(damping[np.ix_(PLANE, PLANE)], beta, rtol=1e-6, atol=1e-9 * np.abs(beta).max())
    assert not load[2:5].any()
    assert not damping[2:5].any()
    assert np.abs(beta).max() > 0.0


def test_no_drag_no_damping_of_groups() -> None:
    waves = SpectralWaves(state=STATE, members=issc_members(0.0), splash=False)
    sea = sea_on_grid(waves, 8e-3)
    none, size = np.zeros((0, 2, 2)), len(sea.grid.root)
    drag = viscous.expanded(sea.elements, (none, none), np.zeros((0, 2)), np.zeros(0))
    flat = np.zeros((size, 6, 6), dtype=np.complex128)
    found = group_damping(drag, sea.rows[0].water, np.ones((6, size, size)) + 0j, flat, np.eye(6), sea.grid)
    assert not found[0].any()
    assert not found[1].any()


def test_damping_that_goes_with_the_force_takes_from_the_third_cumulant() -> None:
    """One degree of freedom x'' + (c + b) x' + k x = F with Gaussian F and b = e F, against its solution in time.

    To the first order in b the third cumulant is that of eq. (5), as there is no connected fourth cumulant. Two
    solutions of opposite b with the same F leave it as half of their difference, free of the scatter without b.
    """
    damping, stiffness, ratio, step, length, records = 0.012, 0.06**2, 0.25, 1.0, 2**16, 8
    frequency = 2.5e-4 * np.arange(241)
    density = np.exp(-((frequency / 0.02) ** 2))
    omega = 2.0 * np.pi * frequency
    response = np.zeros((241, 6, 6), dtype=np.complex128)
    response[:, 0, 0] = 1.0 / (stiffness - omega**2 + 1j * omega * damping)
    factor = ratio * damping / np.sqrt(np.trapezoid(density, frequency))  # b of a quarter of c
    cross = np.zeros((241, 6, 9), dtype=np.complex128)
    cross[:, 0, 0] = factor * density
    motion = np.zeros((241, 6, 6), dtype=np.complex128)
    motion[:, 0, 0] = np.abs(response[:, 0, 0]) ** 2 * density
    expected = third_cumulant_change(np.eye(6)[:1], frequency, response, cross, motion)[0]

    lines = np.fft.rfftfreq(length, step)
    noise = np.random.default_rng(5).standard_normal((2, records, len(lines)))
    amplitude = np.sqrt(0.25 * np.exp(-((lines / 0.02) ** 2)) / (length * step)) * length
    force = np.fft.irfft(amplitude * (noise[0] + 1j * noise[1]), n=length, axis=1)
    signed = np.stack([force, force])
    change = np.stack([factor * force, -factor * force])
    before = now = np.zeros((2, records))
    kept = np.empty((length, 2, records))
    for n in range(length):
        kept[n] = now
        half = 0.5 * step * (damping + change[:, :, n])
        after = (step**2 * (signed[:, :, n] - stiffness * now) + 2.0 * now - (1.0 - half) * before) / (1.0 + half)
        before, now = now, after
    settled = kept[2000:]
    third = np.mean((settled - settled.mean(axis=0)) ** 3, axis=0)
    each = 0.5 * (third[0] - third[1])
    variance = np.var(settled[:, 0])
    assert np.trapezoid(motion[:, 0, 0].real, frequency) == pytest.approx(variance, rel=0.05)
    assert expected / variance**1.5 < -0.1  # large enough to be seen
    error = np.std(each, ddof=1) / np.sqrt(records)
    # Terms of the third order in b remain, (b/c)² of the first.
    assert each.mean() == pytest.approx(expected, abs=3.0 * error + 0.1 * abs(expected))
