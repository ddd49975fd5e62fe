"""Slow drift in time by pairs of quadratic filters on the waves of a sea.

A quadratic transfer function T_ij = T_ji* (`tlpsim.loads.hydro.drift`) becomes a sum of squares of linear quantities,

    F(t) = Σ_i Σ_j a_i a_j* T_ij = F_0 + Σ_r W_r |z_r(t)|²,   z_r = Σ_n Z_r(ω_n, β_n) a_n(t) = p_r + i q_r    (1)

p_r and q_r are two more rows of the matrix by which the amplitudes of any sea make its forces (eq. (1) of
`tlpsim.loads.hydro.excitation`): the rows Z_r and -i Z_r. For a sea by digital filters p_r is the discrete convolution
of the elevation with the kernel of Z_r, and q_r that with its quadrature. The waves at a displaced platform are the
amplitudes times exp(-ik(x cos β + y sin β)), for the squares as for all rows. |z|² holds difference frequencies only.

Newman's approximation, eq. (4) there, has at most two terms a component, of D in any state of the sea:

    ½ (D_i + D_j) = [(D_i + c)(D_j + c) - (D_i - c)(D_j - c)] / 4c                                           (2)
    sign √(D_i D_j): the rows √max(D, 0) and √max(-D, 0), with the weights 1 and -1                          (3)

for any c > 0. A table is decomposed with the variances w_n = E|a_n|² = 2 S df of the sea as weights (Naess 1986),

    √w_i T_ij √w_j = Σ_r λ_r ψ_ri ψ_rj*,   Z_r = ψ_r / √w,   W_r = λ_r                                        (4)

whose z_r are independent Gaussian processes with E|z_r|² = 1. So mean, variance and skewness of the force are

    Σ λ_r,   Σ λ_r²,   2 Σ λ_r³ / (Σ λ_r²)^(3/2)                                                             (5)

The terms are taken in the order of |λ_r| until the variance of those left out, Σ λ_r² over them, is small; their mean,
Σ λ_r, is kept as a constant force F_0. The trace and the norm of the matrix are the sums over all terms, so that only
the largest need be found.

For a sea by digital filters the window of samples must hold the memory of Z. That of D is longer than that of forces of
first order: where these turn with k b, b the half-length of the hull, D swings with 2 k b. Root mean square errors of
the rows of eq. (2), the worst of surge, sway and yaw, for the fixed ISSC hull in a sea of Pierson-Moskowitz with
Tp = 14.5 s (`benchmarks/drift.py`): 2.4e-2 with a reach of 91 m, that of the hull and its offset, and 1.0e-2 with
150 m. With 91 m mean and spread of 24 records of three hours are within 2 % of the integrals, at standard errors of 0.5
to 1.4 %. The kinks of eq. (3) where D changes its sign have no end: there it is 0.12 in yaw. Take eq. (2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.quadratic import newman
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.drift import Kernel, Waves, drift_coefficients
from tlpsim.loads.waves.sea import Sea, SeaState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DEFAULT_TOLERANCE = 0.005
"""Standard deviation of what is left out of a component of the force, relative to that of the component."""

_FLOOR = 1e-6  # of the largest variance, where the spectrum has next to nothing
_NOTHING = 1e-6  # of the largest force, or moment: a component below it is rounding
_LARGEST_DENSE = 600  # order up to which all terms are found at once
_FIRST_TERMS = 48


@dataclass(frozen=True, slots=True, kw_only=True)
class Truncation:
    """Certificate of the decomposition of one component, eqs. (4), (5).

    Attributes
    ----------
    component
        Name of the degree of freedom.
    terms, order
        Terms kept, and the number of wave components, which is that of all terms.
    mean, spread
        Of the whole force, N or N·m, for the variances that were the weights.
    skewness
        Of the terms kept.
    mean_share, spread_share
        Of the terms kept, relative to the whole; 1 where the whole is zero. The rest of the mean is a constant force.
    error
        Standard deviation of what is left out, relative to `spread`.
    """

    component: str
    terms: int
    order: int
    mean: float
    spread: float
    skewness: float
    mean_share: float
    spread_share: float
    error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftFilters:
    """Linear quantities whose squares make the slow drift, eq. (1).

    Attributes
    ----------
    transfer
        Z of the components of a sea, shape (R, N).
    weight
        W, shape (6, R).
    constant
        F_0, shape (6,), N and N·m; zero where nothing is left out.
    certificate
        One record a component that has been decomposed; none for Newman's approximation, which is exact as such.
    """

    transfer: ComplexArray
    weight: FloatArray
    constant: FloatArray
    certificate: tuple[Truncation, ...] = ()

    @property
    def rows(self) -> ComplexArray:
        """Transfer functions of p_0, q_0, p_1, q_1, ..., shape (2R, N), such as for the kernels of a sea."""
        return np.stack([self.transfer, -1j * self.transfer], axis=1).reshape(2 * len(self.transfer), -1)

    def table(self) -> str:
        """The certificate as text, one component a line."""
        head = f"{'':8}{'terms':>6}{'mean':>12}{'kept':>9}{'spread':>12}{'kept':>9}{'skewness':>10}{'error':>10}"
        lines = [
            f"{each.component:8}{each.terms:6d}{each.mean:12.4g}{each.mean_share:9.4f}{each.spread:12.4g}"
            f"{each.spread_share:9.4f}{each.skewness:10.3f}{each.error:10.2g}"
            for each in self.certificate
        ]
        return "\n".join([head, *lines])


def drift_force(filters: DriftFilters, amplitudes: ComplexArray) -> FloatArray:
    """Slow drift, eq. (1), for inspection; `tlpsim.loads.hydro.excitation.WaveLoads` makes it in a run.

    Parameters
    ----------
    amplitudes
        Of the sea at the platform, shape (..., N), m.

    Returns
    -------
    Shape (..., 6), N and N·m.
    """
    values = np.asarray(amplitudes) @ filters.transfer.T
    return np.asarray(filters.constant + (values.real**2 + values.imag**2) @ filters.weight.T)


def newman_filters(database: HydrodynamicDatabase, sea: Sea, mean: str = "arithmetic") -> DriftFilters:
    """Filters of Newman's approximation, eqs. (2) and (3), from the mean drift of a database.

    Parameters
    ----------
    database
        With mean drift of three or six components.
    sea
        Whose components the filters take.
    mean
        "arithmetic", or "geometric", which has half the rows where the drift keeps its sign. It has kinks where the
        drift changes it, and no force between waves of different signs.

    Raises
    ------
    ScenarioError
        If the database has no mean drift, no headings for those of the sea, or the mean is unknown.
    """
    newman(np.zeros(1), mean)  # raises where there is no such mean
    drift, margin = drift_coefficients(database, Waves(sea.angular_frequency, sea.heading))
    rows: list[FloatArray] = []
    weights: list[FloatArray] = []
    for component, values in enumerate(drift):
        largest = float(np.max(np.abs(values), initial=0.0))
        if largest == 0.0:
            continue
        if mean == "arithmetic":
            terms = [(values + largest, 0.25 / largest), (values - largest, -0.25 / largest)]
        else:
            terms = [(np.sqrt(np.maximum(values, 0.0)), 1.0), (np.sqrt(np.maximum(-values, 0.0)), -1.0)]
        for row, weight in terms:
            if np.any(row):
                rows.append(margin * row)
                weights.append(weight * np.eye(6)[component])
    return _filters(rows, weights, len(margin), np.zeros(6))


def _filters(
    rows: list[FloatArray] | list[ComplexArray],
    weights: list[FloatArray],
    count: int,
    constant: FloatArray,
    certificate: tuple[Truncation, ...] = (),
) -> DriftFilters:
    return DriftFilters(
        transfer=np.array(rows, dtype=np.complex128).reshape(len(rows), count),
        weight=np.ascontiguousarray(np.array(weights, dtype=np.float64).reshape(len(rows), 6).T),
        constant=constant,
        certificate=certificate,
    )


def component_variance(sea: Sea, state: SeaState) -> FloatArray:
    """E|a_n|² of the components of a sea by its spectrum, 2 S df, shape (N,), m²; df by the neighbours' distances."""
    parts = state.spread()
    frequency = sea.angular_frequency / (2.0 * np.pi)
    result = np.empty(len(frequency))
    for value in np.unique(sea.heading):
        chosen = np.flatnonzero(sea.heading == value)
        chosen = chosen[np.argsort(frequency[chosen])]
        width = np.gradient(frequency[chosen]) if len(chosen) > 1 else np.ones(1)
        share = parts.share[np.argmin(np.abs(np.angle(np.exp(1j * (parts.heading - value)))))]
        result[chosen] = 2.0 * share * state.density(frequency[chosen]) * width
    return result


def quadratic_filters(kernel: Kernel, sea: Sea, state: SeaState, tolerance: float = DEFAULT_TOLERANCE) -> DriftFilters:
    """Filters of any quadratic transfer function, eq. (4).

    Parameters
    ----------
    kernel
        From `tlpsim.loads.hydro.drift.quadratic_kernel` or `newman_kernel`.
    sea
        Whose components the filters take.
    state
        Its statistics. They decide what is left out, not what a filter does: without truncation the force is that of
        the double sum for any state.
    tolerance
        Largest standard deviation of what is left out of a component of the force, relative to that of the component;
        zero keeps all terms.

    Raises
    ------
    ScenarioError
        If the tolerance is not from 0 to below 1, or the sea has no waves.
    """
    if not 0.0 <= tolerance < 1.0:
        raise ScenarioError(f"tolerance of the slow drift is {tolerance}; it must be from 0 to below 1")
    waves = Waves(sea.angular_frequency, sea.heading)
    variance = component_variance(sea, state)
    if not np.max(variance, initial=0.0) > 0.0:
        raise ScenarioError("slow drift of a sea without waves; leave it out, or give the sea a height")
    root = np.sqrt(np.maximum(variance, _FLOOR * np.max(variance)))

    def weighted(component: int) -> ComplexArray:
        matrix = root[:, None] * kernel(waves, waves, component) * root
        return np.asarray(0.5 * (matrix + matrix.conj().T))

    # One matrix at a time: that of many directions is large.
    sizes = np.array([np.linalg.norm(weighted(component)) for component in range(6)])
    # A moment at least that of the force at an arm of 1 m.
    least = _NOTHING * np.repeat([np.max(sizes[:3]), np.max(sizes)], 3)
    rows: list[ComplexArray] = []
    weights: list[FloatArray] = []
    records = []
    constant = np.zeros(6)
    for component, name in enumerate(DEGREES_OF_FREEDOM):
        matrix = weighted(component) if sizes[component] > least[component] else None
        values, vectors, record = _decompose(matrix, len(root), tolerance, name)
        rows += list((vectors / root[:, None]).T)
        weights += [value * np.eye(6)[component] for value in values]
        records.append(record)
        constant[component] = record.mean - np.sum(values) if record.terms < record.order else 0.0
    return _filters(rows, weights, len(root), constant, tuple(records))


def _decompose(
    matrix: ComplexArray | None, order: int, tolerance: float, name: str
) -> tuple[FloatArray, ComplexArray, Truncation]:
    """Largest terms (R,), (N, R) of a Hermitian matrix, so many that what is left is within the tolerance."""
    if matrix is None:
        return np.zeros(0), np.zeros((order, 0), dtype=np.complex128), _record(name, np.zeros(0), order, 0.0, 0.0)
    mean, energy = float(np.trace(matrix).real), float(np.sum(np.abs(matrix) ** 2))
    count = order if order <= _LARGEST_DENSE or tolerance == 0.0 else _FIRST_TERMS
    while True:
        values, vectors = _largest(matrix, count)
        left = energy - np.cumsum(values**2)
        if count == order or left[-1] <= tolerance**2 * energy:
            break
        count = order if 4 * count > order else 2 * count
    terms = order if tolerance == 0.0 else min(int(np.sum(left > tolerance**2 * energy)) + 1, order)
    return values[:terms], vectors[:, :terms], _record(name, values[:terms], order, mean, energy)


def _record(name: str, kept: FloatArray, order: int, mean: float, energy: float) -> Truncation:
    kept_energy = float(np.sum(kept**2))
    share = kept_energy / energy if energy > 0.0 else 1.0
    return Truncation(
        component=name,
        terms=len(kept),
        order=order,
        mean=mean,
        spread=float(np.sqrt(energy)),
        skewness=float(2.0 * np.sum(kept**3) / kept_energy**1.5) if len(kept) else 0.0,
        mean_share=float(np.sum(kept)) / mean if mean != 0.0 else 1.0,
        spread_share=float(np.sqrt(share)),
        error=float(np.sqrt(max(1.0 - share, 0.0))) if len(kept) < order else 0.0,
    )


def _largest(matrix: ComplexArray, count: int) -> tuple[FloatArray, ComplexArray]:
    """Eigenvalues of largest modulus in descending order of it, and their vectors."""
    if count == len(matrix):
        values, vectors = np.linalg.eigh(matrix)
    else:
        values, vectors = eigsh(matrix, k=count, which="LM", v0=np.ones(len(matrix), dtype=np.complex128))
    order = np.argsort(-np.abs(values), kind="stable")
    return values[order], vectors[:, order]
