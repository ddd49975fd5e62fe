"""Stochastic decomposition of cross-spectra (Li and Kareem 1990, 1991).

A vector x of n real Gaussian processes with one-sided cross-spectra S_xx is written by r sources, which are mutually
non-coherent, while all that stems from one source is fully coherent:

    S_xx(f) = D_x(f) D_x(f)^H,   D_x of shape (n, r)                                                 (1)

The decomposed function D_x takes the place of S_xx: a linear system, the cross-spectrum of any two quantities of the
same sources, and their covariance are

    D_y = H D_x                                                                                      (2)
    S_xy = D_x D_y^H = E[x y*]                                                                       (3)
    Cov(x, y) = ∫ Re(D_x D_y^H) df                                                                   (4)

Waves of one direction have r = 1, D = H √S_η. Any unitary turn of the columns, another at each frequency, is a
decomposition of the same processes and leaves every such result as it is, so that the phase and the order of the
columns do not matter to them.

How D is found from S:

    cholesky   lower triangular, smooth in f where S is;
    eigen      V √Λ, the fewest columns for a given share of the energy ∫ tr S df (proper orthogonal decomposition);
    pivoted    Cholesky with the greatest remaining row next: as many columns as the greatest rank, not smooth in f.

The first and the last work on rows divided by their own power, S_ij / (s_i s_j) with

    s_i(f)² = S_ii(f) + 10⁻¹² max_f S_ii,                                                            (5)

so that the units of the rows do not matter, and rounding where a spectrum vanishes is not taken for power.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import entry
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_VOID = 1e-12  # of the peak of a row's spectrum, eq. (5)
_RANK = 1e-12  # remaining share of a row's power that counts as rounding
_LIMIT = 1e-8  # departure from Hermitian or positive semidefinite, relative, that input may have


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DecomposedSpectrum:
    """Processes by their decomposed spectral function, eq. (1).

    Attributes
    ----------
    frequency
        Hz, increasing, not negative, shape (nf,).
    function
        D, shape (nf, n, r), unit/√Hz: n processes, r sources.

    Raises
    ------
    ScenarioError
        If the shapes do not fit or the frequencies do not increase.
    """

    frequency: FloatArray
    function: ComplexArray

    def __post_init__(self) -> None:
        _require_grid(self.frequency)
        if self.function.ndim != 3 or len(self.function) != len(self.frequency):
            raise ScenarioError(
                f"decomposed spectrum has the shape {self.function.shape}; it must be "
                f"({len(self.frequency)}, processes, sources), one matrix a frequency"
            )

    def through(self, transfer: ComplexArray) -> DecomposedSpectrum:
        """Outputs of a linear system with the transfer functions (nf, m, n), eq. (2).

        Raises
        ------
        ScenarioError
            If the transfer functions are of other frequencies or inputs.
        """
        expected = self.function.shape[:2]
        if transfer.ndim != 3 or (len(transfer), transfer.shape[2]) != expected:
            raise ScenarioError(
                f"transfer function has the shape {transfer.shape}; it must be ({expected[0]}, outputs, {expected[1]}) "
                "to follow this decomposed spectrum"
            )
        return DecomposedSpectrum(frequency=self.frequency, function=transfer @ self.function)

    def rows(self, index: slice | Sequence[int] | NDArray[np.int_]) -> DecomposedSpectrum:
        """Some of the processes, of the same sources."""
        return DecomposedSpectrum(frequency=self.frequency, function=self.function[:, index, :])


def _require_grid(frequency: FloatArray) -> None:
    if not (
        frequency.ndim == 1
        and len(frequency)
        and np.all(np.isfinite(frequency))
        and frequency[0] >= 0.0
        and np.all(np.diff(frequency) > 0.0)
    ):
        raise ScenarioError(
            f"frequencies of a decomposed spectrum are {np.array2string(frequency, threshold=6)} Hz; they must be "
            "finite, not negative and increasing"
        )


def _require_same(a: DecomposedSpectrum, b: DecomposedSpectrum, axis: int, what: str) -> None:
    if not np.array_equal(a.frequency, b.frequency) or a.function.shape[axis] != b.function.shape[axis]:
        raise ScenarioError(
            f"decomposed spectra of the shapes {a.function.shape} and {b.function.shape} do not fit together; "
            f"they need the same frequencies and {what}"
        )


def cross_spectrum(x: DecomposedSpectrum, y: DecomposedSpectrum | None = None) -> ComplexArray:
    """One-sided cross-spectra S_xy = E[x y*] of processes of the same sources, eq. (3).

    Returns
    -------
    Shape (nf, n, m), unit²/Hz; of x with itself where no y is given.

    Raises
    ------
    ScenarioError
        If frequencies or sources differ.
    """
    y = x if y is None else y
    _require_same(x, y, 2, "sources")
    return np.asarray(x.function @ y.function.conj().swapaxes(1, 2))


def trapezoidal_weights(frequency: FloatArray) -> FloatArray:
    """Weights (nf,) in Hz of the trapezoidal rule on frequencies (nf,) that need not be even."""
    weights = np.zeros(len(frequency))
    weights[:-1] += 0.5 * np.diff(frequency)
    weights[1:] += 0.5 * np.diff(frequency)
    return weights


def covariance(x: DecomposedSpectrum, y: DecomposedSpectrum | None = None) -> FloatArray:
    """Covariance E[x y^T] of processes of the same sources, eq. (4) by the trapezoidal rule.

    Returns
    -------
    Shape (n, m), unit²; of x with itself where no y is given.

    Raises
    ------
    ScenarioError
        If frequencies or sources differ.
    """
    y = x if y is None else y
    _require_same(x, y, 2, "sources")
    # Real and imaginary parts of all frequencies and sources are one long row of each process.
    weighted = x.function * trapezoidal_weights(x.frequency)[:, None, None]
    left, right = (
        np.ascontiguousarray(each.swapaxes(0, 1)).reshape(each.shape[1], -1).view(np.float64)
        for each in (weighted, y.function)
    )
    return np.asarray(left @ right.T)


def beside(a: DecomposedSpectrum, b: DecomposedSpectrum) -> DecomposedSpectrum:
    """Sum of two independent vectors of as many processes: the sources of both, columns side by side.

    Raises
    ------
    ScenarioError
        If frequencies or numbers of processes differ.
    """
    _require_same(a, b, 1, "processes")
    return DecomposedSpectrum(frequency=a.frequency, function=np.concatenate([a.function, b.function], axis=2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Problem:
    """Checked cross-spectra, and the same with rows divided by the scales s (nf, n) of eq. (5)."""

    frequency: FloatArray
    spectrum: ComplexArray
    scale: FloatArray
    normal: ComplexArray

    def lowest(self) -> FloatArray:
        """Lowest eigenvalue of the normalized spectra (nf,); ScenarioError if one is clearly negative."""
        lowest = np.asarray(np.linalg.eigvalsh(self.normal)[:, 0], dtype=np.float64)
        if lowest.min() < -_LIMIT:
            self.refuse(int(np.argmin(lowest)))
        return lowest

    def refuse(self, k: int) -> None:
        values = np.linalg.eigvalsh(self.spectrum[k])
        raise ScenarioError(
            f"cross-spectrum at {self.frequency[k]:.6g} Hz is not positive semidefinite: its lowest eigenvalue is "
            f"{values[0]:.3g} and its highest {values[-1]:.3g} unit²/Hz, and all must be ≥ 0; check the coherences"
        )


def _problem(frequency: FloatArray, spectrum: ComplexArray) -> _Problem:
    _require_grid(frequency)
    size = spectrum.shape[-1] if spectrum.ndim else 0
    if spectrum.shape != (len(frequency), size, size) or not size:
        raise ScenarioError(
            f"cross-spectrum has the shape {spectrum.shape}; it must be ({len(frequency)}, n, n), one square matrix "
            "a frequency"
        )
    finite = np.isfinite(spectrum).all(axis=(1, 2))
    if not finite.all():
        raise ScenarioError(f"cross-spectrum at {frequency[np.argmin(finite)]:.6g} Hz is not finite; check its input")
    power = np.maximum(np.einsum("fii->fi", spectrum).real, 0.0)
    scale = np.sqrt(power + _VOID * power.max(axis=0))
    bound = scale[:, :, None] * scale[:, None, :]

    skew = np.abs(spectrum - spectrum.conj().swapaxes(1, 2))
    wrong = (skew > _LIMIT * np.maximum(bound, np.abs(spectrum))).any(axis=(1, 2))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ScenarioError(
            f"cross-spectrum at {frequency[k]:.6g} Hz is not Hermitian: S_ij and S_ji* differ by up to "
            f"{skew[k].max():.3g} unit²/Hz; give S_ji = S_ij*"
        )
    spectrum = 0.5 * (spectrum + spectrum.conj().swapaxes(1, 2))
    inverse = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
    normal = spectrum * (inverse[:, :, None] * inverse[:, None, :])
    problem = _Problem(frequency=frequency, spectrum=spectrum, scale=scale, normal=normal)
    # A row without power must have no cross-spectra; its normalized ones, 0, would not show them.
    incoherent = (np.abs(spectrum) > (1.0 + _LIMIT) * bound).any(axis=(1, 2))
    if incoherent.any():
        problem.refuse(int(np.argmax(incoherent)))
    return problem


def _cholesky(problem: _Problem, energy: float) -> ComplexArray:
    size = problem.normal.shape[1]
    try:
        function = np.linalg.cholesky(problem.normal)
    except np.linalg.LinAlgError:
        # Semidefinite up to rounding: a diagonal just above what rounding makes negative.
        shift = 2.0 * np.maximum(-problem.lowest(), 0.0) + 16.0 * size**2 * np.finfo(float).eps
        function = np.linalg.cholesky(problem.normal + shift[:, None, None] * np.eye(size))
    return np.asarray(function * problem.scale[:, :, None])


def _eigen(problem: _Problem, energy: float) -> ComplexArray:
    problem.lowest()
    values, vectors = np.linalg.eigh(problem.spectrum)
    values, vectors = np.maximum(values[:, ::-1], 0.0), vectors[:, :, ::-1]
    weights = trapezoidal_weights(problem.frequency) if len(values) > 1 else np.ones(1)
    kept = np.cumsum(weights @ values)
    rounding = len(kept) * np.finfo(float).eps
    count = int(np.searchsorted(kept, (energy - rounding) * kept[-1])) + 1
    return np.asarray(vectors[:, :, :count] * np.sqrt(values[:, None, :count]))


def _pivoted(problem: _Problem, energy: float) -> ComplexArray:
    left = problem.normal.copy()
    every = np.arange(len(left))
    columns = []
    for _ in range(left.shape[1]):
        remaining = np.einsum("fii->fi", left).real
        pivot = np.argmax(remaining, axis=1)
        power = remaining[every, pivot]
        if power.max() <= _RANK:
            break
        root = np.sqrt(np.where(power > _RANK, power, np.inf))  # a frequency that is done gets a column of zeros
        column = left[every, :, pivot] / root[:, None]
        left -= column[:, :, None] * column[:, None, :].conj()
        columns.append(column)
    if np.abs(left).max() > _LIMIT:
        problem.lowest()
    if not columns:  # no power at all: one source without effect
        columns.append(np.zeros(left.shape[:2], dtype=np.complex128))
    return np.asarray(np.stack(columns, axis=2) * problem.scale[:, :, None])


METHODS = {"cholesky": _cholesky, "eigen": _eigen, "pivoted": _pivoted}


def decompose(
    frequency: FloatArray, spectrum: ComplexArray, method: str = "cholesky", energy: float = 1.0
) -> DecomposedSpectrum:
    """Decomposed spectrum of processes with given cross-spectra, eq. (1).

    Input may be singular: rows without power at some frequencies, full coherence at others. Eq. (1) then holds to
    some 1e-12 of the rows' power, S_ii S_jj, at each frequency.

    Parameters
    ----------
    frequency
        Hz, increasing, shape (nf,).
    spectrum
        One-sided cross-spectra S_ij = E[x_i x_j*], shape (nf, n, n), unit²/Hz.
    method
        "cholesky", "eigen" or "pivoted"; see the module.
    energy
        Share of ∫ tr S df to keep, in (0, 1], by "eigen" alone; the rows should then be of one unit. At 1 columns of
        rounding are left out.

    Raises
    ------
    ScenarioError
        If the spectra are not Hermitian or not positive semidefinite, by more than 1e-8 of the rows' power, or the
        method or the energy is not one of those above.
    """
    factor = entry(METHODS, method, "decomposition")
    if not 0.0 < energy <= 1.0 or (energy < 1.0 and method != "eigen"):
        raise ScenarioError(
            f"energy to keep in a decomposition by {method!r} is {energy}; it must be in (0, 1], and 1 unless the "
            "method is 'eigen'"
        )
    problem = _problem(frequency, np.asarray(spectrum, dtype=np.complex128))
    return DecomposedSpectrum(frequency=frequency, function=factor(problem, energy))
