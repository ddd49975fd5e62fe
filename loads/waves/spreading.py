"""Directional spreading, and its decomposition into long-crested seas.

    D(theta) = A cos^2s((theta - theta_0) / 2),   int D dtheta = 1   (cos-2s, Longuet-Higgins et al. 1963)   (1)
    r_k = E[cos k (theta - theta_0)] = prod_{i=0..k-1} (s - i) / (s + 1 + i)                                (2)

A short-crested sea is made of M long-crested ones, whose elevations are independent Gaussian processes with the same
spectrum but for a share p_j of its energy. With u = sin((theta - theta_0) / 2) eq. (1) becomes the Gegenbauer weight
(1 - u²)^(s - 1/2) on -1 < u < 1, and the directions and shares are its Gauss quadrature:

    theta_j = theta_0 + 2 asin u_j,   sum_j p_j g(theta_j) = int g D dtheta for g = cos k (theta - theta_0), k < M   (3)

so all moments of eq. (2) up to k = M - 1 are exact: the mean direction and Kuik's spreading from M = 2 on, the split of
the energy over the axes (cos², sin²) from M = 3 on. Since the seas are independent, the whole is homogeneous in
space and its point spectrum exact, which a double sum with common phases is not. M = 1 is the long-crested sea.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, roots_gegenbauer

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

LARGEST_COUNT = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Directions:
    """Long-crested parts of a sea: their headings (M,) in rad, and their shares (M,) of the energy, of sum one."""

    heading: FloatArray
    share: FloatArray


def spread_directions(heading: float, exponent: float, count: int) -> Directions:
    """Decompose a cos-2s spreading about `heading` (rad) into `count` long-crested seas, eq. (3).

    Parameters
    ----------
    heading
        Mean direction of propagation theta_0, rad.
    exponent
        s; from 2 in a wind sea to 75 and more in swell. Without effect for one direction.
    count
        M.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    if not np.isfinite(heading):
        raise ScenarioError(f"wave heading is {heading} rad; it must be finite")
    if not 1 <= count <= LARGEST_COUNT:
        raise ScenarioError(f"number of wave directions is {count}; it must be from 1 to {LARGEST_COUNT}")
    if not (np.isfinite(exponent) and exponent > 0.0):
        raise ScenarioError(
            f"spreading exponent of the waves is {exponent}; it must be finite and > 0, one direction is long-crested"
        )
    if count == 1:
        return Directions(heading=np.array([heading]), share=np.ones(1))
    nodes, weights = roots_gegenbauer(count, exponent)
    share = weights / np.sum(weights)
    angle = heading + 2.0 * np.arcsin(nodes)
    share.flags.writeable = False
    angle.flags.writeable = False
    return Directions(heading=angle, share=share)


def density(angle: FloatArray, exponent: float) -> FloatArray:
    """D of eq. (1) at `angle` = theta - theta_0 (rad, -pi to pi), 1/rad.

    Raises
    ------
    ScenarioError
        If the exponent is not positive.
    """
    if not (np.isfinite(exponent) and exponent > 0.0):
        raise ScenarioError(f"spreading exponent of the waves is {exponent}; it must be finite and > 0")
    logarithm = gammaln(exponent + 1.0) - gammaln(exponent + 0.5) - np.log(2.0 * np.sqrt(np.pi))
    half = np.maximum(np.cos(0.5 * np.asarray(angle, dtype=np.float64)), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.exp(logarithm + 2.0 * exponent * np.log(half)))
