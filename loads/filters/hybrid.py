"""Hybrid of convolution, interpolation and differentiation: a process and its derivative from one kernel.

    x_n --kernel, step H--> u_n --interpolation--> u(t_n + j H/L) --central difference, step h = H/L--> du/dt   (1)

    A_j(f) = (1/h) sum_k c_k R_{j+k}(f),   R_j(f) = sum_l w_l(j/L) exp(i 2 pi f l H)                  (2)

Water velocity comes from the elevation by discrete convolution at the sampling step of the elevation, and the
acceleration is the difference of the interpolated velocity: half the kernels, and an acceleration that is the
derivative of the velocity which goes with it. Differentiation amplifies an image at frequency F by 2 pi F, so the
error rests on the images of the filter. Li and Kareem (1990) call this the hybrid model.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.differentiation import central_difference, differentiate
from tlpsim.loads.filters.interpolation import InterpolationFilter, interpolate

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def interpolate_and_differentiate(
    interpolation_filter: InterpolationFilter, samples: ArrayLike, step: float, ratio: int, order: int = 6
) -> tuple[FloatArray, FloatArray]:
    """A sampled signal and its time derivative at the step H/L, eq. (1), wherever the samples reach.

    Parameters
    ----------
    samples
        Shape (count, ...), time along the first axis, such as velocities from `convolution.convolve`.
    step
        H in s.
    ratio
        L, number of values a sample step.
    order
        Order of the central difference: 2, 4 or 6.

    Returns
    -------
    Signal and derivative, each of shape ((count - before - after + 1) L - order, ...); row 0 belongs to the time
    (before - 1) H + order / 2 H/L after sample 0.

    Raises
    ------
    ScenarioError
        If there are too few samples, or an argument is out of its range.
    """
    fine = interpolate(interpolation_filter, samples, ratio)
    derivative = differentiate(fine, step / ratio, order)
    return fine[order // 2 : len(fine) - order // 2], derivative


def derivative_response(
    interpolation_filter: InterpolationFilter, frequency: ArrayLike, step: float, ratio: int, order: int = 6
) -> ComplexArray:
    """Derivative at t_n + j H/L for the samples exp(i 2 pi f n H), eq. (2), as seen from t_n.

    Parameters
    ----------
    frequency
        Shape (nf,), Hz.

    Returns
    -------
    Shape (L, nf), 1/s; i 2 pi f exp(i 2 pi f j H/L) for an ideal filter.

    Raises
    ------
    ScenarioError
        If the order, the ratio or the step is out of its range.
    """
    weights = central_difference(order)
    require_positive("step of a hybrid filter", step, "s")
    if ratio < 1:
        raise ScenarioError(f"hybrid filter: ratio is {ratio}; it must be >= 1")
    # One period of the phases with the reach of the difference to either side, as offsets from t_0.
    segments, phases = np.divmod(np.arange(-(order // 2), ratio + order // 2), ratio)
    taps = np.arange(1 - interpolation_filter.before, interpolation_filter.after + 1)
    kernels = np.array([interpolation_filter.weights(phase / ratio) for phase in phases])
    times = segments[:, np.newaxis] + taps
    samples = np.exp(2j * np.pi * step * np.multiply.outer(times, np.asarray(frequency, dtype=np.float64)))
    values = np.einsum("jk,jkf->jf", kernels, samples)
    windows = np.lib.stride_tricks.sliding_window_view(values, order + 1, axis=0)
    return np.asarray(windows @ weights * (ratio / step))


def derivative_error(
    interpolation_filter: InterpolationFilter, frequency: ArrayLike, step: float, ratio: int, order: int = 6
) -> FloatArray:
    """Root mean square error of the derivative of an interpolated harmonic over that of the true derivative.

    Parameters
    ----------
    frequency
        In Hz, > 0, any shape.

    Returns
    -------
    Relative error, shape of `frequency`, images included.

    Raises
    ------
    ScenarioError
        If a frequency is not positive, or another argument is out of its range.
    """
    frequencies = require_positive("frequency of a derivative", frequency, "Hz")
    omega = 2.0 * np.pi * frequencies.ravel()
    found = derivative_response(interpolation_filter, frequencies.ravel(), step, ratio, order)
    exact = 1j * omega * np.exp(1j * step / ratio * np.outer(np.arange(ratio), omega))
    result: FloatArray = np.sqrt(np.mean(np.abs(found - exact) ** 2, axis=0)) / omega
    return result.reshape(frequencies.shape)
