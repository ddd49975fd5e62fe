"""Two-stage matching of a vector ARMA model to the covariances of a process (Li and Kareem 1990).

    R_k = E[y_n y_{n-k}^T] = int_0^{fN} Re{S(f) exp(i 2 pi f k dt)} df,   fN = 1 / (2 dt)            (1)

Stage 1, a long autoregression by the block Levinson recursion of Whittle (Biometrika 50, 1963):

    y_n = sum_{k=1..P} Phi_k y_{n-k} + B w_n,   R_j = sum_k Phi_k R_{j-k},  j = 1 ... P              (2)
    H_j = E[y_n w_{n-j}^T],   H_0 = B,   H_j = sum_{k=1..min(j,P)} Phi_k H_{j-k}                     (3)

Stage 2, the ARMA model with the same auto- and cross-correlations of output and input (Gersch and Yonemoto 1977;
Samaras, Shinozuka and Tsurui 1985), one linear system for all its coefficients:

    R_j = sum_{k=1..p} A_k R_{j-k} + sum_{l=j..q} B_l H_{l-j}^T,   j = 1 ... p                       (4)
    H_j = sum_{k=1..min(j,p)} A_k H_{j-k} + B_j,                   j = 0 ... q                       (5)

Eq. (4) may also be asked for more lags than unknowns, up to P, by least squares. The model keeps H_0 ... H_q, and the
variance to a per cent; a linear map of the output then makes R_0 exact:

    A_k <- L A_k L^-1,   B_l <- L B_l,   L = (R_0 V^-1)^(1/2),   V the covariance of the model        (6)

Of the maps with L V L^T = R_0 this one, the principal root, is near the identity, and does not depend on the axes in
which the components are counted: like the two stages, it commutes with any linear map of the process.

The spectrum is cut at the Nyquist frequency fN rather than folded about it: the model is right in its band, and the
variance above is missing.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.model import ArmaModel, covariance, impulse_response, transformed

FloatArray = NDArray[np.float64]
Array = NDArray[np.float64] | NDArray[np.complex128]

_INTERVALS = 2**14


def correlation_from_spectrum(
    spectrum: Callable[[FloatArray], Array], step: float, lags: int, intervals: int = _INTERVALS
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


def predictors(correlation: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Whittle's recursion: (Phi (n, m, m), innovation covariance (m, m)) for the orders n = 0 ... P."""
    order, size = len(correlation) - 1, correlation.shape[1]
    forward = np.zeros((order, size, size))
    backward = np.zeros((order, size, size))
    forward_covariance = correlation[0].copy()
    backward_covariance = correlation[0].copy()
    yield forward[:0], forward_covariance.copy()
    for n in range(1, order + 1):
        # sum_k Phi_k R_{n-k} as one product of a row of blocks and a column of blocks
        row = forward[: n - 1].transpose(1, 0, 2).reshape(size, -1)
        difference = correlation[n] - row @ correlation[n - 1 : 0 : -1].reshape(-1, size)
        forward_gain = np.linalg.solve(backward_covariance.T, difference.T).T
        backward_gain = np.linalg.solve(forward_covariance.T, difference).T
        previous_forward = forward[: n - 1].copy()
        forward[: n - 1] -= forward_gain @ backward[: n - 1][::-1]
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
            "must be > 0; lower the order, lengthen the sampling step or raise the white floor"
        ) from None


def autoregressive_fit(correlation: FloatArray, step: float) -> ArmaModel:
    """Autoregressive model of order P whose first P + 1 correlation matrices are the given ones, eq. (2).

    Parameters
    ----------
    correlation
        R_0 ... R_P, shape (P + 1, m, m).
    step
        Sampling step, s.

    Raises
    ------
    SolverError
        If the block Toeplitz matrix of the correlations is not positive definite.
    """
    correlation = np.asarray(correlation, dtype=np.float64)
    _factor(correlation[0], 0)
    try:
        *_, (coefficients, innovation) = predictors(correlation)
    except np.linalg.LinAlgError as error:
        raise SolverError(f"autoregressive fit: the recursion broke down ({error}); raise the white floor") from None
    order = len(coefficients)
    return ArmaModel(autoregressive=coefficients, moving_average=_factor(innovation, order)[None], step=step)


def matched_arma(
    long: ArmaModel, correlation: FloatArray, autoregressive_order: int, moving_average_order: int, lags: int
) -> ArmaModel:
    """ARMA(p, q) model of eq. (4) and (5).

    Parameters
    ----------
    long
        The autoregressive model of stage 1, of order P >= p.
    correlation
        R_0 ... R_P that it was made from, shape (P + 1, m, m).
    autoregressive_order, moving_average_order
        p >= 1 and q >= 0; need not be equal.
    lags
        Eq. (4) is asked for j = 1 ... lags, from p to P. With p the equations are as many as the unknowns; with more
        they are met by least squares, which makes the slow part of the process better and the model less sure to
        be stable.

    Raises
    ------
    SolverError
        If the linear system is singular.
    """
    p, q, size = autoregressive_order, moving_average_order, long.size
    response = impulse_response(long, q + 1)
    # Unknowns: the row [A_1 ... A_p B_0 ... B_q] of blocks; each equation is a column of blocks.
    system = np.zeros((p + q + 1, size, lags + q + 1, size))
    for j in range(1, lags + 1):
        for k in range(1, p + 1):
            system[k - 1, :, j - 1, :] = correlation[j - k] if j >= k else correlation[k - j].T
        for lag in range(j, q + 1):
            system[p + lag, :, j - 1, :] = response[lag - j].T
    for j in range(q + 1):
        for k in range(1, min(j, p) + 1):
            system[k - 1, :, lags + j, :] = response[j - k]
        system[p + j, :, lags + j, :] = np.eye(size)
    right = np.concatenate([correlation[1 : lags + 1], response]).transpose(1, 0, 2).reshape(size, -1)
    equations = system.reshape((p + q + 1) * size, (lags + q + 1) * size).T
    try:
        row = (np.linalg.solve(equations, right.T) if lags == p else np.linalg.lstsq(equations, right.T)[0]).T
    except np.linalg.LinAlgError:
        raise SolverError(f"ARMA({p}, {q}) matching: the system of {len(equations)} equations is singular") from None
    blocks = row.reshape(size, p + q + 1, size).transpose(1, 0, 2)
    return ArmaModel(autoregressive=blocks[:p], moving_average=blocks[p:], step=long.step)


def with_variance(model: ArmaModel, target: FloatArray) -> ArmaModel:
    """The model of a linear map of the process that has the covariance `target` (m, m), eq. (6).

    Raises
    ------
    SolverError
        If the model is not stable, or one of the two covariances is not positive definite.
    """
    present = covariance(model, 0)[0]
    try:
        ratio, directions = eigh(target, present)
    except np.linalg.LinAlgError:
        raise SolverError("ARMA model: its covariance is singular, so that its variance cannot be restored") from None
    if not ratio[0] > 0.0:
        raise SolverError("ARMA model: the covariance asked for is singular, so that it cannot be restored")
    # R_0 U = V U diag(ratio), U^T V U = I.
    inverse = directions.T @ present
    left = (inverse.T * np.sqrt(ratio)) @ directions.T
    return transformed(model, left, (inverse.T / np.sqrt(ratio)) @ directions.T)
