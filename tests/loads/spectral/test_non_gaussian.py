"""Skewness and kurtosis of the response: by another way through the matrices, and by samples of what is expanded."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.hydro.drift import Waves
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.spectral.cumulants import cumulants, from_waves
from tlpsim.loads.spectral.dynamics import transfer
from tlpsim.loads.spectral.iteration import Expanded, FirstOrder, converged, first_transfer, second_order, wave_motion
from tlpsim.loads.spectral.model import SpectralModel, SpectralWaves
from tlpsim.loads.spectral.non_gaussian import higher_cumulants
from tlpsim.loads.spectral.outputs import outputs
from tlpsim.loads.spectral.problem import Problem, prepared
from tlpsim.loads.spectral.second_order import whole
from tlpsim.loads.waves.current import uniform_current
from tlpsim.loads.waves.sea import SeaState

STATE = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=13.0, heading=0.4, water_depth=450.0)
FREQUENCY = 1e-3 * np.arange(121)
NOTHING = np.zeros((121, 6, 6), dtype=np.complex128)


def kernel(first: Waves, second: Waves, component: int) -> np.ndarray:
    """Drift in surge and sway of a size that matters."""
    turn = (np.cos, np.sin)[component] if component < 2 else np.zeros_like
    size = 2e4 * (turn(first.heading)[:, None] + turn(second.heading))
    return np.asarray(size * np.exp(-2.0 * (first.omega[:, None] - second.omega) ** 2), dtype=np.complex128)


@cache
def solved(directions: int) -> tuple[Problem, Expanded]:
    waves = SpectralWaves(
        state=replace(STATE, directions=directions),
        members=issc_members(),
        current=uniform_current(0.8, 0.2),
        drift=kernel,
    )
    model = SpectralModel(platform=issc_tlp.platform((0.08, 0.08, 0.02, 0.02, 0.02, 0.05)), waves=waves)
    problem = prepared(model, 1e-3)
    return problem, converged(problem, 1e-4)[0]


@pytest.mark.parametrize("directions", [1, 2])
def test_waves_alone_by_the_matrices_of_the_response(directions: int) -> None:
    """The linear system acts on the bi-spectral matrices by `BispectralMatrix.through` instead."""
    problem, expanded = solved(directions)
    asked = outputs(problem.model, expanded.system.pose)
    rows, curvatures = asked.forms
    found = higher_cumulants(problem, expanded, FREQUENCY, (NOTHING, NOTHING), rows, curvatures)
    sea = problem.groups
    assert sea is not None
    position, force = wave_motion(sea, expanded, first_transfer(sea.grid.frequency, problem, expanded))
    first = FirstOrder(waves=position, force=force, gusts=None)
    forces = whole(second_order(sea, expanded, first, asked.curvatures), sea.grid)
    operators = []
    for frequency, system in (
        (forces.difference_frequency, expanded.drifting),
        (forces.total_frequency, expanded.system),
    ):
        size = 6 + len(asked.curvatures)
        operator = np.zeros((len(frequency), size, size), dtype=np.complex128)
        operator[:, :6, :6] = transfer(system, problem.memory, 2.0 * np.pi * frequency)
        operator[:, np.arange(6, size), np.arange(6, size)] = 1.0
        operators.append(operator)
    motion = forces.through(*operators)
    for n, row in enumerate(rows):
        weight = np.concatenate([row, np.eye(len(asked.curvatures))[n - 6] if n >= 6 else np.zeros(4)])
        form = from_waves(
            row @ position,
            np.tensordot(weight, motion.difference, axes=1),
            np.tensordot(weight, motion.total, axes=1),
            sea.grid.step,
        )
        expected = cumulants(form)
        third, fourth = expected.skewness * expected.variance**1.5, expected.excess_kurtosis * expected.variance**2
        np.testing.assert_allclose(found[n], [third, fourth], rtol=1e-6)
    # Slow drift pushes one way, so the offset is skewed along the waves.
    variance = np.sum(np.abs(position[0]) ** 2) * sea.grid.step
    assert found[0, 0] > 0.01 * variance**1.5


def test_slow_motion_and_waves_in_the_tethers_by_samples() -> None:
    """Eq. (2) of the module with normal motions of both kinds: third and fourth cumulants of half a million samples."""
    problem, expanded = solved(1)
    calm = replace(problem, sea=None, groups=None)
    asked = outputs(problem.model, expanded.system.pose)
    rows, curvatures = asked.forms
    rng = np.random.default_rng(12)
    roots = [
        rng.normal(size=(6, 6)) * np.array([size, size, 0.02, 1e-4, 1e-4, 5e-3])[:, None] / 2.0 for size in (4.0, 1.0)
    ]
    covariances = [root @ root.T for root in roots]
    # Any spectra of these covariances do: they are summed over the frequencies.
    share = np.exp(-FREQUENCY / 0.02)[:, None, None] / np.sum(np.exp(-FREQUENCY / 0.02)) / FREQUENCY[1]
    motion = share * covariances[0] + 0j, share * covariances[1] + 0j
    found = higher_cumulants(calm, expanded, FREQUENCY, motion, rows, curvatures)
    static = np.real(transfer(expanded.system, problem.memory, np.zeros(1))[0])
    g, x = (root @ rng.normal(size=(6, 500_000)) for root in roots)
    for n in (2, 3, 4, 6, 8):
        bent = curvatures[n] - np.einsum("i,ij,jkl->kl", rows[n], static, expanded.curvature)
        y = rows[n] @ (g + x) + 0.5 * np.sum(g * (bent @ g), axis=0) + np.sum(g * (bent @ x), axis=0)
        y = y - y.mean()
        variance = np.mean(y**2)
        third, fourth = np.mean(y**3), np.mean(y**4) - 3.0 * variance**2
        # Skewness and kurtosis of as many samples of such tails scatter by 0.01 and 0.06.
        assert found[n, 0] / variance**1.5 == pytest.approx(third / variance**1.5, abs=0.04)
        assert found[n, 1] / variance**2 == pytest.approx(fourth / variance**2, rel=0.03, abs=0.15)
    assert abs(found[2, 0]) > 0.1 * (rows[2] @ (covariances[0] + covariances[1]) @ rows[2]) ** 1.5


def test_calm_water_and_no_motion_have_no_cumulants() -> None:
    problem, expanded = solved(1)
    rows, curvatures = outputs(problem.model, expanded.system.pose).forms
    calm = replace(problem, sea=None, groups=None)
    found = higher_cumulants(calm, expanded, FREQUENCY, (NOTHING, NOTHING), rows, curvatures)
    np.testing.assert_array_equal(found, np.zeros((10, 2)))
