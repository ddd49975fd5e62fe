"""Radiation memory as a recursive filter: a passive state-space fit of the retardation functions.

    z' = Z z + G v,   F = -(C z + D v),   K(t) ≈ C exp(Z t) G,   H(omega) = C (i omega - Z)^-1 G + D          (1)
    Re H(omega) + Re H(omega)^T >= 0 at every omega                                                      (2)

For each group of coupled degrees of freedom, scaled to a largest damping of one:

1. K is sampled at dt and zero beyond its end. Its block Hankel matrix is symmetric; its eigenvalues are, but for the
   sign, the Hankel singular values, and balanced truncation (Kung 1978) gives Z and G, and is stable since the
   samples are those of a finite filter. Z is the logarithm of the discrete matrix over dt.
2. C makes the squared error of H least over the band, under eq. (2) as linear constraints x^T Re H x >= 0 at the
   frequencies and in the directions x where it is broken: a least-distance problem (Lawson and Hanson 1974, ch. 23),
   solved again with further constraints until none is broken. D is a small damping that leaves room for rounding.
3. Eq. (2) is certified for all frequencies by the Hamiltonian matrix of eq. (1), which has an imaginary eigenvalue
   i omega exactly where an eigenvalue of eq. (2) passes through zero (Boyd, Balakrishnan and Kabamba 1989).

The filter runs by the trapezoidal rule, which keeps eq. (2) at any step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.sparse.csgraph import connected_components
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.errors import SolverError
from tlpsim.loads.hydro.radiation import LONGEST_STEP, Radiation, trapezoid
from tlpsim.loads.platform.memory import DiscreteMemory, recursion

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TOLERANCE = 0.015
"""Root mean square error of H over that of H, at which the order of a group is enough; else the best one is taken."""
LARGEST_ORDER = 40
"""States of a group of coupled degrees of freedom."""
ORDER_STEP = 2
SMALL_DAMPING = 1e-5
"""D relative to the largest damping of a degree of freedom."""

SLOW_FREQUENCY = 0.07
"""rad/s, of the slow motions in the horizontal plane; the added mass there is made exact."""

_SAMPLING_STEP = 0.25
_GRID_STEP = 0.01
_BAND_SHARE = 1e-4  # of the largest damping, above which a frequency belongs to the band of the fit
_CONSTRAINT_END = 40.0
_SLOW, _LARGEST_WEIGHT = 1.0, 1e4
_MOST_ROUNDS = 40
_MARGIN = 0.5  # of D, kept when constraints are set
_ON_THE_AXIS = 1e-6  # relative distance of an eigenvalue that may lie on the imaginary axis
_LOOKS = 15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StateSpaceMemory:
    """Eq. (1) for six degrees of freedom.

    Attributes
    ----------
    added_mass : (6, 6) kg, kg·m, kg·m², beside the memory.
    dynamics, drive, output, direct : (m, m) Z 1/s, (m, 6) G, (6, m) C, (6, 6) D.
    error : largest root mean square error of H over that of H, over the groups of degrees of freedom.
    orders : number of states of each group.
    """

    added_mass: FloatArray
    dynamics: FloatArray
    drive: FloatArray
    output: FloatArray
    direct: FloatArray
    error: float
    orders: tuple[int, ...]

    @property
    def longest_step(self) -> float:
        """In s."""
        return LONGEST_STEP

    def discrete(self, step: float) -> DiscreteMemory:
        """The filter at a step in s, by the trapezoidal rule."""
        return _discrete(self, step)

    def response(self, omega: FloatArray) -> ComplexArray:
        """H at `omega` (n,) rad/s: force over velocity, (n, 6, 6)."""
        return np.asarray(self.output @ _states(self.dynamics, self.drive, np.asarray(omega)) + self.direct)


@lru_cache(maxsize=16)
def _discrete(memory: StateSpaceMemory, step: float) -> DiscreteMemory:
    identity = np.eye(len(memory.dynamics))
    half = 0.5 * step * memory.dynamics
    drive = np.asarray(np.linalg.solve(identity - half, 0.5 * step * memory.drive), dtype=np.float64)
    transition = np.linalg.solve(identity - half, identity + half)
    return recursion(
        memory.output @ drive + memory.direct, np.where(memory.dynamics != 0.0, transition, 0.0), drive, memory.output
    )


def state_space_memory(radiation: Radiation) -> StateSpaceMemory:
    """Fit a passive filter to the radiation of a hull.

    Raises
    ------
    SolverError
        If no passive filter is found.
    """
    joined = np.zeros((6, 6), dtype=np.bool_)
    joined[radiation.pairs[:, 0], radiation.pairs[:, 1]] = True
    _, labels = connected_components(joined, directed=False)
    parts = []
    for label in np.unique(labels):
        group = np.flatnonzero(labels == label)
        if joined[np.ix_(group, group)].any():
            with threadpool_limits(limits=1, user_api="blas"):  # matrices of this size are slower with more
                parts.append((group, *_fit_group(radiation, group)))
    size = sum(len(z) for _, z, *_ in parts)
    dynamics, drive, output = np.zeros((size, size)), np.zeros((size, 6)), np.zeros((6, size))
    direct, first, error = np.zeros((6, 6)), 0, 0.0
    for group, z, g, c, d, misfit in parts:
        states = slice(first, first + len(z))
        dynamics[states, states] = z
        drive[states, group] = g * radiation.scale[group]
        output[group, states] = radiation.scale[group, None] * c
        direct[np.ix_(group, group)] = d * np.outer(radiation.scale[group], radiation.scale[group])
        first, error = first + len(z), max(error, misfit)
    return StateSpaceMemory(
        added_mass=radiation.added_mass_infinite - _slow_error(radiation, dynamics, drive, output),
        dynamics=dynamics,
        drive=drive,
        output=output,
        direct=direct,
        error=error,
        orders=tuple(len(z) for _, z, *_ in parts),
    )


def _slow_error(radiation: Radiation, dynamics: FloatArray, drive: FloatArray, output: FloatArray) -> FloatArray:
    """Added mass (6, 6) that the filter has too much of at `SLOW_FREQUENCY`."""
    phase = np.sin(SLOW_FREQUENCY * radiation.time) * trapezoid(radiation.time)
    exact = -np.tensordot(phase, radiation.retardation, axes=1)
    found = output @ _states(dynamics, drive, np.array([SLOW_FREQUENCY]))[0].imag
    error = (found - exact) / SLOW_FREQUENCY
    return np.asarray(0.5 * (error + error.T))


def _fit_group(
    radiation: Radiation, group: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Z, G, C and D of one group in scaled units, and the error."""
    scale = np.outer(radiation.scale[group], radiation.scale[group])
    kernel = radiation.retardation[:, group[:, None], group] / scale
    damping = radiation.damping[:, group[:, None], group] / scale
    weights = trapezoid(radiation.time)
    alive = np.flatnonzero(np.max(np.abs(damping), axis=(1, 2)) > _BAND_SHARE)
    omega = np.arange(0.0, min(radiation.omega[alive[-1]], 0.25 * np.pi / _SAMPLING_STEP), _GRID_STEP)
    phase = np.exp(-1j * np.outer(omega, radiation.time)) * weights
    exact = np.asarray(np.tensordot(phase, kernel, axes=1), dtype=np.complex128)
    count = int(radiation.duration / _SAMPLING_STEP) + 1
    sampled = np.array(
        [
            [np.interp(_SAMPLING_STEP * np.arange(count), radiation.time, kernel[:, i, j]) for j in range(len(group))]
            for i in range(len(group))
        ]
    ).transpose(2, 0, 1)
    values, vectors = _hankel(sampled)
    best: tuple[FloatArray, FloatArray, FloatArray, FloatArray, float] | None = None
    for order in range(2 * len(group), LARGEST_ORDER + 1, ORDER_STEP):
        model = _truncated(values, vectors, order, len(group))
        if model is None:
            continue
        output = _passive_output(*model, omega, exact)
        if output is None:
            continue
        direct = SMALL_DAMPING * np.eye(len(group))
        error = _misfit(*model, output, omega, exact)
        if is_passive(*model, output, direct) and (best is None or error < best[4]):
            best = (*model, output, direct, error)
            if error <= TOLERANCE:
                break
    if best is None:
        raise SolverError(
            f"radiation of degrees of freedom {group.tolist()}: no passive filter of up to {LARGEST_ORDER} states was "
            "found; take the convolution"
        )
    return best


def _hankel(sampled: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues, largest magnitude first, and vectors of the block Hankel matrix of samples (n, m, m)."""
    count, size, _ = sampled.shape
    padded = np.concatenate([sampled, np.zeros_like(sampled)])
    index = np.add.outer(np.arange(count), np.arange(count))
    matrix = padded[index].transpose(0, 2, 1, 3).reshape(count * size, count * size)
    values, vectors = scipy.linalg.eigh(matrix)
    order = np.argsort(-np.abs(values))[: LARGEST_ORDER + 1]
    return values[order], vectors[:, order]


def _truncated(values: FloatArray, vectors: FloatArray, order: int, size: int) -> tuple[FloatArray, FloatArray] | None:
    """Z and G of a balanced truncation; None where a mode has no continuous counterpart."""
    root = np.sqrt(np.abs(values[:order]))
    shifted = np.zeros_like(vectors[:, :order])
    shifted[:-size] = vectors[size:, :order]
    # H = U S J U^T with J the signs, so that U S^1/2 observes and S^1/2 J U^T controls.
    discrete = (vectors[:, :order].T @ shifted) * (root / root[:, None])
    modes = np.linalg.eigvals(discrete)
    if np.any((np.abs(modes.imag) < 1e-12) & (modes.real <= 0.0)):
        return None
    drive = (root * np.sign(values[:order]))[:, None] * vectors[:size, :order].T
    continuous = scipy.linalg.logm(discrete) / _SAMPLING_STEP
    if np.max(np.abs(np.imag(continuous))) > 1e-8 * np.max(np.abs(continuous)):
        return None
    real = np.ascontiguousarray(np.real(continuous))
    return (real, drive) if np.max(np.linalg.eigvals(real).real) < 0.0 else None


def _states(dynamics: FloatArray, drive: FloatArray, omega: FloatArray) -> ComplexArray:
    """(i omega - Z)^-1 G, (n, order, size)."""
    modes, vectors = np.linalg.eig(dynamics)
    shares = np.linalg.solve(vectors, drive.astype(np.complex128))
    return np.asarray(vectors @ (shares / (1j * omega[:, None, None] - modes[:, None])))


def _misfit(
    dynamics: FloatArray, drive: FloatArray, output: FloatArray, omega: FloatArray, exact: ComplexArray
) -> float:
    error = output @ _states(dynamics, drive, omega) - exact
    return float(np.linalg.norm(error) / np.linalg.norm(exact))


def _passive_output(
    dynamics: FloatArray, drive: FloatArray, omega: FloatArray, exact: ComplexArray
) -> FloatArray | None:
    """C of least error under eq. (2), (size, order); None where the constraints cannot be met."""
    size, order = drive.shape[1], len(dynamics)
    states = _states(dynamics, drive, omega)
    weight = np.minimum(1.0 + (_SLOW / np.maximum(omega, _GRID_STEP)) ** 2, _LARGEST_WEIGHT)[:, None, None]
    tall = np.concatenate([weight * states.real, weight * states.imag]).transpose(0, 2, 1).reshape(-1, order)
    target = np.concatenate([weight * exact.real, weight * exact.imag]).transpose(0, 2, 1).reshape(-1, size)
    q, r = np.linalg.qr(tall)
    free = np.linalg.solve(r, q.T @ target).T
    grid = np.concatenate([np.arange(0.0, 2.0 * omega[-1], _GRID_STEP), np.geomspace(2.0 * omega[-1], _CONSTRAINT_END)])
    on_grid = _states(dynamics, drive, grid).real
    direct = SMALL_DAMPING * np.eye(size)
    inverse = np.linalg.inv(r)
    rows: list[FloatArray] = []
    output = free
    for _ in range(_MOST_ROUNDS):
        damping = output @ on_grid
        lowest = np.asarray(np.linalg.eigvalsh(0.5 * (damping + damping.transpose(0, 2, 1)))[:, 0], dtype=np.float64)
        broken = grid[_lowest_points(lowest, -_MARGIN * SMALL_DAMPING)]
        if not len(broken):
            broken = active_frequencies(dynamics, drive, output, direct)
        if not len(broken):
            return output
        for seen in _states(dynamics, drive, broken).real:
            damping = output @ seen
            x = np.linalg.eigh(0.5 * (damping + damping.T))[1][:, 0]
            rows.append(np.outer(x, seen @ x).ravel())
        # min |R (C - C_free)^T| under x^T C seen x >= 0: least distance in y = R (C - C_free)^T.
        constraints = np.array(rows)
        shifted = (constraints.reshape(-1, size, order) @ inverse).reshape(len(rows), -1)
        solution = _least_distance(shifted, -constraints @ free.ravel())
        if solution is None:
            return None
        output = free + solution.reshape(size, order) @ inverse.T
    return None


def _lowest_points(values: FloatArray, floor: float) -> NDArray[np.int64]:
    """Local minima below a floor."""
    padded = np.concatenate([[np.inf], values, [np.inf]])
    lowest = (padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:])
    return np.flatnonzero(lowest & (values < floor))


def _least_distance(constraints: FloatArray, bounds: FloatArray) -> FloatArray | None:
    """The y of least norm with `constraints` y >= `bounds` (Lawson and Hanson, LDP); None if there is none."""
    scale = np.linalg.norm(constraints, axis=1)
    stacked = np.vstack([(constraints / scale[:, None]).T, bounds / scale])
    last = np.zeros(len(stacked))
    last[-1] = 1.0
    weights, _ = nnls(stacked, last, maxiter=50 * stacked.shape[1])
    residual = stacked @ weights - last
    return None if abs(residual[-1]) < 1e-14 else -residual[:-1] / residual[-1]


def is_passive(dynamics: FloatArray, drive: FloatArray, output: FloatArray, direct: FloatArray) -> bool:
    """Whether a filter is stable and eq. (2) holds at every frequency."""
    stable = np.max(np.linalg.eigvals(dynamics).real) < 0.0
    return bool(stable) and not len(active_frequencies(dynamics, drive, output, direct))


def active_frequencies(dynamics: FloatArray, drive: FloatArray, output: FloatArray, direct: FloatArray) -> FloatArray:
    """A frequency in rad/s of each band where a filter feeds energy in, (n,); none if eq. (2) holds everywhere.

    An eigenvalue of Re H + Re H^T changes its sign only where the Hamiltonian matrix has an imaginary eigenvalue, so
    that one look between two of these tells for the whole band; in a broken one its worst point is searched.
    """
    inverse = np.linalg.inv(direct + direct.T)
    upper = dynamics - drive @ inverse @ output
    hamiltonian = np.block([[upper, -drive @ inverse @ drive.T], [output.T @ inverse @ output, -upper.T]])
    eigenvalues = np.linalg.eigvals(hamiltonian)
    near = np.abs(eigenvalues.real) < _ON_THE_AXIS * (1.0 + np.abs(eigenvalues))
    crossings = np.sort(np.abs(eigenvalues[near].imag))
    edges = np.concatenate([[0.0], crossings, [2.0 * np.max(np.abs(eigenvalues))]])
    broken = []
    for low, high in pairwise(edges):
        inside = low + (high - low) * np.linspace(0.02, 0.98, _LOOKS)
        damping = (output @ _states(dynamics, drive, inside)).real + direct
        lowest = np.linalg.eigvalsh(0.5 * (damping + damping.transpose(0, 2, 1)))[:, 0]
        if np.min(lowest) < 0.0:
            broken.append(inside[np.argmin(lowest)])
    return np.array(broken)
