"""Response of a platform by the frequency domain: iteration and perturbation, Fig. 5 of Li and Kareem (1990).

    order 0   mean position under mean wind, current, drift, drag, and what fluctuations leave of all these
    order 1   waves and gusts, x = Z^-1 F, with drag and wind linear for the statistics of the relative velocities
    order 2   products of first-order quantities, at difference and sum frequencies, x = Z^-1 z
    products  of slow motion (gusts and difference frequencies) with itself and with that of waves, in the tethers

Drag coefficients, stiffness and damping depend on covariances that follow from the response, so orders 0 and 1 are
repeated until these stand still, within rounds that bring the second order in (`tlpsim.loads.spectral.iteration`).
Spectra come at last, on even fine frequencies, here.

Slow motion of the second order is taken as Gaussian and independent of the waves in the products. Products in which
slow motion shifts the waves' phase are left out: the waves act at the platform, and a slow shift of phase keeps the
spectrum of a force.
"""

from __future__ import annotations

import time
import warnings

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.spectral.bispectral import BispectralMatrix, add
from tlpsim.loads.spectral.decomposition import cross_spectrum
from tlpsim.loads.spectral.dynamics import natural_modes, powers_through, require_damped, through, transfer
from tlpsim.loads.spectral.iteration import (
    SECOND_ORDER,
    TOLERANCE,
    WITH_MEAN,
    Expanded,
    FirstOrder,
    State,
    converged,
    first_expansion,
    gust_motion,
    relative_speeds,
    second_order,
    wave_motion,
)
from tlpsim.loads.spectral.model import SpectralModel
from tlpsim.loads.spectral.non_gaussian import higher_cumulants
from tlpsim.loads.spectral.outputs import Outputs, outputs, quantities
from tlpsim.loads.spectral.problem import (
    GustsOnGrid,
    Problem,
    SeaOnGrid,
    acting_sea,
    gusts_on_grid,
    prepared,
    refined,
    refined_sea,
)
from tlpsim.loads.spectral.quadratic_forms import product_spectrum, square_spectrum
from tlpsim.loads.spectral.records import Mode, SpectralResponse
from tlpsim.loads.spectral.second_order import SecondOrder, matrices, means, spectra, with_further

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FREQUENCY_STEP = 2.5e-4
"""Hz, of the spectra, unless a slow mode is so narrow that it asks for less."""
STEPS_IN_WIDTH = 1.5
"""Steps in half of the width of a mode, damping ratio over period."""
SHORTEST_STEP = 2e-5
"""Hz, enough for 0.3 % of critical damping at a period of 100 s."""
SLACK = 3.0
"""Mean tension in standard deviations, below which a tendon is likely to slacken."""
_NEARLY = 0.9  # of a step, below which it is worth to begin again
ALL_SECOND_ORDER = "all second order"
PRODUCTS = "products"


def respond(model: SpectralModel, *, step: float = FREQUENCY_STEP, tolerance: float = TOLERANCE) -> SpectralResponse:
    """Means, spectra and extremes of the response.

    Parameters
    ----------
    model
        The platform and what acts on it.
    step
        Largest step of the frequencies, Hz.
    tolerance
        Change of means and spreads, relative to the largest translation and rotation, at which orders 0 and 1 end;
        rounds of the second order end at `tlpsim.loads.spectral.iteration.ROUND_TOLERANCE` if that is larger.

    Raises
    ------
    ScenarioError
        If the current stops a wave, or a parameter is out of range.
    SolverError
        When there is no mean position, no stationary response, or the iteration does not converge.

    Warns
    -----
    RuntimeWarning
        When a tendon is likely to slacken, which the expansion does not know.
    """
    # Matrices are small, and threads cost more than they bring.
    with threadpool_limits(1):
        found = _respond(model, step, tolerance)
    _warn_of_slack(found)
    return found


def _warn_of_slack(response: SpectralResponse) -> None:
    margins = {
        each.name: each.mean / each.spread()
        for each in response.quantities.values()
        if each.name.startswith("tendon_") and each.spread() > 0.0
    }
    name = min(margins, key=lambda key: margins[key], default="")
    if name and margins[name] < SLACK:
        warnings.warn(
            f"frequency domain: {name} has a mean of {margins[name]:.2g} times its standard deviation, less than "
            f"{SLACK:g}: the tendon slackens, which is left out here; take the time domain",
            RuntimeWarning,
            stacklevel=3,
        )


def _respond(model: SpectralModel, step: float, tolerance: float) -> SpectralResponse:
    began = time.perf_counter()
    problem = prepared(model, step)
    fluctuates = acting_sea(problem) is not None or (
        problem.gusts is not None and problem.gusts.speeds.function.shape[2] > 0
    )
    if fluctuates and (needed := _needed_step(natural_modes(first_expansion(problem).system, problem.memory))) < step:
        step = max(needed, SHORTEST_STEP)
        problem = refined(problem, step)
    prepared_at = time.perf_counter()
    while True:
        expanded, first, state, changes = converged(problem, tolerance)
        modes = natural_modes(expanded.system, problem.memory)
        if not fluctuates or (needed := _needed_step(modes)) >= _NEARLY * step or step <= SHORTEST_STEP:
            break
        step = max(needed, SHORTEST_STEP)
        problem = refined(problem, step)
    iterated = time.perf_counter()
    return _evaluated(problem, expanded, first, state, changes, modes, step, (began, prepared_at, iterated))


def _needed_step(modes: tuple[Mode, ...]) -> float:
    require_damped(modes)
    return min((mode.damping_ratio / mode.period / STEPS_IN_WIDTH for mode in modes), default=np.inf)


def _evaluated(
    problem: Problem,
    expanded: Expanded,
    first_order: FirstOrder,
    state: State,
    changes: tuple[float, ...],
    modes: tuple[Mode, ...],
    step: float,
    times: tuple[float, float, float],
) -> SpectralResponse:
    """Spectra of everything on fine frequencies."""
    model, system, sea = problem.model, expanded.system, acting_sea(problem)
    frequency = step * np.arange(round(problem.frequency[-1] / step) + 1)
    asked = outputs(model, system.pose)
    drifting, response = (
        transfer(each, problem.memory, 2.0 * np.pi * frequency) for each in (expanded.drifting, system)
    )
    waves, elevation = _waves(problem, expanded, frequency, response)
    parts: dict[str, FloatArray] = {}
    slow = np.zeros((len(frequency), 6, 6), dtype=np.complex128)
    if problem.gusts is not None:
        slow += _wind(problem.gusts, expanded, frequency, response, waves)
        parts["wind"] = _diagonal(slow)
    by_frequency = np.ascontiguousarray(waves.swapaxes(0, 1))
    first = by_frequency @ by_frequency.conj().swapaxes(1, 2)
    size = 6 + len(asked.curvatures)
    found = np.zeros((len(frequency), size, size), dtype=np.complex128)
    found[:, :6, :6] = slow + first
    second = None if sea is None else second_order(sea, expanded, first_order, asked.curvatures)
    fast = np.zeros_like(found)
    if sea is not None and second is not None:
        parts["waves"] = _diagonal(first)
        by_part, low, fast = _spectra(second, sea, frequency, drifting, response)
        parts |= by_part
        slow += low[:, :6, :6]
        found += low
    products = _products(expanded, asked, slow, first, frequency)
    parts[PRODUCTS] = powers_through(products, response)
    found += through(fast + products, response)
    evaluated = time.perf_counter()
    shapes = higher_cumulants(problem, expanded, frequency, (slow, first), *asked.forms)
    return SpectralResponse(
        frequency=frequency,
        quantities=quantities(asked, model, system, frequency, found, state, (waves, elevation), shapes),
        cross_spectrum=found[:, :6, :6],
        contributions=parts,
        mean_loads=_mean_loads(expanded, second, sea, state),
        mean_position=system.pose,
        modes=modes,
        iterations=changes,
        seconds={
            "preparation": times[1] - times[0],
            "iteration": times[2] - times[1],
            "spectra": evaluated - times[2],
            "statistics": time.perf_counter() - evaluated,
        },
    )


def _diagonal(spectrum: ComplexArray) -> FloatArray:
    """Spectra (m, 6) of the positions in cross-spectra (m, k, k)."""
    return np.einsum("fii->fi", spectrum).real[:, :6].copy()


def _waves(
    problem: Problem, expanded: Expanded, frequency: FloatArray, response: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """First-order motion (6, m, r) and elevation (m, r) of waves at fine frequencies (m,), by transfer functions."""
    count, step = len(frequency), frequency[1]
    coarse = acting_sea(problem)
    if coarse is None:
        return np.zeros((6, count, 0), dtype=np.complex128), np.zeros((count, 0), dtype=np.complex128)
    order = coarse.grid.order
    result = np.zeros((6, count, order), dtype=np.complex128)
    elevation = np.zeros((count, order), dtype=np.complex128)
    for sea in refined_sea(coarse, step):
        rows = np.round(sea.grid.frequency / step).astype(np.int64)
        motion, _ = wave_motion(sea, expanded, response[rows])
        result[:, rows] = motion.reshape(6, order, -1).swapaxes(1, 2)
        elevation[rows] = sea.grid.root.reshape(order, -1).T
    return result, elevation


def _wind(
    coarse: GustsOnGrid,
    expanded: Expanded,
    frequency: FloatArray,
    response: ComplexArray,
    waves: ComplexArray,
) -> ComplexArray:
    """Cross-spectra (m, 6, 6) of the motion of gusts, and of the squares of the relative speeds, or of gusts alone."""
    assert expanded.wind is not None
    gusts = gusts_on_grid(coarse.wind, frequency)
    count = len(gusts.speeds.frequency)
    motion = gust_motion(gusts, expanded, response[:count])
    result = np.zeros((len(frequency), 6, 6), dtype=np.complex128)
    result[:count] = cross_spectrum(motion)
    if not np.any(expanded.wind.on_squares):
        return result
    along = expanded.wind.along_in_squares
    others = along @ (2j * np.pi * frequency[:, None, None] * waves.swapaxes(0, 1))
    speeds = others @ np.conj(np.swapaxes(others, 1, 2))
    speeds[:count] += cross_spectrum(relative_speeds(gusts, along, motion))
    squares = square_spectrum(frequency, speeds, expanded.system.loads @ expanded.wind.on_squares)
    return result + through(squares, response)


def _spectra(
    second: SecondOrder, sea: SeaOnGrid, frequency: FloatArray, drifting: ComplexArray, response: ComplexArray
) -> tuple[dict[str, FloatArray], ComplexArray, ComplexArray]:
    """Contributions (m, 6) of the second order by part; all of it at differences, and its forces at sums (m, k, k)."""
    parts: dict[str, FloatArray] = {}
    forces: BispectralMatrix | None = None
    for name, each in matrices(second, sea.grid):
        both = spectra(each, sea.grid)
        parts[name] = powers_through(both.difference.at(frequency), drifting)
        parts[name] += powers_through(both.total.at(frequency), response)
        forces = each if forces is None else add(forces, each)
    assert forces is not None
    both = spectra(with_further(forces, second, sea.grid), sea.grid)
    low, fast = through(both.difference.at(frequency), drifting), both.total.at(frequency)
    parts[ALL_SECOND_ORDER] = _diagonal(low) + powers_through(fast, response)
    return parts, low, fast


def _products(
    expanded: Expanded, asked: Outputs, slow: ComplexArray, waves: ComplexArray, frequency: FloatArray
) -> ComplexArray:
    """Spectra of -1/2 r'' : x x and of further quadratic quantities from slow motion, alone and with that of waves."""
    # Of slow motion g and waves h, 2 tr(C R_g C R_g') + 4 tr(C R_h C R_g') is one form of g and of g + 2 h.
    curvature = np.sqrt(0.5) * np.concatenate([-expanded.curvature, asked.curvatures])
    return product_spectrum(frequency, slow, curvature, slow + 2.0 * waves)


def _mean_loads(
    expanded: Expanded, second: SecondOrder | None, sea: SeaOnGrid | None, state: State
) -> dict[str, FloatArray]:
    """Mean loads by part, earth-fixed, those of the second order by name."""
    loads = {name: value for name, value in expanded.loads.items() if name != SECOND_ORDER and np.any(value)}
    inverse = np.linalg.inv(expanded.system.loads)
    if second is not None and sea is not None:
        found = means(second, sea.grid)
        loads |= {name: inverse @ found[name][:6] for name in WITH_MEAN if name in found}
    loads["tethers"] = -0.5 * inverse @ np.einsum("ijk,jk->i", expanded.curvature, state.position)
    return loads
