"""Stretching: linear waves in the water that linear theory does not know, up to the wave's surface.

At the height z of a point, the elevation eta above it and the depth d, the linear solution q(z) is replaced by

    none       q(z), z <= 0                                     linear theory as it stands           (1)
    vertical   q(min(z, 0))                                     its value at z = 0 kept above         (2)
    linear     q(z), z <= 0;  q(0) + z dq/dz(0), z > 0          its tangent continued above            (3)
    wheeler    q(d (z - eta) / (d + eta))                       its profile shifted to the surface     (4)

Eq. (3) is the linear extrapolation of Rodenbusch and Forristall (OTC 1986), eq. (4) is Wheeler's (OTC 1969); with
z - eta in deep water. A point above the surface is dry: there is no water, and the kinematics are zero.
"""

import difflib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Where to take the linear solution: q(level) + excess dq/dz(level) where `wet`; arrays of shape (n,), m."""

    level: FloatArray
    excess: FloatArray
    wet: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretching:
    """A stretching as factors of the elevation and the height, 0 or 1.

    Parameters
    ----------
    rises
        1 where there is water up to the wave's surface, 0 where it ends at mean water level.
    follows
        1 where the profile moves with the surface, eq. (4).
    tangent
        1 where the tangent at z = 0 goes on above it, eq. (3).
    """

    rises: float = 1.0
    follows: float = 0.0
    tangent: float = 0.0


STRETCHING: dict[str, Stretching] = {
    "none": Stretching(rises=0.0),
    "vertical": Stretching(),
    "linear": Stretching(tangent=1.0),
    "wheeler": Stretching(follows=1.0),
}


def stretching_by_name(name: str) -> Stretching:
    """Entry of `STRETCHING`.

    Raises
    ------
    ScenarioError
        If there is none of that name.
    """
    if name not in STRETCHING:
        nearest = difflib.get_close_matches(name.lower(), STRETCHING, n=1, cutoff=0.0)[0]
        raise ScenarioError(
            f"stretching {name!r} is not known; did you mean {nearest!r}? Known: {', '.join(STRETCHING)}"
        )
    return STRETCHING[name]


def stretched(name: str, height: FloatArray, elevation: FloatArray, depth: float) -> Levels:
    """Levels of points at `height` (n,) under an elevation (n,), m, in water of `depth` m, eq. (1) to (4).

    Raises
    ------
    ScenarioError
        If the stretching is not known, a point lies below the bottom, or a trough reaches it.
    """
    rule = stretching_by_name(name)
    if np.any(height < -depth):
        raise ScenarioError(f"wave kinematics asked at z = {float(height.min())} m, below the sea bed at {-depth} m")
    if np.any(elevation <= -depth):
        raise ScenarioError(f"wave trough of {float(elevation.min())} m reaches the sea bed at {-depth} m")
    moved = rule.follows * elevation
    shifted = height - moved
    level = shifted if np.isinf(depth) else depth * shifted / (depth + moved)
    return Levels(
        # A dry point is taken at the surface, and round-off at the bottom to the bottom.
        level=np.clip(level, -depth, 0.0),
        excess=rule.tangent * np.maximum(height, 0.0),
        wet=height <= rule.rises * elevation,
    )
