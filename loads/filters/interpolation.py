"""Interpolation and extrapolation of sampled signals by short polyphase filters.

Between two samples x_n, x_{n+1}, a step H apart, every filter gives

    y(t_n + s H) = sum_k w_k(s) x_k,        k = n+1-before ... n+after,   0 <= s <= 1        (1)

with weights that are polynomials of the phase s; a finite impulse response, hence always stable. The cubic
and quintic filters are Hermite polynomials whose nodal derivatives are finite differences of the samples.
Two neighbouring segments use the same value at their common node, so the cubic filters are continuously
differentiable and the quintic ones twice so. Causal filters difference backwards and need no sample after
the end of the segment. Symmetric filters difference centrally; they are far more accurate and keep the
phase, and need samples from beyond the segment (look-ahead).

Where look-ahead is free, longer symmetric filters come much nearer to the ideal: a sinc under a Kaiser window

    w_k(s) = v_k / sum v,   v_k = sinc(t) I0(b sqrt(1 - (t/K)^2)) / I0(b),   t = s - k,  |t| < K      (2)

and the weights whose error is least in the mean over a band of frequencies, up to B samples a cycle, with a
floor e for the rest of the spectrum,

    C w = r(s),   C_ab = c(a - b),   r_a = c(a - s),   c(t) = int_0^{1/2} W(g) cos(2 pi g t) dg,
    W = 1 for g < B,  e above;  sum w = 1 as a constraint.                                           (3)

This is the "discrete interpolation model" of Li and Kareem (Applied Ocean Research 15, 1993):
double-subscripted filters h_{k,j} = w_k(j/L) for a rate ratio L.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.differentiation import CENTRAL_DIFFERENCES

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
_CENTRAL_FIRST_5 = CENTRAL_DIFFERENCES[4]
_CENTRAL_FIRST_7 = CENTRAL_DIFFERENCES[6]
_CENTRAL_SECOND_7 = np.array([2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0]) / 180.0

_REPORT_FREQUENCIES = 401


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


@dataclass(frozen=True, slots=True, kw_only=True)
class InterpolationReport:
    """How good a filter is over a band of frequencies; see `report`.

    Parameters
    ----------
    name
        Of the filter.
    taps
        Number of samples that make one value.
    pass_band_error
        Largest deviation of the complex gain from one in the band.
    worst_image
        Largest gain of an image of the band, dB; minus infinity if there is none.
    latency
        Time in s from a value's segment to the last sample it uses; a source that looks ahead hides it.
    """

    name: str
    taps: int
    pass_band_error: float
    worst_image: float
    latency: float


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


def _taps(half_width: int) -> FloatArray:
    """Times of the samples of a symmetric filter in sample steps, the segment beginning at 0; oldest first."""
    return np.arange(1.0 - half_width, half_width + 1.0)


def _require_half_width(name: str, half_width: int) -> None:
    if half_width < 1:
        raise ScenarioError(f"interpolation filter '{name}': half-width is {half_width} samples; it must be 1 or more")


def _kaiser_weights(half_width: int, shape: float, phase: float) -> FloatArray:
    time = phase - _taps(half_width)
    window = np.i0(shape * np.sqrt(np.maximum(1.0 - (time / half_width) ** 2, 0.0)))
    values = np.sinc(time) * window
    return np.asarray(values / values.sum())


def kaiser_filter(half_width: int, shape: float, name: str = "kaiser") -> InterpolationFilter:
    """Sinc under a Kaiser window, each phase scaled to a gain of one at zero frequency, eq. (2).

    Parameters
    ----------
    half_width
        K, number of samples to either side of the segment.
    shape
        b of the window: larger for smaller images and a narrower pass band.

    Raises
    ------
    ScenarioError
        If the half-width is less than one sample, or the shape is negative or not finite.
    """
    _require_half_width(name, half_width)
    if not (np.isfinite(shape) and shape >= 0.0):
        raise ScenarioError(
            f"interpolation filter '{name}': shape of the window is {shape}; it must be finite and >= 0"
        )
    return InterpolationFilter(
        name=name, before=half_width, after=half_width, weights=partial(_kaiser_weights, half_width, shape)
    )


def _band_nodes(low: float, high: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of the Gauss-Legendre rule between two frequencies."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (high + low) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights


@dataclass(frozen=True, slots=True, eq=False)
class _LeastSquaresWeights:
    """Solution of eq. (3): w = solver (cos 2 pi g s, sin 2 pi g s), corrected along `constant` to sum w = 1.

    The equations are solved as an overdetermined system at the nodes g of a quadrature rule, by orthogonal
    factors rather than through C, which would square their condition number.
    """

    nodes: FloatArray
    solver: FloatArray
    constant: FloatArray

    def __call__(self, phase: float) -> FloatArray:
        angle = (2.0 * np.pi * phase) * self.nodes
        free = self.solver @ np.concatenate([np.cos(angle), np.sin(angle)])
        return np.asarray(free + self.constant * (1.0 - free.sum()))


def optimal_filter(half_width: int, band: float, floor: float = 1e-8, name: str = "optimal") -> InterpolationFilter:
    """Filter of least mean square error over a band of frequencies, eq. (3).

    Parameters
    ----------
    half_width
        K, number of samples to either side of the segment.
    band
        B, upper end of the band in cycles per sample step, below one half.
    floor
        Weight of the frequencies above the band, relative to that in the band; it bounds what the filter makes
        of them, and the condition number.

    Raises
    ------
    ScenarioError
        If the half-width is less than one sample, or band or floor are out of their ranges.
    """
    _require_half_width(name, half_width)
    if not 0.0 < band <= 0.5:
        raise ScenarioError(
            f"interpolation filter '{name}': band ends at {band} cycles a sample; it must be in (0, 0.5]"
        )
    if not 1e-12 <= floor <= 1.0:
        raise ScenarioError(f"interpolation filter '{name}': floor is {floor}; it must be from 1e-12 to 1")
    # A Gauss-Legendre rule of n nodes integrates a cosine over n radians or more to rounding; here there are up to
    # 2 pi half_width over both parts of the spectrum.
    count = 4 * half_width + 16
    parts = [(*_band_nodes(0.0, band, count), 1.0), (*_band_nodes(band, 0.5, count), floor)]
    nodes = np.concatenate([part[0] for part in parts])
    scale = np.tile(np.concatenate([np.sqrt(weights * density) for _, weights, density in parts]), 2)
    angle = 2.0 * np.pi * np.outer(nodes, _taps(half_width))
    inverse = np.linalg.pinv(scale[:, np.newaxis] * np.vstack([np.cos(angle), np.sin(angle)]))
    constant = inverse @ inverse.sum(axis=0)
    weights = _LeastSquaresWeights(nodes, inverse * scale, constant / constant.sum())
    for array in (weights.nodes, weights.solver, weights.constant):
        array.flags.writeable = False
    return InterpolationFilter(name=name, before=half_width, after=half_width, weights=weights)


def hermite_weights(derivatives: int, phase: float, step: float) -> FloatArray:
    """Weights of the Hermite polynomial through values and known time derivatives at both ends of a segment.

    Parameters
    ----------
    derivatives
        1 for the cubic polynomial, 2 for the quintic one.
    phase
        Time since the start of the segment over its length, in [0, 1].
    step
        Length of the segment in s.

    Returns
    -------
    Shape (derivatives + 1, 2): row d multiplies the d-th derivative at the start and at the end.
    """
    basis = {1: _CUBIC_HERMITE, 2: _QUINTIC_HERMITE}[derivatives]
    values = basis @ phase ** np.arange(basis.shape[1])
    return np.asarray(values.reshape(2, derivatives + 1).T * (step ** np.arange(derivatives + 1))[:, np.newaxis])


def _hermite_values(derivatives: int, phase: float) -> FloatArray:
    return hermite_weights(derivatives, phase, 1.0)[0]


_HOLD = _polynomial_filter("hold", 1, np.array([[1.0]]))
_LINEAR = _polynomial_filter("linear", 1, np.array([[1.0, 0.0], [-1.0, 1.0]]))
# The cubic filter (R. Keys, IEEE Transactions on Acoustics, Speech and Signal Processing 29, 1981,
# fourth-order kernel) takes its slopes from five points, not from three (Catmull-Rom): one sample more of
# look-ahead, which costs a source nothing, for an error of fourth rather than third order (at 0.1 Hz and H
# = 0.5 s: 2.0e-5 rather than 3.9e-4 of the amplitude).
_SIX_POINT = _hermite_filter("six_point", _CUBIC_HERMITE, (_CENTRAL_FIRST_5,), 2)

CAUSAL: dict[str, InterpolationFilter] = {
    "hold": _HOLD,
    "linear": _LINEAR,
    "cubic": _hermite_filter("cubic", _CUBIC_HERMITE, (_BACKWARD_FIRST_3,), 0),
    "quintic": _hermite_filter("quintic", _QUINTIC_HERMITE, (_BACKWARD_FIRST_4, _BACKWARD_SECOND_4), 0),
}
"""Filters that use no sample later than the end of the segment, by name."""

# Kaiser and least squares: to 0.25 cycles a sample both are right to 2e-5 with images below -95 dB; least
# squares does it with 12 samples, the window with 16.
SYMMETRIC: dict[str, InterpolationFilter] = {
    "hold": _HOLD,
    "linear": _LINEAR,
    "cubic": replace(_SIX_POINT, name="cubic"),
    "quintic": _hermite_filter("quintic", _QUINTIC_HERMITE, (_CENTRAL_FIRST_7, _CENTRAL_SECOND_7), 3),
    "six_point": _SIX_POINT,
    "kaiser": kaiser_filter(8, 10.0),
    "optimal": optimal_filter(6, 0.25),
}
"""Filters that look ahead where that makes them better, by name.

Those whose names are in `CAUSAL` as well have a causal counterpart, which takes their place where there is
nothing to look ahead to; the others have none.
"""


HERMITE: dict[int, InterpolationFilter] = {
    derivatives: InterpolationFilter(name=name, before=1, after=1, weights=partial(_hermite_values, derivatives))
    for derivatives, name in ((1, "cubic"), (2, "quintic"))
}
"""Hermite polynomials by the number of known derivatives; see `hermite_weights` for the weights of the derivatives."""


def interpolate(interpolation_filter: InterpolationFilter, samples: ArrayLike, ratio: int) -> FloatArray:
    """Bring a sampled signal to a step `ratio` times finer, wherever the samples reach, eq. (1).

    Parameters
    ----------
    samples
        Shape (count, ...), time along the first axis.
    ratio
        Number of values a sample step, >= 1.

    Returns
    -------
    Shape ((count - before - after + 1) ratio, ...); row 0 belongs to sample number before - 1.

    Raises
    ------
    ScenarioError
        If there are fewer samples than the filter uses, or the ratio is less than 1.
    """
    values = np.asarray(samples, dtype=np.float64)
    taps = interpolation_filter.before + interpolation_filter.after
    count = len(values) if values.ndim else 0
    if count < taps:
        raise ScenarioError(f"interpolation filter '{interpolation_filter.name}': {count} samples; it needs {taps}")
    weights = _phase_weights(interpolation_filter, ratio)
    windows = np.lib.stride_tricks.sliding_window_view(values, taps, axis=0)
    fine = np.moveaxis(windows @ weights.T, -1, 1)
    return np.ascontiguousarray(fine).reshape(-1, *values.shape[1:])


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


def _phase_weights(interpolation_filter: InterpolationFilter, ratio: int) -> FloatArray:
    """Weights of the phases 0, 1/ratio ..., shape (ratio, before + after)."""
    if ratio < 1:
        raise ScenarioError(f"interpolation filter '{interpolation_filter.name}': ratio is {ratio}; it must be >= 1")
    return np.array([interpolation_filter.weights(j / ratio) for j in range(ratio)])


def _phase_responses(
    interpolation_filter: InterpolationFilter, frequency: FloatArray, sample_step: float, ratio: int, derivatives: int
) -> NDArray[np.complex128]:
    """Response y(jH/ratio) to the samples exp(i 2 pi f nH), shape (ratio, number of frequencies)."""
    taps = np.arange(1 - interpolation_filter.before, interpolation_filter.after + 1)
    samples = np.exp(2j * np.pi * sample_step * np.outer(taps, frequency))
    if not derivatives:
        return np.asarray(_phase_weights(interpolation_filter, ratio) @ samples)
    # The derivatives are those of the harmonic itself, the lowest of all that have these samples.
    cycles = frequency * sample_step
    powers = (2j * np.pi * (cycles - np.rint(cycles))) ** np.arange(derivatives + 1)[:, np.newaxis]
    rows = np.array([hermite_weights(derivatives, j / ratio, 1.0) for j in range(ratio)])
    return np.asarray(np.einsum("jdk,df,kf->jf", rows, powers, samples))


def frequency_response(
    interpolation_filter: InterpolationFilter,
    frequency: ArrayLike,
    sample_step: float,
    ratio: int,
    derivatives: int = 0,
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
    derivatives
        Number of time derivatives that are known at the samples, with the filter of `HERMITE` for as many.

    Returns
    -------
    Gain, shape of `frequency`; 1 for an ideal filter below half the sampling frequency, 0 above.
    """
    frequencies = np.asarray(frequency, dtype=np.float64)
    flat = frequencies.ravel()
    responses = _phase_responses(interpolation_filter, flat, sample_step, ratio, derivatives)
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
    responses = _phase_responses(interpolation_filter, flat, sample_step, ratio, 0)
    exact = np.exp(2j * np.pi * sample_step * np.outer(np.arange(ratio) / ratio, flat))
    result: FloatArray = np.sqrt(np.mean(np.abs(responses - exact) ** 2, axis=0))
    return result.reshape(frequencies.shape)


def report(
    interpolation_filter: InterpolationFilter,
    band: tuple[float, float],
    sample_step: float,
    ratio: int,
    derivatives: int = 0,
) -> InterpolationReport:
    """What a filter does to a band of frequencies, from samples at `sample_step` to `sample_step / ratio`.

    Parameters
    ----------
    band
        Lowest and highest frequency in Hz, below half the sampling frequency.
    sample_step
        Step of the samples in s.
    ratio
        Number of output values a sample step.
    derivatives
        As of `frequency_response`.

    Raises
    ------
    ScenarioError
        If the band is not within zero and half the sampling frequency, or the ratio is less than 1.
    """
    low, high = band
    require_positive("sample step of an interpolation filter", sample_step, "s")
    nyquist = 0.5 / sample_step
    if not 0.0 <= low <= high <= nyquist:
        raise ScenarioError(
            f"interpolation filter '{interpolation_filter.name}': band {low:g} to {high:g} Hz; it must lie within "
            f"0 and {nyquist:g} Hz, half the sampling frequency"
        )
    frequency = np.linspace(low, high, _REPORT_FREQUENCIES)
    gain = frequency_response(interpolation_filter, frequency, sample_step, ratio, derivatives)
    # In the output, sampled at ratio / sample_step, all images are distinct for 1 <= m < ratio and then repeat.
    orders = np.arange(1, ratio) / sample_step
    image_frequency = np.add.outer(orders, frequency)
    images = np.abs(frequency_response(interpolation_filter, image_frequency, sample_step, ratio, derivatives))
    largest = float(images.max(initial=0.0))
    return InterpolationReport(
        name=interpolation_filter.name,
        taps=interpolation_filter.before + interpolation_filter.after,
        pass_band_error=float(np.abs(gain - 1.0).max()),
        worst_image=20.0 * float(np.log10(largest)) if largest > 0.0 else -np.inf,
        latency=interpolation_filter.after * sample_step,
    )
