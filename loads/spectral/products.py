"""Quadratic loads as lists of products of quantities that are linear in the waves.

z_i(t) = sum_m w_im a_m(t) b_m(t)                                                                    (1)

a and b are rows of one table, so that a quantity in many products stands in it once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Places = NDArray[np.int64]


class Products(NamedTuple):
    """Eq. (1) by decomposed functions (G, N) of N components, the rows of a and b in them (M,), and weights (q, M)."""

    processes: ComplexArray
    one: Places
    other: Places
    weights: FloatArray

    @property
    def first(self) -> ComplexArray:
        """a, (M, N)."""
        return np.asarray(self.processes[self.one])

    @property
    def second(self) -> ComplexArray:
        """b, (M, N)."""
        return np.asarray(self.processes[self.other])


def pairs(first: ComplexArray, second: ComplexArray, weights: FloatArray) -> Products:
    """Products of each row of `first` (M, N) with that of `second`; weights (q, M)."""
    count = np.arange(len(first))
    if first is second:
        return Products(first, count, count, weights)
    return Products(np.concatenate([first, second]), count, len(first) + np.arange(len(second)), weights)


def no_products(count: int, size: int = 6) -> Products:
    """None, on a grid of `count` components, of `size` loads."""
    return pairs(
        np.zeros((0, count), dtype=np.complex128), np.zeros((0, count), dtype=np.complex128), np.zeros((size, 0))
    )


def joined(*parts: Products) -> Products:
    """The terms of all."""
    shifts = np.cumsum([0, *(len(each.processes) for each in parts)])
    return Products(
        np.concatenate([each.processes for each in parts]),
        np.concatenate([each.one + shift for each, shift in zip(parts, shifts, strict=False)]),
        np.concatenate([each.other + shift for each, shift in zip(parts, shifts, strict=False)]),
        np.concatenate([each.weights for each in parts], axis=1),
    )
