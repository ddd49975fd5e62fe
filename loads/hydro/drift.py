"""Slow drift of second order: quadratic transfer functions at the waves of a sea, spectra of the force, and damping.

With the amplitudes a_i of a sea (`tlpsim.loads.waves.sea`) the slowly varying force about the origin is (Pinkster 1980)

    F(t) = Σ_i Σ_j a_i a_j* T(ω_i, β_i; ω_j, β_j),   T_ji = T_ij*                                           (1)

so F is real. The mean drift a unit amplitude squared, D = T_ii, and the spectra of a sea of independent directions m of
one-sided spectra S_m (Pinkster 1980) are

    E[F] = 2 Σ_m ∫ S_m(f) D_m(f) df                                                                        (2)
    S_F(μ) = 8 Σ_m Σ_n ∫ S_m(f) S_n(f + μ) |T_mn(f, f + μ)|² df                                            (3)

The double sum counts each pair twice, which makes the 2 of eq. (2) from E|a|² = 2 S df, and in eq. (3) the amplitude
2 |a_i| |a_j| |T_ij| at the frequency μ, of which half the square is 8 S_i S_j |T|² df dμ.

T comes from the mean drift by Newman's approximation (Newman 1974; `tlpsim.loads.bem.quadratic.newman`),

    T_ij = ½ (D_i + D_j)     or     T_ij = sign √(D_i D_j), zero where the signs differ                    (4)

or from a table. A table of one heading says nothing about waves of two headings, which take part in eq. (3) though not
in eq. (2). Left out, they would make the spread fall with the number of directions that a spread sea is made of, M
equal ones to 1/√M. In eq. (4) D_i and D_j are each of its own heading; a table is averaged in the same way,

    T(ω_i, β_i; ω_j, β_j) = ½ [T(ω_i, ω_j; β_i) + T(ω_i, ω_j; β_j)]                                         (5)

Both leave out that two waves of different headings meet with other phases at the parts of a hull than two of the same
heading. For the fixed ISSC hull in a sea of five directions (cos-2s, s = 10, Pierson-Moskowitz, Tp = 14.5 s), with the
quadratic parts of all pairs of headings as the truth, eq. (5) makes the spreads below 0.022 Hz 1.23 times those of the
truth in surge, 0.76 in sway, 1.16 in heave, 0.34 in roll, 0.85 in pitch and 0.23 in yaw (`benchmarks/drift.py`): waves
of two headings turn a square hull far more than those of one. A table of pairs of headings needs none of this, and is
what yaw in a spread sea asks for.

Headings are interpolated as those of first-order forces (`tlpsim.loads.hydro.diffraction`), frequencies by cubic
splines. T goes with ω_i ω_j below the lowest frequency of the data, so that D goes to zero as ω², and above the highest
one by the cosine that takes D to zero by cos² as it does first-order forces.

Wave drift damping. Aranha's B of the mean drift (`tlpsim.loads.bem.drift_damping`), averaged as eq. (2), is the matrix
of the force -B v on a platform that moves slowly with v in surge and sway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.drift_damping import wave_drift_damping as aranha
from tlpsim.loads.bem.quadratic import newman
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, adjoint
from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.diffraction import LARGEST_HEADING_STEP, TAPER, at_heading, round_the_circle
from tlpsim.loads.remembered import remembered
from tlpsim.loads.waves.elevation import transition
from tlpsim.loads.waves.sea import SeaState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SPECTRUM_STEP = 5e-4
"""Hz, of the frequencies of eqs. (2), (3)."""

_NOTHING = 1e-9  # of the largest component: below it there is only rounding
_HIGHEST = 1.1  # of the highest frequency of the waves, where they have faded out
_FEWEST_FREQUENCIES = 2
_TABLE = "the quadratic transfer function"
_damping = remembered(4)(aranha)


class Waves(NamedTuple):
    """Components of a sea: angular frequencies (N,) in rad/s, and headings (N,) in rad."""

    omega: FloatArray
    heading: FloatArray


Kernel = Callable[[Waves, Waves, int], ComplexArray]
"""T of eq. (1) of first (N,) and second waves (L,) and a degree of freedom, (N, L), N/m² or N·m/m²."""


def completed_drift(database: HydrodynamicDatabase) -> tuple[FloatArray, FloatArray]:
    """Headings, and mean drift (headings, frequencies, 6), with those that the hull's symmetry gives.

    Raises
    ------
    ScenarioError
        If the database has no mean drift, or a single frequency.
    """
    drift = database.mean_drift
    if len(database.omega) < _FEWEST_FREQUENCIES or not np.all(np.isfinite(drift)):
        raise ScenarioError(
            f"the hydrodynamic database has {len(database.omega)} frequencies, or mean drift that is not known at some "
            "of them; slow drift needs it at two or more, and at all of them: compute the database with `tlpsim bem`, "
            'or do without slow drift (waves.drift = "none")'
        )
    six = np.zeros((*drift.shape[:2], 6), dtype=np.complex128)
    six[..., list(HORIZONTAL) if drift.shape[2] == len(HORIZONTAL) else slice(6)] = drift
    headings, whole = round_the_circle(database.heading, _without_rounding(six))
    return headings, np.asarray(whole.real)


def _without_rounding(table: ComplexArray) -> ComplexArray:
    """A table (..., 6) whose components that are nothing but rounding are zero: they would hide the symmetry."""
    largest = np.max(np.abs(table), axis=tuple(range(table.ndim - 1)))
    return np.where(largest > _NOTHING * np.max(largest, initial=0.0), table, 0.0)


def _margin(omega: FloatArray, band: FloatArray) -> FloatArray:
    """Factor of T for a frequency beyond the band of the data, one for either wave."""
    beyond = np.clip((omega / band[-1] - 1.0) / TAPER, 0.0, 1.0)
    return np.asarray(np.minimum(omega / band[0], 1.0) * np.cos(0.5 * np.pi * beyond))


@remembered(8)
def _onto(omega: FloatArray, band: FloatArray) -> FloatArray:
    """Matrix (N, n) of the cubic spline from the frequencies of the data to those of waves, with the factor beyond."""
    spline = CubicSpline(band, np.eye(len(band)))(np.clip(omega, band[0], band[-1]))
    return np.asarray(spline * _margin(omega, band)[:, None])


def drift_coefficients(database: HydrodynamicDatabase, waves: Waves) -> tuple[FloatArray, FloatArray]:
    """Mean drift D of a database at the waves of a sea.

    Returns
    -------
    D within the band of the data, shape (6, N), N/m² and N·m/m², and the factor beyond it, shape (N,), whose square
    times the first one is the mean drift.

    Raises
    ------
    ScenarioError
        If the database has no mean drift, or neither a heading nor headings to interpolate it from.
    """
    headings, table = completed_drift(database)
    inside = np.clip(waves.omega, database.omega[0], database.omega[-1])
    result = np.zeros((6, len(waves.omega)))
    for value in np.unique(waves.heading):
        chosen = waves.heading == value
        drift = at_heading(headings, table.astype(np.complex128), float(value)).real
        result[:, chosen] = CubicSpline(database.omega, drift)(inside[chosen]).T
    return result, _margin(waves.omega, database.omega)


def newman_kernel(database: HydrodynamicDatabase, mean: str = "arithmetic") -> Kernel:
    """T of eq. (4) from the mean drift of a database; `mean` is "arithmetic" or "geometric"."""

    @remembered(2)
    def coefficients(*both: FloatArray) -> tuple[FloatArray, FloatArray]:
        return drift_coefficients(database, Waves(*both))

    def kernel(first: Waves, second: Waves, component: int) -> ComplexArray:
        drift, margin = coefficients(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))
        split = len(first.omega)
        matrix = newman(drift[component], mean)[:split, split:]
        return np.asarray(margin[:split, None] * matrix * margin[split:], dtype=np.complex128)

    return kernel


def quadratic_kernel(table: QuadraticTransfer) -> Kernel:
    """T of a table at the waves of a sea; for pairs of headings by eq. (5) unless the table has them."""
    count = len(table.omega)
    transfer = _without_rounding(0.5 * (table.transfer + adjoint(table.transfer)))
    if table.transfer.ndim == 5:
        return lambda first, second, component: _blocks(
            table.omega, first, second, lambda a, b: _of_pair(table.heading, transfer[..., component], a, b)
        )
    headings, flat = round_the_circle(table.heading, transfer.reshape(len(table.heading), count * count, 6))
    whole = flat.reshape(len(headings), count, count, 6)
    at = cache(partial(at_heading, headings, whole, name=_TABLE))
    return lambda first, second, component: _blocks(
        table.omega, first, second, lambda a, b: 0.5 * (at(a)[..., component] + at(b)[..., component])
    )


def _of_pair(headings: FloatArray, transfer: ComplexArray, first: float, second: float) -> ComplexArray:
    return at_heading(headings, at_heading(headings, transfer, first, _TABLE), second, _TABLE)


def _blocks(
    band: FloatArray, first: Waves, second: Waves, table: Callable[[float, float], ComplexArray]
) -> ComplexArray:
    """T (N, L) from tables (n, n) of the pairs of headings of the waves."""
    result = np.empty((len(first.omega), len(second.omega)), dtype=np.complex128)
    rows, columns = (
        {float(value): np.flatnonzero(waves.heading == value) for value in np.unique(waves.heading)}
        for waves in (first, second)
    )
    before = {value: _onto(first.omega[chosen], band) for value, chosen in rows.items()}
    after = {value: _onto(second.omega[chosen], band) for value, chosen in columns.items()}
    for a, row in rows.items():
        for b, column in columns.items():
            result[np.ix_(row, column)] = before[a] @ table(a, b) @ after[b].T
    return result


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftSpectrum:
    """Mean and spectrum of slow drift.

    Attributes
    ----------
    frequency
        Difference frequencies μ in Hz from zero, evenly spaced, shape (n,).
    density
        One-sided, eq. (3), shape (6, n), N²/Hz and (N·m)²/Hz.
    mean
        Eq. (2), shape (6,), N and N·m.
    """

    frequency: FloatArray
    density: FloatArray
    mean: FloatArray

    def spread(self, lowest: float = 0.0, highest: float = np.inf) -> FloatArray:
        """Standard deviation in the band between two frequencies (Hz), shape (6,), by the trapezoidal rule."""
        ends = np.clip([lowest, highest], self.frequency[0], self.frequency[-1])
        inside = self.frequency[(self.frequency > ends[0]) & (self.frequency < ends[1])]
        at = np.unique(np.concatenate([ends, inside]))
        values = np.array([np.interp(at, self.frequency, row) for row in self.density])
        return np.asarray(np.sqrt(np.trapezoid(values, at, axis=1)))


def _acting(state: SeaState, step: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies in Hz, middles of steps from zero, and the spectrum of the waves that act, m²/Hz."""
    count = int(_HIGHEST * state.highest_frequency / require_positive("frequency step of slow drift", step, "Hz"))
    frequency = np.asarray(step * (np.arange(count) + 0.5), dtype=np.float64)
    return frequency, np.asarray(state.density(frequency) * transition(frequency, state.highest_frequency) ** 2)


def mean_drift_force(database: HydrodynamicDatabase, state: SeaState, step: float = SPECTRUM_STEP) -> FloatArray:
    """Mean of the slow drift of a sea, eq. (2), shape (6,), N and N·m, from the mean drift of a database.

    Parameters
    ----------
    database
        With mean drift.
    state, step
        As for `drift_spectrum`.

    Raises
    ------
    ScenarioError
        If the database has no mean drift, or neither a heading nor headings to interpolate it from.
    """
    frequency, density = _acting(state, step)
    parts = state.spread()
    result = np.zeros(6)
    for share, heading in zip(parts.share, parts.heading, strict=True):
        waves = Waves(2.0 * np.pi * frequency, np.full(len(frequency), heading))
        drift, margin = drift_coefficients(database, waves)
        result += 2.0 * share * step * (drift @ (density * margin**2))
    return result


def mean_quadratic_force(kernel: Kernel, state: SeaState, step: float = SPECTRUM_STEP) -> FloatArray:
    """Mean of the slow drift of a sea, eq. (2), shape (6,), N and N·m, from the diagonal of T.

    Parameters
    ----------
    kernel, state, step
        As for `drift_spectrum`.
    """
    frequency, density = _acting(state, step)
    parts = state.spread()
    result = np.zeros(6)
    for share, heading in zip(parts.share, parts.heading, strict=True):
        waves = Waves(2.0 * np.pi * frequency, np.full(len(frequency), heading))
        diagonal = np.array([np.diagonal(kernel(waves, waves, component)).real for component in range(6)])
        result += 2.0 * share * step * (diagonal @ density)
    return result


def drift_spectrum(kernel: Kernel, state: SeaState, step: float = SPECTRUM_STEP) -> DriftSpectrum:
    """Mean and spectrum of the slow drift of a sea without any filter, eqs. (2) and (3).

    Parameters
    ----------
    kernel
        From `newman_kernel` or `quadratic_kernel`.
    state
        The sea; its waves act up to its highest frequency as those of `tlpsim.loads.waves.elevation` do.
    step
        Of frequencies, Hz.
    """
    frequency, density = _acting(state, step)
    count = len(frequency)
    parts = state.spread()
    trains = [Waves(2.0 * np.pi * frequency, np.full(count, value)) for value in parts.heading]
    result = np.zeros((6, count))
    for component in range(6):
        for m, first in enumerate(trains):
            for n, second in enumerate(trains):
                matrix = kernel(first, second, component)
                energy = np.abs(matrix) ** 2 * (8.0 * parts.share[m] * parts.share[n] * step)
                energy *= density[:, None] * density
                result[component] += [np.trace(energy, offset=k) for k in range(count)]
    return DriftSpectrum(
        frequency=np.asarray(step * np.arange(count), dtype=np.float64),
        density=result,
        mean=mean_quadratic_force(kernel, state, step),
    )


def wave_drift_damping(database: HydrodynamicDatabase, state: SeaState, step: float = SPECTRUM_STEP) -> FloatArray:
    """Wave drift damping of a platform that moves slowly in a sea, 2 Σ_m ∫ S_m B df.

    Parameters
    ----------
    database
        With mean drift; headings to either side of those of the sea, directly or by symmetry.
    state
        The sea.
    step
        Of frequencies, Hz.

    Returns
    -------
    Shape (6, 6), rows forces in surge and sway and the moment in yaw, columns velocities in surge and sway, N·s/m and
    N·s; all else is zero. Where waves push a hull less the shorter they are, a diagonal element can be negative.

    Raises
    ------
    ScenarioError
        If the database has no mean drift, or no headings for the derivative at those of the sea.
    """
    headings, table = completed_drift(database)
    headings, order, closed = _arc(headings)
    table = table[order]
    drift = np.swapaxes(table[..., list(HORIZONTAL)], 0, 1)
    damping = _damping(drift, database.omega, headings, database.gravity)
    frequency, density = _acting(state, step)
    weight = _onto(2.0 * np.pi * frequency, database.omega) * _margin(2.0 * np.pi * frequency, database.omega)[:, None]
    by_heading = 2.0 * step * np.einsum("f,fn,nhij->hij", density, weight, damping, optimize=True)
    if closed:
        by_heading[-1] = by_heading[0]
    spline = CubicSpline(headings, by_heading, bc_type="periodic" if closed else "not-a-knot")
    parts = state.spread()
    turned = headings[0] + np.mod(parts.heading - headings[0], 2.0 * np.pi)
    gap = float(np.max(np.diff(headings)))
    if np.max(turned) > headings[-1] or gap > LARGEST_HEADING_STEP + _NOTHING:
        raise ScenarioError(
            f"wave drift damping: the mean drift is known for headings from {np.degrees(headings[0]):.4g} to "
            f"{np.degrees(headings[-1]):.4g}°, steps up to {np.degrees(gap):.4g}° (with those that symmetry gives); "
            f"the sea has waves toward {np.degrees(parts.heading[np.argmax(turned)]):.4g}°; compute it for headings to "
            f"either side, in steps of at most {np.degrees(LARGEST_HEADING_STEP):g}°"
        )
    result = np.zeros((6, 6))
    result[np.ix_(HORIZONTAL, HORIZONTAL[:2])] = np.einsum("m,mij->ij", parts.share, spline(turned))
    return result


def _arc(headings: FloatArray) -> tuple[FloatArray, NDArray[np.int64], bool]:
    """Headings rising along their arc, which ends where they are furthest apart, their order, and if it is a circle."""
    count = len(headings)
    if count == 1:
        return headings, np.zeros(1, dtype=np.int64), False
    gaps = np.mod(np.roll(headings, -1) - headings, 2.0 * np.pi)
    order = (int(np.argmax(gaps)) + 1 + np.arange(count)) % count
    rising = headings[order[0]] + np.mod(headings[order] - headings[order[0]], 2.0 * np.pi)
    if np.max(gaps) > LARGEST_HEADING_STEP + _NOTHING:
        return rising, order, False
    return np.append(rising, rising[0] + 2.0 * np.pi), np.append(order, order[0]), True
