"""Interpolation and extrapolation of sampled signals by short polyphase filters.

Between two samples x_n, x_{n+1}, a step H apart, every filter gives

    y(t_n + s H) = sum_k w_k(s) x_k,        k = n+1-before ... n+after,   0 <= s <= 1        (1)

with weights that are polynomials of the phase s; a finite impulse response, hence always stable. The cubic
and quintic filters are Hermite polynomials whose nodal derivatives are finite differences of the samples.
Two neighbouring segments use the same value at their common node, so the cubic filters are continuously
differentiable and the quintic ones twice so. Causal filters difference backwards and need no sample after
the end of the segment. Symmetric filters difference centrally; they are far more accurate and keep the
phase, and need samples from beyond the segment (look-ahead).

This is the "discrete interpolation model" of Li and Kareem (Applied Ocean Research 15, 1993):
double-subscripted filters h_{k,j} = w_k(j/L) for a rate ratio L.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

# Hermite basis polynomials in ascending powers of the phase. Rows: value, H d/dt and H^2 d2/dt2 at the
# start of the segment, then the same at its end.
_CUBIC_HERMITE = np.array(
    [
        [1.0, 0.0, -3.0, 2.0],
        [0.0, 1.0, -2.0, 1.0],
        [0.0, 0.0, 3.0, -2.0],
        [0.0, 0.0, -1.0, 1.0],
    ]
)
_QUINTIC_HERMITE = np.array(
    [
        [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
        [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
        [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
        [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
        [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
    ]
)

# Finite differences of H dx/dt and H^2 d2x/dt2 at a node; oldest sample first. A backward stencil ends at the
# node, a central one has the node in its middle.
_BACKWARD_FIRST_3 = np.array([1.0, -4.0, 3.0]) / 2.0
_BACKWARD_FIRST_4 = np.array([-2.0, 9.0, -18.0, 11.0]) / 6.0
_BACKWARD_SECOND_4 = np.array([-1.0, 4.0, -5.0, 2.0])
_CENTRAL_FIRST_5 = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
_CENTRAL_FIRST_7 = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
_CENTRAL_SECOND_7 = np.array([2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0]) / 180.0


@dataclass(frozen=True, slots=True, kw_only=True)
class InterpolationFilter:
    """A polyphase interpolation filter, eq. (1).

    Parameters
    ----------
    name
        Key in `CAUSAL` or `SYMMETRIC`.
    before
        Number of samples used at or before the start of the segment.
    after
        Number of samples used after the start: 0 for the hold filter, 1 when the end of the segment is the
        last one used, more for a filter that looks ahead.
    weights
        Function of the phase in [0, 1] that returns the weights, shape (before + after,), oldest sample
        first; their sum is one. The hold filter is right-continuous: the end of a segment is phase 0 of the
        next one.
    """

    name: str
    before: int
    after: int
    weights: Callable[[float], FloatArray]


def _polynomial_weights(coefficients: FloatArray, phase: float) -> FloatArray:
    """Horner evaluation of all weights; `coefficients` has shape (degree + 1, before + after)."""
    result = coefficients[-1].copy()
    for row in coefficients[-2::-1]:
        result *= phase
        result += row
    return result


def _polynomial_filter(name: str, before: int, coefficients: FloatArray) -> InterpolationFilter:
    coefficients = np.ascontiguousarray(coefficients, dtype=np.float64)
    coefficients.flags.writeable = False
    return InterpolationFilter(
        name=name,
        before=before,
        after=coefficients.shape[1] - before,
        weights=partial(_polynomial_weights, coefficients),
    )


def _hermite_filter(name: str, basis: FloatArray, stencils: tuple[FloatArray, ...], reach: int) -> InterpolationFilter:
    """Hermite polynomial on one segment with finite-difference nodal derivatives.

    Parameters
    ----------
    basis
        Hermite basis polynomials, shape (2 (number of stencils + 1), degree + 1).
    stencils
        Differences for the first, second ... nodal derivative.
    reach
        Number of samples after the node that the stencils use: 0 if backward, half the width if central.
    """
    width = max(len(stencil) for stencil in stencils)
    samples = width + 1  # the stencil of the segment's end lies one sample later than that of its start
    node = width - 1 - reach
    rows = np.zeros((len(basis), samples))
    derivatives = len(stencils) + 1
    for end in (0, 1):
        rows[end * derivatives, node + end] = 1.0
        for order, stencil in enumerate(stencils, start=1):
            first = end + width - len(stencil)
            rows[end * derivatives + order, first : first + len(stencil)] = stencil
    return _polynomial_filter(name, node + 1, basis.T @ rows)


_HOLD = _polynomial_filter("hold", 1, np.array([[1.0]]))
_LINEAR = _polynomial_filter("linear", 1, np.array([[1.0, 0.0], [-1.0, 1.0]]))

CAUSAL: dict[str, InterpolationFilter] = {
    "hold": _HOLD,
    "linear": _LINEAR,
    "cubic": _hermite_filter("cubic", _CUBIC_HERMITE, (_BACKWARD_FIRST_3,), 0),
    "quintic": _hermite_filter("quintic", _QUINTIC_HERMITE, (_BACKWARD_FIRST_4, _BACKWARD_SECOND_4), 0),
}
"""Filters that use no sample later than the end of the segment, by name."""

# The cubic filter (R. Keys, IEEE Transactions on Acoustics, Speech and Signal Processing 29, 1981,
# fourth-order kernel) takes its slopes from five points, not from three (Catmull-Rom): one sample more of
# look-ahead, which costs a source nothing, for an error of fourth rather than third order (at 0.1 Hz and H
# = 0.5 s: 2.0e-5 rather than 3.9e-4 of the amplitude).
SYMMETRIC: dict[str, InterpolationFilter] = {
    "hold": _HOLD,
    "linear": _LINEAR,
    "cubic": _hermite_filter("cubic", _CUBIC_HERMITE, (_CENTRAL_FIRST_5,), 2),
    "quintic": _hermite_filter("quintic", _QUINTIC_HERMITE, (_CENTRAL_FIRST_7, _CENTRAL_SECOND_7), 3),
}
"""Filters of the same names that look ahead where that makes them better."""


def extrapolation_weights(order: int, phase: float) -> FloatArray:
    """Weights of the polynomial through the newest samples, evaluated beyond them.

    Parameters
    ----------
    order
        Degree of the polynomial: 0 holds the newest sample, 1 uses the last two, 2 the last three.
    phase
        Time beyond the newest sample over the sample step, >= 0.

    Returns
    -------
    Weights, shape (order + 1,), newest sample last (Lagrange polynomials at -order ... 0).

    Raises
    ------
    ValueError
        If the order is not 0, 1 or 2.
    """
    match order:
        case 0:
            return np.array([1.0])
        case 1:
            return np.array([-phase, 1.0 + phase])
        case 2:
            return np.array([0.5 * phase * (phase + 1.0), -phase * (phase + 2.0), 0.5 * (phase + 1.0) * (phase + 2.0)])
    raise ValueError(f"extrapolation order {order} is not one of 0, 1, 2")


def _phase_responses(
    interpolation_filter: InterpolationFilter, frequency: FloatArray, sample_step: float, ratio: int
) -> NDArray[np.complex128]:
    """Response y(jH/ratio) to the samples exp(i 2 pi f nH), shape (ratio, number of frequencies)."""
    taps = np.arange(1 - interpolation_filter.before, interpolation_filter.after + 1)
    samples = np.exp(2j * np.pi * sample_step * np.outer(taps, frequency))
    weights = np.array([interpolation_filter.weights(j / ratio) for j in range(ratio)])
    return np.asarray(weights @ samples)


def frequency_response(
    interpolation_filter: InterpolationFilter, frequency: ArrayLike, sample_step: float, ratio: int
) -> NDArray[np.complex128]:
    """Complex gain from samples at `sample_step` to the signal at `sample_step / ratio`.

    A harmonic of frequency f in the samples appears in the output at f and at its images f + m / sample_step.
    The gain of the wanted component is the response at f; that of an image is the response at the image's own
    frequency.

    Parameters
    ----------
    frequency
        Frequencies in Hz, any shape.
    sample_step
        Step of the samples in s.
    ratio
        Number of output values a sample step.

    Returns
    -------
    Gain, shape of `frequency`; 1 for an ideal filter below half the sampling frequency, 0 above.
    """
    frequencies = np.asarray(frequency, dtype=np.float64)
    flat = frequencies.ravel()
    responses = _phase_responses(interpolation_filter, flat, sample_step, ratio)
    phases = np.arange(ratio) / ratio
    carrier = np.exp(-2j * np.pi * sample_step * np.outer(phases, flat))
    result: NDArray[np.complex128] = np.mean(responses * carrier, axis=0)
    return result.reshape(frequencies.shape)


def interpolation_error(
    interpolation_filter: InterpolationFilter, frequency: ArrayLike, sample_step: float, ratio: int
) -> FloatArray:
    """Root mean square error of an interpolated harmonic over the root mean square of the harmonic itself.

    Parameters
    ----------
    frequency
        Frequencies in Hz, any shape.
    sample_step
        Step of the samples in s.
    ratio
        Number of output values a sample step.

    Returns
    -------
    Relative error, shape of `frequency`.
    """
    frequencies = np.asarray(frequency, dtype=np.float64)
    flat = frequencies.ravel()
    responses = _phase_responses(interpolation_filter, flat, sample_step, ratio)
    exact = np.exp(2j * np.pi * sample_step * np.outer(np.arange(ratio) / ratio, flat))
    result: FloatArray = np.sqrt(np.mean(np.abs(responses - exact) ** 2, axis=0))
    return result.reshape(frequencies.shape)
