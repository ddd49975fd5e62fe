"""Autoregressive models of stationary vector processes, fitted to a spectrum and sampled as a stream.

    R_k = E[y_n y_{n-k}^T] = int_0^{fN} Re{S(f) exp(i 2 pi f k dt)} df,   fN = 1 / (2 dt)            (1)
    y_n = sum_{k=1..P} Phi_k y_{n-k} + B w_n,   w_n ~ N(0, I)                                        (2)
    S(f) = 2 dt H(f) B B^T H(f)^H,   H(f) = (I - sum_k Phi_k exp(-i 2 pi f k dt))^-1                 (3)

The spectrum is cut at the Nyquist frequency fN rather than folded about it: the model is right in its band,
and the variance above is missing. The fit is the block Levinson recursion of Whittle (Biometrika 50, 1963),
stable by construction when the block Toeplitz matrix of R is positive definite. A sample stream starts in the
stationary state exactly, and its noise comes from a counter-based generator, so that the sample of any index
is a function of the seed and the index alone. This is the first stage of the two-stage matching of Li and
Kareem (1990); its AR(25) is used as it stands.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, SolverError

FloatArray = NDArray[np.float64]
Array = NDArray[np.float64] | NDArray[np.complex128]

_NOISE_BLOCK = 256
_START_BLOCK = 0  # the block of noise that the stationary start uses up; samples follow from block 1


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoregressiveModel:
    """Coefficients of eq. (2).

    Parameters
    ----------
    coefficients
        Phi_1 ... Phi_P, shape (P, m, m).
    innovation_factor
        B, lower triangular, shape (m, m).
    """

    coefficients: FloatArray
    innovation_factor: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessState:
    """Snapshot of a sample stream: index of the newest sample and the retained ones, oldest first (L, m)."""

    index: int
    samples: FloatArray


def random_generator(seed: int, stream: int, block: int = 0) -> np.random.Generator:
    """Counter-based generator (Philox) whose numbers depend on its three arguments alone.

    Parameters
    ----------
    seed, stream
        The key: the user's seed, and a number that keeps independent processes of one run apart.
    block
        Upper word of the counter; blocks never overlap.

    Raises
    ------
    ScenarioError
        If seed, stream or block is negative or takes more than 64 bits.
    """
    for name, value in (("seed", seed), ("stream", stream), ("block", block)):
        if not 0 <= value < 2**64:
            raise ScenarioError(f"random {name} is {value}; it must be a whole number from 0 to 2^64 - 1")
    key = np.array([seed, stream], dtype=np.uint64)
    counter = np.array([0, 0, block, 0], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))


def noise_block(seed: int, stream: int, block: int, rows: int, columns: int) -> FloatArray:
    """Independent standard normal numbers, shape (rows, columns), a function of the arguments alone."""
    return random_generator(seed, stream, block).standard_normal((rows, columns))


def correlation_from_spectrum(
    spectrum: Callable[[FloatArray], Array], step: float, lags: int, intervals: int = 2**16
) -> FloatArray:
    """Correlation matrices of the process sampled at `step`, eq. (1), by trapezoids.

    Parameters
    ----------
    spectrum
        Function of frequency (nf,) in Hz that returns one-sided cross-spectra, shape (nf, m, m), unit²/Hz;
        Hermitian, finite at zero frequency.
    step
        Sampling step in s.
    lags
        Largest lag P.
    intervals
        Number of frequency intervals between zero and the Nyquist frequency.

    Returns
    -------
    R_0 ... R_P, shape (P + 1, m, m), unit².

    Raises
    ------
    ScenarioError
        If the step or the number of lags is not positive, or the spectrum is not finite.
    """
    if not (np.isfinite(step) and step > 0.0):
        raise ScenarioError(f"sampling step of a random process is {step} s; it must be finite and > 0")
    if not 0 < lags < intervals:
        raise ScenarioError(f"order of an autoregressive model is {lags}; it must be from 1 to {intervals - 1}")
    density = spectrum(np.linspace(0.0, 0.5 / step, intervals + 1))
    if not np.all(np.isfinite(density)):
        raise ScenarioError("spectrum of a random process is not finite between zero and the Nyquist frequency")
    # irfft is 2 / n times the trapezoidal sum; with n = 2 intervals and df = fN / intervals the integral is
    # fN times the transform.
    transform: FloatArray = np.fft.irfft(density, axis=0)[: lags + 1]
    return transform * (0.5 / step)


def _predictors(correlation: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Whittle's recursion: (coefficients (n, m, m), innovation covariance (m, m)) for orders n = 0 ... P."""
    order, size = len(correlation) - 1, correlation.shape[1]
    forward = np.zeros((order, size, size))
    backward = np.zeros((order, size, size))
    forward_covariance = correlation[0].copy()
    backward_covariance = correlation[0].copy()
    yield forward[:0], forward_covariance.copy()
    for n in range(1, order + 1):
        difference = correlation[n].copy()
        for k in range(1, n):
            difference -= forward[k - 1] @ correlation[n - k]
        forward_gain = np.linalg.solve(backward_covariance.T, difference.T).T
        backward_gain = np.linalg.solve(forward_covariance.T, difference).T
        previous_forward = forward[: n - 1].copy()
        previous_backward = backward[: n - 1].copy()
        forward[: n - 1] -= forward_gain @ previous_backward[::-1]
        backward[: n - 1] -= backward_gain @ previous_forward[::-1]
        forward[n - 1], backward[n - 1] = forward_gain, backward_gain
        forward_covariance -= forward_gain @ difference.T
        backward_covariance -= backward_gain @ difference
        yield forward[:n].copy(), 0.5 * (forward_covariance + forward_covariance.T)


def _factor(covariance: FloatArray, order: int) -> FloatArray:
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    except np.linalg.LinAlgError:
        smallest = float(np.linalg.eigvalsh(covariance)[0])
        raise SolverError(
            f"autoregressive fit: innovation covariance of order {order} has the eigenvalue {smallest:.3g}, which "
            "must be > 0; lower the order, lengthen the sampling step or move coincident points apart"
        ) from None


def autoregressive_fit(correlation: FloatArray) -> AutoregressiveModel:
    """Model of order P whose first P + 1 correlation matrices are the given ones (block Yule-Walker).

    Parameters
    ----------
    correlation
        R_0 ... R_P, shape (P + 1, m, m).

    Raises
    ------
    SolverError
        If the block Toeplitz matrix of the correlations is not positive definite.
    """
    correlation = np.asarray(correlation, dtype=np.float64)
    _factor(correlation[0], 0)
    *_, (coefficients, covariance) = _predictors(correlation)
    factor = _factor(covariance, len(coefficients))
    coefficients.flags.writeable = False
    factor.flags.writeable = False
    return AutoregressiveModel(coefficients=coefficients, innovation_factor=factor)


def stationary_start(correlation: FloatArray, noise: FloatArray) -> FloatArray:
    """First P samples of the stationary process, drawn one after the other from the predictors of rising order.

    Equal to multiplying the noise by the Cholesky factor of the block Toeplitz covariance of the P samples.

    Parameters
    ----------
    correlation
        R_0 ... R_P, shape (P + 1, m, m).
    noise
        Standard normal numbers, shape (P, m).

    Returns
    -------
    Samples, oldest first, shape (P, m).

    Raises
    ------
    SolverError
        If the covariance is not positive definite.
    """
    samples = np.zeros_like(noise)
    for n, (coefficients, covariance) in enumerate(_predictors(correlation[:-1])):
        prediction = np.einsum("kij,kj->i", coefficients, samples[:n][::-1])
        samples[n] = prediction + _factor(covariance, n) @ noise[n]
    return samples


def autoregressive_spectrum(model: AutoregressiveModel, frequency: FloatArray, step: float) -> NDArray[np.complex128]:
    """One-sided cross-spectra of the model, eq. (3), shape (nf, m, m), unit²/Hz; `frequency` (nf,) in Hz."""
    order, size, _ = model.coefficients.shape
    lags = np.arange(1, order + 1)
    delays = np.exp(-2j * np.pi * step * np.outer(frequency, lags))
    denominator = np.eye(size) - np.einsum("fk,kij->fij", delays, model.coefficients)
    response = np.linalg.solve(denominator, model.innovation_factor.astype(np.complex128))
    return np.asarray(2.0 * step * response @ np.conj(np.swapaxes(response, 1, 2)), dtype=np.complex128)


class AutoregressiveProcess:
    """A stream of samples y_0, y_1 ... of eq. (2), each a pure function of (seed, stream, index).

    Parameters
    ----------
    correlation
        R_0 ... R_P, shape (P + 1, m, m).
    seed, stream
        Key of the noise, see `random_generator`.
    retained
        Number of newest samples kept for `window` beside the P that the recursion itself needs.

    Raises
    ------
    SolverError
        If the model cannot be fitted.
    """

    def __init__(self, correlation: FloatArray, seed: int, stream: int, retained: int) -> None:
        self.model = autoregressive_fit(correlation)
        order, size, _ = self.model.coefficients.shape
        self._seed, self._stream = seed, stream
        self._start = stationary_start(correlation, noise_block(seed, stream, _START_BLOCK, order, size))
        # The buffer holds the newest samples one after the other, newest last; the row of coefficient blocks
        # is turned round to match, so that a prediction is one matrix-vector product.
        self._row = np.ascontiguousarray(np.hstack(list(self.model.coefficients[::-1])))
        self._length = max(order, retained)
        self._size = size
        self._buffer = np.zeros(self._length * size)
        self._recursion_start = (self._length - order) * size
        self._noise_index = -1
        self._innovations = np.zeros((0, size))
        self._restart()

    def _restart(self) -> None:
        self._buffer[:] = 0.0
        self._buffer[self._recursion_start :] = self._start.ravel()
        self._newest = len(self._start) - 1

    def _advance(self) -> None:
        index = self._newest + 1
        block, row = divmod(index, _NOISE_BLOCK)
        if block != self._noise_index:
            noise = noise_block(self._seed, self._stream, block + 1, _NOISE_BLOCK, self._size)
            self._innovations = np.einsum("ij,nj->ni", self.model.innovation_factor, noise)
            self._noise_index = block
        value = self._row @ self._buffer[self._recursion_start :]
        value += self._innovations[row]
        self._buffer[: -self._size] = self._buffer[self._size :]
        self._buffer[-self._size :] = value
        self._newest = index

    def window(self, first: int, count: int) -> FloatArray:
        """Samples first ... first + count - 1, shape (count, m); valid until the next call, do not keep it.

        Going back further than the retained samples replays the stream from its start, with the same values.
        """
        if first < 0 or not 0 < count <= self._length:
            raise ValueError(f"samples {first} to {first + count - 1} cannot be had from a window of {self._length}")
        if first <= self._newest - self._length:
            self._restart()
        while self._newest < first + count - 1:
            self._advance()
        row = self._length - 1 - (self._newest - first)
        return self._buffer.reshape(self._length, self._size)[row : row + count]

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""
        samples = self._buffer.reshape(self._length, self._size).copy()
        samples.flags.writeable = False
        return ProcessState(index=self._newest, samples=samples)

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of this stream (same model and seed), in this or another process.

        Raises
        ------
        ScenarioError
            If the snapshot is of another shape.
        """
        shape = (self._length, self._size)
        if state.samples.shape != shape:
            raise ScenarioError(f"state of a random process has shape {state.samples.shape}; it must be {shape}")
        self._buffer[:] = state.samples.ravel()
        self._newest = state.index
