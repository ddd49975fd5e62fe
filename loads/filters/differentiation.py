"""Discrete differentiation: derivatives of a sampled signal by central differences.

    y_n = (1/dt) sum_{k=1..r} c_k (x_{n+k} - x_{n-k})                                                (1)
    D(f) = i (2/dt) sum_k c_k sin(k W),   W = 2 pi f dt                                              (2)
    G(f) = D(f) / (i 2 pi f) = 1 - O(W^p),   p = 2 r                                                 (3)

The differentiation model of Li and Kareem (1990), there of second order: G = sin(W) / W. A central difference
keeps the phase and lowers the amplitude; how much depends on W alone, so the signal is brought to a fine step
first, or the order is raised.
"""

from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]


def _read_only(weights: list[float], divisor: float) -> FloatArray:
    array = np.array(weights) / divisor
    array.flags.writeable = False
    return array


CENTRAL_DIFFERENCES = MappingProxyType(
    {
        2: _read_only([-1.0, 0.0, 1.0], 2.0),
        4: _read_only([1.0, -8.0, 0.0, 8.0, -1.0], 12.0),
        6: _read_only([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0], 60.0),
    }
)
"""Weights of dt dx/dt at the middle sample, oldest sample first, by order of accuracy p; shape (p + 1,)."""


def central_difference(order: int) -> FloatArray:
    """Entry of `CENTRAL_DIFFERENCES`.

    Raises
    ------
    ScenarioError
        If the order is not 2, 4 or 6.
    """
    if order not in CENTRAL_DIFFERENCES:
        orders = ", ".join(map(str, CENTRAL_DIFFERENCES))
        raise ScenarioError(f"central difference: order {order} is not one of {orders}")
    return CENTRAL_DIFFERENCES[order]


def differentiate(samples: ArrayLike, step: float, order: int = 2) -> FloatArray:
    """Time derivative of a sampled signal, eq. (1), wherever the samples reach.

    Parameters
    ----------
    samples
        Shape (count, ...), time along the first axis.
    step
        In s.
    order
        Order of accuracy: 2, 4 or 6.

    Returns
    -------
    Shape (count - order, ...), unit/s; row 0 belongs to sample number order / 2.

    Raises
    ------
    ScenarioError
        If the order is not one of these, the step is not positive, or there are too few samples.
    """
    weights = central_difference(order)
    require_positive("step of a central difference", step, "s")
    values = np.asarray(samples, dtype=np.float64)
    if values.ndim == 0 or len(values) <= order:
        count = len(values) if values.ndim else 0
        raise ScenarioError(f"central difference of order {order}: {count} samples; it needs {order + 1} or more")
    windows = np.lib.stride_tricks.sliding_window_view(values, order + 1, axis=0)
    return np.asarray(windows @ weights / step)


def derivative_gain(frequency: ArrayLike, step: float, order: int = 2) -> FloatArray:
    """Computed over true amplitude of the derivative of a harmonic, eq. (3), real; shape of `frequency`, Hz.

    Raises
    ------
    ScenarioError
        If the order is not 2, 4 or 6, or the step is not positive.
    """
    weights = central_difference(order)
    require_positive("step of a central difference", step, "s")
    angle = 2.0 * np.pi * step * np.asarray(frequency, dtype=np.float64)
    lags = np.arange(1, order // 2 + 1)
    # sin(k W) / W = k sinc(k W / pi), finite at zero frequency
    gains = 2.0 * lags * np.sinc(np.multiply.outer(angle, lags) / np.pi)
    return np.asarray(gains @ weights[order // 2 + 1 :])


def largest_step(frequency: float, error: float, order: int = 2) -> float:
    """Largest step in s at which the gain at `frequency` (Hz) is within `error` of one.

    Raises
    ------
    ScenarioError
        If the order is not 2, 4 or 6, the frequency is not positive, or the error not between 0 and 1.
    """
    require_positive("frequency of a central difference", frequency, "Hz")
    if not 0.0 < error < 1.0:
        raise ScenarioError(f"central difference: error of the gain is {error}; it must be between 0 and 1")
    central_difference(order)
    # The gain falls steadily from one at no step to zero at the Nyquist step: halve that interval.
    below, above = 0.0, 0.5 / frequency
    while (middle := 0.5 * (below + above)) not in (below, above):
        if derivative_gain(frequency, middle, order) >= 1.0 - error:
            below = middle
        else:
            above = middle
    return below
