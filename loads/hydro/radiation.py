"""The memory of radiated waves in time, from added mass and damping against frequency (Cummins 1962; Ogilvie 1964).

    F(t) = -A_inf x'' - int_0^t K(tau) x'(t - tau) dtau                                                   (1)
    K(t) = 2/pi int_0^inf B(omega) cos(omega t) domega                                                    (2)
    A(omega) = A_inf - 1/omega int_0^inf K(t) sin(omega t) dt                                             (3)

B goes from zero at omega = 0 by a cubic spline through the database, without its asymmetry and negative eigenvalues,
which are errors of the panels, and beyond the highest frequency as omega⁻³, the law of a wall that makes short waves.
K is cut where it has died out to 0.2 % of its start, over its last fifth by cos². Eq. (3) at each frequency of the
database gives an A_inf; they agree where B and A belong together, and their mean over the lower half of the
frequencies is taken. It holds what B beyond the database adds in that band, and needs no other source for A_inf.

Direct convolution: eq. (1) by the trapezoidal rule at the integrator's step h, a digital filter of K(0) h / 2, K(h) h,
K(2h) h ... Its damping is the sum of B over all aliases of a frequency, so it feeds no energy in, but for what the cut
at the end does: 5e-5 of the largest damping on the ISSC TLP.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.memory import DiscreteMemory, convolution

FloatArray = NDArray[np.float64]

LONGEST_STEP = 0.25
"""s, at which the trapezoidal rule adds h² K(0) / 12 to the added mass, 0.1 % of it in surge of the ISSC TLP."""
SHORTEST_MEMORY, LONGEST_MEMORY = 20.0, 200.0
"""s"""
NEGLIGIBLE = 2e-3
"""Part of its start below which a retardation function is over."""
LARGEST_DISAGREEMENT = 0.05
"""Spread of A_inf by eq. (3) relative to its mean above which A and B of a database contradict each other."""
FEWEST_FREQUENCIES = 8

_TAIL_POWER = 3.0
_TAIL_END = 4.0  # times the highest frequency
_FREQUENCY_STEP = 0.006
_TABLE_STEP = 0.1
_WINDOW_FLAT = 0.8
_COUPLED = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Radiation:
    """Radiation of a hull in frequency and time.

    Attributes
    ----------
    omega, damping : (n,) rad/s, (n, 6, 6) kg/s, B with its tail on a fine grid.
    added_mass_infinite : (6, 6) kg, kg·m, kg·m², by eq. (3).
    disagreement : largest root mean square deviation of A_inf by eq. (3), relative to the diagonal.
    time, retardation : (m,) s, (m, 6, 6) kg/s², K up to where it is over.
    pairs : (p, 2) int, force and motion of the entries of K that are not zero.
    scale : (6,) square root of the largest B in each degree of freedom, or 1 where there is none.
    """

    omega: FloatArray
    damping: FloatArray
    added_mass_infinite: FloatArray
    disagreement: float
    time: FloatArray
    retardation: FloatArray
    pairs: NDArray[np.int64]
    scale: FloatArray

    @property
    def duration(self) -> float:
        """Length of the memory, s."""
        return float(self.time[-1])


def radiation(database: HydrodynamicDatabase) -> Radiation:
    """Retardation functions and infinite-frequency added mass of a database, eqs. (2) and (3).

    Raises
    ------
    ScenarioError
        If it has too few frequencies, or its added mass and damping contradict each other.
    """
    count = len(database.omega)
    if count < FEWEST_FREQUENCIES:
        raise ScenarioError(
            f"the hydrodynamic database has {count} frequencies; radiation memory needs {FEWEST_FREQUENCIES} or more: "
            "compute it on a wider range, or take constant added mass"
        )
    if not (np.all(np.isfinite(database.added_mass)) and np.all(np.isfinite(database.radiation_damping))):
        raise ScenarioError(
            "the hydrodynamic database does not know added mass and damping at all of its frequencies; memory "
            "needs them: leave those frequencies out, or take constant added mass"
        )
    added = _symmetric(database.added_mass)
    peak = np.max(np.abs(np.diagonal(database.radiation_damping, axis1=1, axis2=2)), axis=0)
    scale = np.where(peak > 0.0, np.sqrt(np.where(peak > 0.0, peak, 1.0)), 1.0)
    outer = np.outer(scale, scale)
    omega, damping = _continued(database.omega, _symmetric(database.radiation_damping) / outer)
    table = np.asarray(_TABLE_STEP * np.arange(round(LONGEST_MEMORY / _TABLE_STEP) + 1), dtype=np.float64)
    kernel = _cosine_transform(omega, damping, table)
    start = np.sqrt(np.maximum(np.diagonal(kernel[0]), np.finfo(np.float64).tiny))
    relative = np.max(np.abs(kernel) / np.outer(start, start), axis=(1, 2), where=damping.any(axis=0), initial=0.0)
    alive = np.flatnonzero(relative > NEGLIGIBLE)
    duration = float(np.clip(table[alive[-1]] if len(alive) else 0.0, SHORTEST_MEMORY, LONGEST_MEMORY))
    kept = table <= duration + 0.5 * _TABLE_STEP
    time = table[kept]
    fade = np.clip((time / time[-1] - _WINDOW_FLAT) / (1.0 - _WINDOW_FLAT), 0.0, 1.0)
    kernel = kernel[kept] * np.cos(0.5 * np.pi * fade)[:, None, None] ** 2

    low = database.omega <= 0.5 * database.omega[-1]
    infinite = added[low] + _sine_transform(time, kernel, database.omega[low]) * outer
    mean = infinite.mean(axis=0)
    size = np.sqrt(np.abs(np.outer(np.diagonal(mean), np.diagonal(mean))))
    disagreement = float(np.max(np.sqrt(np.mean((infinite - mean) ** 2, axis=0)) / size))
    if disagreement > LARGEST_DISAGREEMENT:
        raise ScenarioError(
            f"added mass and damping of the hydrodynamic database contradict each other: infinite-frequency added mass "
            f"by Ogilvie's relation varies by {100.0 * disagreement:.2g} %, limit {100.0 * LARGEST_DISAGREEMENT:g} %; "
            f"compute it on a range wider than {database.omega[0]:.3g} to {database.omega[-1]:.3g} rad/s or with "
            "closer frequencies"
        )
    return Radiation(
        omega=omega,
        damping=damping * outer,
        added_mass_infinite=mean,
        disagreement=disagreement,
        time=time,
        retardation=kernel * outer,
        pairs=np.argwhere(np.max(np.abs(damping), axis=0) > _COUPLED).astype(np.int64),
        scale=scale,
    )


def _symmetric(matrices: FloatArray) -> FloatArray:
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2))


def _continued(omega: FloatArray, damping: FloatArray) -> tuple[FloatArray, FloatArray]:
    """B on a fine grid from zero to the end of its tail, without negative eigenvalues."""
    count = int(np.ceil(_TAIL_END * omega[-1] / _FREQUENCY_STEP))
    fine = np.linspace(0.0, _TAIL_END * omega[-1], count + 1)
    spline = CubicSpline(np.concatenate([[0.0], omega]), np.concatenate([np.zeros((1, 6, 6)), damping]))
    tail = (omega[-1] / np.maximum(fine, omega[-1])) ** _TAIL_POWER
    values, vectors = np.linalg.eigh(spline(np.minimum(fine, omega[-1])) * tail[:, None, None])
    positive = np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, 0.0), vectors)
    coupled = np.max(np.abs(damping), axis=0) > _COUPLED
    return fine, np.where(coupled, positive, 0.0)


def trapezoid(grid: FloatArray) -> FloatArray:
    """Weights (n,) of the trapezoidal rule on an even grid."""
    weights = np.full(len(grid), grid[1] - grid[0])
    weights[[0, -1]] *= 0.5
    return weights


def _cosine_transform(omega: FloatArray, damping: FloatArray, time: FloatArray) -> FloatArray:
    """Eq. (2) at times (m,), (m, 6, 6)."""
    weighted = (damping * (2.0 / np.pi * trapezoid(omega))[:, None, None]).reshape(len(omega), -1)
    used = np.flatnonzero(weighted.any(axis=0))
    result = np.zeros((len(time), weighted.shape[1]))
    result[:, used] = np.cos(np.outer(time, omega)) @ weighted[:, used]
    return result.reshape(len(time), 6, 6)


def _sine_transform(time: FloatArray, kernel: FloatArray, omega: FloatArray) -> FloatArray:
    """1/omega int K sin(omega t) dt of eq. (3), (n, 6, 6)."""
    phase = np.sin(np.outer(omega, time)) * trapezoid(time) / omega[:, None]
    return np.tensordot(phase, kernel, axes=1)


def frequency_response(memory: DiscreteMemory, omega: ArrayLike, step: float) -> NDArray[np.complex128]:
    """Force over velocity of discrete filters, (n, 6, 6): damping + i omega (A(omega) - A_inf), at `omega` rad/s."""
    phase = -1j * step * np.atleast_1d(np.asarray(omega, dtype=np.float64))
    result = np.zeros((len(phase), 6, 6), dtype=np.complex128) + memory.direct
    if memory.taps.size:
        lags = np.exp(np.outer(phase, np.arange(1, len(memory.taps) + 1)))
        result[:, memory.pairs[:, 0], memory.pairs[:, 1]] += lags @ memory.taps
    identity = np.eye(len(memory.transition))
    for n, unit in enumerate(np.exp(phase) if memory.transition.size else ()):
        # z (1 - Z delay) = G (1 + delay) v, and D already holds C G v.
        states = np.linalg.solve(identity - memory.transition * unit, memory.drive * (1.0 + unit))
        result[n] += memory.output @ (states - memory.drive)
    return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConvolutionMemory:
    """Eq. (1) by direct convolution.

    Attributes
    ----------
    radiation : what the memory is of.
    """

    radiation: Radiation
    _spline: CubicSpline = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_spline", CubicSpline(self.radiation.time, self.radiation.retardation))

    @property
    def added_mass(self) -> FloatArray:
        """Added mass beside the memory, (6, 6)."""
        return self.radiation.added_mass_infinite

    @property
    def longest_step(self) -> float:
        """In s."""
        return LONGEST_STEP

    def discrete(self, step: float) -> DiscreteMemory:
        """Taps at a step in s."""
        return _taps(self, step)


def convolution_memory(radiation: Radiation) -> ConvolutionMemory:
    """Memory of a hull's radiation by direct convolution."""
    return ConvolutionMemory(radiation=radiation)


@lru_cache(maxsize=16)
def _taps(memory: ConvolutionMemory, step: float) -> DiscreteMemory:
    pairs = memory.radiation.pairs
    lags = step * np.arange(int(memory.radiation.duration / step) + 1)
    kernel = step * np.asarray(memory._spline(lags))
    direct = np.zeros((6, 6))
    direct[pairs[:, 0], pairs[:, 1]] = 0.5 * kernel[0, pairs[:, 0], pairs[:, 1]]
    return convolution(direct, pairs, kernel[1:, pairs[:, 0], pairs[:, 1]])
