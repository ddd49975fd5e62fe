"""Current that changes with depth.

    U(z) = T(-z) ((d + z) / d)^n                                                                     (1)
    z' = d (z - eta) / (d + eta)                                                                     (2)

T is a table over the depth below mean water level, linear between its rows and constant beyond them, as vectors, so
that the heading turns with depth; n = 0 leaves it as it is. One row is a uniform current, or with n > 0 the power law:
n = 1/7 for a tidal current (DNV-RP-C205, 4.1.4). Above mean water level the current is that of z = 0. Stretched with
the waves it is taken at z', eq. (2), so that the profile reaches from the bottom to the wave's surface.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

TIDAL_EXPONENT = 1.0 / 7.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Current:
    """A current, eq. (1); columns of a table of n >= 1 rows.

    Parameters
    ----------
    depth
        Below mean water level, ascending, shape (n,), m, >= 0.
    speed
        Shape (n,), m/s, >= 0.
    heading
        Direction toward which it flows, counter-clockwise from +x, shape (n,), rad.
    exponent
        n of eq. (1), >= 0.
    water_depth
        d of eq. (1), m; needed where the exponent is not zero.
    stretched
        Whether the profile is stretched to the surface of the waves, eq. (2).

    Raises
    ------
    ScenarioError
        If a number is out of range, the depths do not ascend, or a power law has no water depth.
    """

    depth: FloatArray
    speed: FloatArray
    heading: FloatArray
    exponent: float = 0.0
    water_depth: float = np.inf
    stretched: bool = False

    def __post_init__(self) -> None:
        for name in ("depth", "speed", "heading"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 or len(value) == 0 or not np.all(np.isfinite(value)):
                raise ScenarioError(
                    f"current profile: {name} has shape {value.shape}; it must be finite, of shape (n,), one value a "
                    "row of the table"
                )
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        rows = {name: len(getattr(self, name)) for name in ("depth", "speed", "heading")}
        if len(set(rows.values())) != 1:
            raise ScenarioError(f"current profile: columns have {rows} rows; they must be equally long")
        if self.speed.min() < 0.0:
            raise ScenarioError(
                f"current speed is {self.speed.min()} m/s; it must be finite and >= 0, the heading gives the direction"
            )
        if self.depth[0] < 0.0 or np.any(np.diff(self.depth) <= 0.0):
            raise ScenarioError(
                f"current profile: depths are {self.depth.tolist()} m; they must ascend from >= 0 at the surface down"
            )
        if not (np.isfinite(self.exponent) and self.exponent >= 0.0):
            raise ScenarioError(f"current profile: exponent is {self.exponent}; it must be finite and >= 0")
        if self.exponent > 0.0:
            require_positive("water depth of a current by the power law", self.water_depth, "m")


def uniform_current(speed: float, heading: float = 0.0) -> Current:
    """One current (m/s, rad) at all depths.

    Raises
    ------
    ScenarioError
        If the speed is negative or a number is not finite.
    """
    return Current(depth=np.zeros(1), speed=np.array([speed]), heading=np.array([heading]))


def power_law_current(
    speed: float, heading: float, water_depth: float, exponent: float = TIDAL_EXPONENT, *, stretched: bool = False
) -> Current:
    """Current of `speed` (m/s) at mean water level by the power law of eq. (1); heading in rad, water depth in m.

    Raises
    ------
    ScenarioError
        If a number is out of range.
    """
    return Current(
        depth=np.zeros(1),
        speed=np.array([speed]),
        heading=np.array([heading]),
        exponent=exponent,
        water_depth=water_depth,
        stretched=stretched,
    )


def current_velocity(current: Current, height: ArrayLike) -> FloatArray:
    """Velocity of the current, eq. (1).

    Parameters
    ----------
    height
        z above mean water level, shape (n,), m; above it the velocity is that of z = 0.

    Returns
    -------
    Shape (n, 3), m/s.

    Raises
    ------
    ScenarioError
        If a power law is asked for below the sea bed.
    """
    level = np.minimum(np.asarray(height, dtype=np.float64), 0.0)
    along = np.interp(-level, current.depth, current.speed * np.cos(current.heading))
    across = np.interp(-level, current.depth, current.speed * np.sin(current.heading))
    velocity = np.stack([along, across, np.zeros_like(along)], axis=1)
    if current.exponent == 0.0:
        return np.asarray(velocity)
    if np.any(level < -current.water_depth):
        raise ScenarioError(
            f"current asked at z = {float(level.min())} m, below the sea bed of its power law at "
            f"{-current.water_depth} m"
        )
    share = 1.0 + level / current.water_depth
    return np.asarray(velocity * (share**current.exponent)[:, None])
