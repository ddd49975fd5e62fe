"""Anti-alias filters from a fast component to a slow one.

Samples at the step h reach a component of the step H = R h, R > 1. Taken as they are, what lies between 0.5/H and 0.5/h
folds into the band below. Where the future is known, a sinc under a Kaiser window takes it off without any delay,

    w_k = v_k / sum v,   v_k = sinc(t / R) I0(b sqrt(1 - (t / K R)^2)) / I0(b),   t = s - k,   |t| < K R      (1)

(K = 5, b = 7.86: to 0.25/H right to 2e-4, what would fold onto that band is 80 dB down). Inside a loop there is no
future, and a delay would act as negative damping. There the newest R samples are replaced by their least squares line,
evaluated at the instant that is asked for, also beyond them,

    w_k = 1/n + 12 (k - m) (t - m) / (n (n^2 - 1)),   k = 0 ... n - 1,   m = (n - 1) / 2,   n >= R             (2)

which passes a line without delay, and noise with the variance 4/n where it is evaluated at the newest sample.
"""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.interpolation import InterpolationFilter

FloatArray = NDArray[np.float64]

HALF_WIDTH = 5
"""K of eq. (1), in steps of the slow component."""
_SHAPE = 7.86
_LARGEST_RATIO = 200.0


def _require_ratio(ratio: float) -> None:
    if not 1.0 < ratio <= _LARGEST_RATIO:
        raise ScenarioError(
            f"anti-alias filter: the step of the target is {ratio:g} times that of the source; it must be more than 1 "
            f"and at most {_LARGEST_RATIO:g} times; take another filter, or a step in between"
        )


def _window_weights(ratio: float, reach: int, phase: float) -> FloatArray:
    time = phase - np.arange(1.0 - reach, reach + 1.0)
    window = np.i0(_SHAPE * np.sqrt(np.maximum(1.0 - (time / (HALF_WIDTH * ratio)) ** 2, 0.0)))
    values = np.where(np.abs(time) < HALF_WIDTH * ratio, np.sinc(time / ratio) * window, 0.0)
    return np.asarray(values / values.sum())


def decimation_filter(ratio: float) -> InterpolationFilter:
    """Filter of eq. (1), which looks ahead.

    Parameters
    ----------
    ratio
        R, step of the target over that of the source.

    Raises
    ------
    ScenarioError
        If the ratio is not above 1, or so large that a filter would be of more than two thousand samples.
    """
    _require_ratio(ratio)
    reach = math.ceil(HALF_WIDTH * ratio)
    weights = partial(_window_weights, ratio, reach)
    return InterpolationFilter(name="anti_alias", before=reach, after=reach, weights=weights)


def line_weights(count: int, time: float) -> FloatArray:
    """Weights of eq. (2), oldest sample first.

    Parameters
    ----------
    count
        n, number of samples, 2 or more.
    time
        t, instant in sample steps from the oldest sample on.
    """
    middle = 0.5 * (count - 1)
    places = np.arange(count) - middle
    return np.asarray(1.0 / count + 12.0 * places * (time - middle) / (count * (count**2 - 1)))


def causal_decimation_filter(ratio: float) -> InterpolationFilter:
    """Filter of eq. (2), which needs no sample after the instant that is asked for.

    Parameters
    ----------
    ratio
        R, step of the target over that of the source; n is R, rounded up, and one more.

    Raises
    ------
    ScenarioError
        As `decimation_filter`.
    """
    _require_ratio(ratio)
    count = math.ceil(ratio) + 1
    weights = partial(_line_at_phase, count)
    return InterpolationFilter(name="anti_alias", before=count, after=0, weights=weights)


def _line_at_phase(count: int, phase: float) -> FloatArray:
    return line_weights(count, count - 1.0 + phase)
