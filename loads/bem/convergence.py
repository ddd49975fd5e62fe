"""How far a coefficient is from its limit on ever finer panels, told by two or three meshes of one family.

Constant potentials, averaged over panels, leave an error that falls with panel length h as h² on smooth surfaces and
as h^(4/3) at right-angled edges, where the potential goes as r^(2/3). With panels that are clustered at edges it is
between the two, so that of two meshes of which one has panels half as long,

    f = f_fine + (f_fine - f_coarse) / (2^p - 1),   p = 5/3,   error = what lies between p = 4/3 and p = 2      (1)

and not less than a thousandth of f, since the difference of two meshes may vanish by chance. Where waves are too short
for the coarse mesh its values say nothing: with s the length of a panel's diagonal and z of its top,

    κ = max over its panels of k s exp(k z)                                                                    (2)

the correction fades from all of it at κ = 1 to none at κ = 2, or to that of a value without waves, and what is left out
of it is added to the error.

With a third mesh the order is observed, and the error is Roache's grid convergence index, with a safety of 1.25 where
the order is the formal one and of 3 elsewhere (Roache 1998, Verification and Validation in Computational Science and
Engineering; Richardson 1911):

    p = log2[(f_2 - f_1) / (f_3 - f_2)]                                                                          (3)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.mesh import Mesh, panels

EDGE_ORDER, MIDDLE_ORDER, SMOOTH_ORDER = 4.0 / 3.0, 5.0 / 3.0, 2.0
_NEAR_FORMAL = 0.25  # difference of the observed order from 2 within which it counts as the formal one
_SAFETY, _SAFETY_ELSEWHERE = 1.25, 3.0
_LEAST = 1e-3
_ORDERS = (0.5, 4.0)  # observed orders outside these say that the meshes are too coarse to extrapolate


class Limit(NamedTuple):
    """A value on infinitely many panels and its error bar, of the shape of what was extrapolated."""

    value: NDArray
    error: NDArray[np.float64]


def _gain(order: float) -> float:
    return 1.0 / (2.0**order - 1.0)


def resolved_share(coarse: Mesh, wavenumber: ArrayLike) -> NDArray[np.float64]:
    """Share (n,) of the correction that is made for wavenumbers (n,), eq. (2): 1 for long waves, 0 for short."""
    k = np.atleast_1d(np.asarray(wavenumber, dtype=np.float64))[:, None]
    size, top = panels(coarse).size, coarse.vertices[:, :, 2].max(axis=1)
    fineness = np.max(k * size * np.exp(k * top), axis=1)
    return np.asarray(np.cos(0.5 * np.pi * np.clip(fineness - 1.0, 0.0, 1.0)) ** 2)


def limit(fine: ArrayLike, coarse: ArrayLike, share: ArrayLike = 1.0, steady: ArrayLike = 0.0) -> Limit:
    """Limit by eq. (1) of values, real or complex, on a mesh and on one with panels twice as long.

    `share` is the part of the correction that is made; the rest is that of `steady`, another difference of the meshes.
    Both have shapes that broadcast to that of the values.
    """
    step = np.asarray(fine) - np.asarray(coarse)
    error = (_gain(EDGE_ORDER) - _gain(SMOOTH_ORDER)) * np.abs(step)
    part = np.asarray(share, dtype=np.float64)
    rest = (1.0 - part) * np.asarray(steady)
    error = error + _gain(MIDDLE_ORDER) * np.abs((1.0 - part) * step - rest)
    value = np.asarray(fine) + _gain(MIDDLE_ORDER) * (part * step + rest)
    return Limit(value, np.maximum(error, _LEAST * np.abs(fine)))


def observed_limit(coarse: ArrayLike, middle: ArrayLike, fine: ArrayLike) -> tuple[Limit, NDArray[np.float64]]:
    """Limit of real values on three meshes, each with panels half as long as the one before, and the order of eq. (3).

    Where the order is not between 1/2 and 4, the fine value is given with the whole last step as its error, and the
    order is NaN.
    """
    first = np.asarray(middle, dtype=np.float64) - np.asarray(coarse, dtype=np.float64)
    second = np.asarray(fine, dtype=np.float64) - np.asarray(middle, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        order = np.log2(first / second)
    good = (order > _ORDERS[0]) & (order < _ORDERS[1])
    order = np.where(good, order, np.nan)
    correction = np.where(good, second / (2.0 ** np.where(good, order, 1.0) - 1.0), 0.0)
    safety = np.where(np.abs(order - SMOOTH_ORDER) < _NEAR_FORMAL, _SAFETY, _SAFETY_ELSEWHERE)
    error = np.where(good, safety * np.abs(correction), np.abs(second))
    return Limit(np.asarray(fine) + correction, error), order
