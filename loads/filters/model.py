"""The vector ARMA model: its record, and the exact theory of the process that it makes.

    y_n = sum_{k=1..p} A_k y_{n-k} + sum_{l=0..q} B_l w_{n-l},   w_n ~ N(0, I)                       (1)
    S(f) = 2 dt H(f) H(f)^H,   H = (I - sum_k A_k z^k)^-1 sum_l B_l z^l,   z = exp(-i 2 pi f dt)     (2)
    y_n = sum_{j>=0} H_j w_{n-j},   R_k = E[y_{n+k} y_n^T] = sum_{j>=0} H_{j+k} H_j^T                (3)

The model is stable if its largest pole, the spectral radius of the block companion matrix of A_1 ... A_p, is below
one. The sums of eq. (3) run until the impulse response H_j has died away to the precision of the numbers. Unlike the
solution of a Lyapunov equation for a companion form, they stay accurate where poles crowd together, as those of a
sea that is sampled many times a period do.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, SolverError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LARGEST_POLE = 1.0 - 1e-6
_VANISHED = 1e-17  # of the impulse response, relative to its start
_LONGEST = 2**26  # numbers of an impulse response


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmaModel:
    """Coefficients of eq. (1).

    Parameters
    ----------
    autoregressive
        A_1 ... A_p, shape (p, m, m); p may be zero.
    moving_average
        B_0 ... B_q, shape (q + 1, m, m).
    step
        Sampling step, s.

    Raises
    ------
    ScenarioError
        If shapes do not fit, a coefficient is not finite or the step is not positive.
    """

    autoregressive: FloatArray
    moving_average: FloatArray
    step: float

    def __post_init__(self) -> None:
        for name in ("autoregressive", "moving_average"):
            value = np.array(getattr(self, name), dtype=np.float64, order="C")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
            if not np.all(np.isfinite(value)):
                raise ScenarioError(f"ARMA model: a coefficient of the {name.replace('_', ' ')} part is not finite")
        size = self.moving_average.shape[-1]
        block = (size, size)
        shapes = (self.autoregressive.shape, self.moving_average.shape)
        if any(len(shape) != 3 or shape[1:] != block for shape in shapes) or size == 0 or len(self.moving_average) == 0:
            raise ScenarioError(
                f"ARMA model: coefficients of shapes {shapes[0]} and {shapes[1]} must have the shapes (p, m, m) and "
                "(q + 1, m, m)"
            )
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ScenarioError(f"ARMA model: sampling step is {self.step} s; it must be finite and > 0")

    @property
    def size(self) -> int:
        """Number m of components."""
        return int(self.moving_average.shape[1])

    @property
    def orders(self) -> tuple[int, int]:
        """Autoregressive and moving-average order (p, q)."""
        return len(self.autoregressive), len(self.moving_average) - 1


def frequency_response(model: ArmaModel, frequency: FloatArray) -> ComplexArray:
    """Response H(f) of eq. (2) to the noise, shape (nf, m, m); `frequency` (nf,) in Hz."""
    p, q = model.orders
    delay = np.exp(-2j * np.pi * model.step * np.outer(frequency, np.arange(max(p, q) + 1)))
    numerator = np.einsum("fl,lij->fij", delay[:, : q + 1], model.moving_average)
    denominator = np.eye(model.size) - np.einsum("fk,kij->fij", delay[:, 1 : p + 1], model.autoregressive)
    return np.asarray(np.linalg.solve(denominator, numerator), dtype=np.complex128)


def spectrum(model: ArmaModel, frequency: FloatArray) -> ComplexArray:
    """One-sided cross-spectra of the model, eq. (2), shape (nf, m, m), unit²/Hz; `frequency` (nf,) in Hz."""
    response = frequency_response(model, np.asarray(frequency, dtype=np.float64))
    return np.asarray(2.0 * model.step * response @ np.conj(np.swapaxes(response, 1, 2)), dtype=np.complex128)


@njit(cache=True)
def recur(
    autoregressive: FloatArray,
    moving_average: FloatArray,
    samples: FloatArray,
    noises: FloatArray,
    first: int,
    last: int,
    noise_offset: int,
) -> None:
    """Eq. (1) for the rows first ... last - 1 of `samples`; the noise of row n is row n + noise_offset of `noises`.

    The coefficients come transposed, so that the innermost loop runs along memory. The order of the operations of
    a sample does not depend on where a call begins, hence neither do its bits.
    """
    p, q, size = autoregressive.shape[0], moving_average.shape[0] - 1, moving_average.shape[1]
    value = np.empty(size)
    for n in range(first, last):
        value[:] = 0.0
        for lag in range(q + 1):
            for j in range(size):
                noise = noises[n + noise_offset - lag, j]
                for i in range(size):
                    value[i] += moving_average[lag, j, i] * noise
        for lag in range(p):
            for j in range(size):
                sample = samples[n - 1 - lag, j]
                for i in range(size):
                    value[i] += autoregressive[lag, j, i] * sample
        samples[n] = value


def transposed(coefficients: FloatArray) -> FloatArray:
    """Coefficients (n, m, m) as `recur` wants them."""
    return np.ascontiguousarray(np.swapaxes(coefficients, 1, 2))


def impulse_response(model: ArmaModel, count: int) -> FloatArray:
    """H_0 ... H_{count-1} of eq. (3), shape (count, m, m)."""
    p, q = model.orders
    result = np.zeros((count, model.size, model.size))
    coefficients = transposed(model.autoregressive), transposed(model.moving_average)
    for component in range(model.size):
        samples = np.zeros((p + count, model.size))
        noises = np.zeros((q + count, model.size))
        noises[q, component] = 1.0
        recur(*coefficients, samples, noises, p, p + count, q - p)
        result[:, :, component] = samples[p:]
    return result


def largest_pole(model: ArmaModel) -> float:
    """Spectral radius of the block companion matrix: below one if the model is stable."""
    p, _ = model.orders
    if p == 0:
        return 0.0
    companion = np.eye(p * model.size, k=-model.size)
    companion[: model.size] = model.autoregressive.transpose(1, 0, 2).reshape(model.size, -1)
    return float(np.max(np.abs(np.linalg.eigvals(companion))))


def require_stable(model: ArmaModel) -> float:
    """Check that the model has a stationary state, and return its largest pole.

    Raises
    ------
    SolverError
        If its largest pole is not below `LARGEST_POLE`.
    """
    pole = largest_pole(model)
    if not pole < LARGEST_POLE:
        raise SolverError(f"ARMA model: its largest pole is {pole:.9g}, which must be below {LARGEST_POLE:.9g}")
    return pole


def full_impulse_response(model: ArmaModel) -> FloatArray:
    """Impulse response until it has died away, shape (count, m, m).

    Raises
    ------
    SolverError
        If the model is not stable, or remembers for longer than fits into memory.
    """
    p, q = model.orders
    pole = require_stable(model)
    # A crowd of poles first rises as j^(p-1) before it falls as pole^j: twice the time of one pole.
    count = p + q + 1 + (int(2.0 * np.log(_VANISHED) / np.log(pole)) if pole > 0.0 else 0)
    if count * model.size**2 > _LONGEST:
        raise SolverError(
            f"ARMA model: with its largest pole {pole:.9g} it remembers {count} samples of {model.size} components, "
            f"more than {_LONGEST // model.size**2}; lengthen the sampling step"
        )
    return impulse_response(model, count)


def covariance(model: ArmaModel, lags: int) -> FloatArray:
    """Exact covariances R_0 ... R_lags of the process, eq. (3), shape (lags + 1, m, m), unit².

    Raises
    ------
    SolverError
        If the model is not stable.
    """
    size = model.size
    row = full_impulse_response(model).transpose(1, 0, 2).reshape(size, -1)
    row = np.hstack([row, np.zeros((size, lags * size))])
    width = row.shape[1] - lags * size
    return np.array([row[:, lag * size : lag * size + width] @ row[:, :width].T for lag in range(lags + 1)])


def round_off(model: ArmaModel) -> float:
    """Standard deviation of the noise that rounding makes in the samples, over that of the samples; largest component.

    Each sample is rounded by about 2^-53 of the terms that it is summed from, and the recursion amplifies that as its
    poles crowd together: a process sampled far too often for its band drowns in it.

    Raises
    ------
    SolverError
        If the model is not stable.
    """
    variance = np.diagonal(covariance(model, 0)[0])
    terms = np.einsum("kij,j->i", model.autoregressive**2, variance)
    loop = ArmaModel(autoregressive=model.autoregressive, moving_average=np.eye(model.size)[None], step=model.step)
    noise = np.einsum("nij,j->i", full_impulse_response(loop) ** 2, terms)
    return float(np.sqrt(np.max(noise / variance))) * 2.0**-53


def transformed(model: ArmaModel, left: FloatArray, right: FloatArray) -> ArmaModel:
    """Model of the process L y, where `right` R is such that R L is the identity (L may have more rows).

    With more rows than columns the noise gets as many components as the new process has; those beyond the old
    ones have no effect.
    """
    autoregressive = left @ model.autoregressive @ right
    moving_average = left @ model.moving_average
    missing = left.shape[0] - left.shape[1]
    silent = np.zeros((len(moving_average), left.shape[0], missing))
    moving_average = np.concatenate([moving_average, silent], axis=2)
    return ArmaModel(autoregressive=autoregressive, moving_average=moving_average, step=model.step)
