"""Quadratic loads as lists of products of quantities that are linear in the waves.

z_i(t) = sum_m w_im a_m(t) b_m(t)                                                                    (1)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Products(NamedTuple):
    """Eq. (1) by decomposed functions a and b (M, N) on a grid of N components, and weights (q, M)."""

    first: ComplexArray
    second: ComplexArray
    weights: FloatArray


def no_products(count: int, size: int = 6) -> Products:
    """None, on a grid of `count` components, of `size` loads."""
    empty = np.zeros((0, count), dtype=np.complex128)
    return Products(empty, empty, np.zeros((size, 0)))


def joined(one: Products, other: Products) -> Products:
    """The terms of both."""
    return Products(
        np.concatenate([one.first, other.first]),
        np.concatenate([one.second, other.second]),
        np.concatenate([one.weights, other.weights], axis=1),
    )
