"""Wind forces on a platform: eq. (1) and (2), and the expansion of Fig. 2, of Li and Kareem (1990).

    f_m = D_m (U_m + u_m - v_m) |U_m + u_m - v_m|,   D_m = 0.5 rho A_m C_m                           (1)
    F = sum_m T_m f_m,   T_m = [d; r_m x d],   v_m = T_m^T X'                                        (2)

d is the unit vector of the wind, r_m the position of a segment relative to the platform's reference point, turned
with the platform's yaw, and v_m the velocity of that point along the wind from all six rates. The sign in eq. (1),
where the paper has a square, matters only when the wind reverses. Without it eq. (1) is the sum of

    mean            D_m (U_m² + sigma_m²)                                                            (3)
    exciting        2 D_m U_m u_m
    damping         -2 D_m U_m v_m
    second order    D_m (u_m² - sigma_m²)

and of D_m (v_m² - 2 u_m v_m), which Fig. 2 leaves out.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.checks import entry, require_positive
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.process import ProcessState
from tlpsim.loads.wind.field import Gusts, SpeedField, wind_field
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.segments import Segments, default_segments

FloatArray = NDArray[np.float64]

DEFAULT_AIR_DENSITY = 1.225


@njit(cache=True)
def _transformation(
    position: FloatArray, cosine: float, sine: float, velocity: FloatArray, yaw: float
) -> tuple[FloatArray, FloatArray]:
    """T_m^T (n, 6) and v_m (n,) of eq. (2); `cosine` and `sine` are those of the wind's heading."""
    count = len(position)
    transformation = np.empty((count, 6))
    along = np.empty(count)
    yaw_cosine, yaw_sine = math.cos(yaw), math.sin(yaw)
    # Angular velocity from the rates of roll, pitch and yaw; the tilt of the deck itself is neglected.
    rate_x = yaw_cosine * velocity[3] - yaw_sine * velocity[4]
    rate_y = yaw_sine * velocity[3] + yaw_cosine * velocity[4]
    rate_z = velocity[5]
    for m in range(count):
        x = yaw_cosine * position[m, 0] - yaw_sine * position[m, 1]
        y = yaw_sine * position[m, 0] + yaw_cosine * position[m, 1]
        z = position[m, 2]
        arm_x, arm_y, arm_z = -z * sine, z * cosine, x * sine - y * cosine
        along[m] = velocity[0] * cosine + velocity[1] * sine + rate_x * arm_x + rate_y * arm_y + rate_z * arm_z
        transformation[m, 0] = cosine
        transformation[m, 1] = sine
        transformation[m, 2] = 0.0
        transformation[m, 3] = arm_x
        transformation[m, 4] = arm_y
        transformation[m, 5] = arm_z
    return transformation, along


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalWind:
    """Wind at n segments at one time; every array of shape (n,).

    Parameters
    ----------
    drag
        D, kg/m.
    mean, variance
        U and sigma², m/s and m²/s².
    fluctuation
        u, m/s.
    along
        v, velocity of the segment along the wind, m/s.
    """

    drag: FloatArray
    mean: FloatArray
    variance: FloatArray
    fluctuation: FloatArray
    along: FloatArray


def _full(wind: LocalWind) -> FloatArray:
    """Eq. (1)."""
    relative = wind.mean + wind.fluctuation - wind.along
    return wind.drag * relative * np.abs(relative)


def _terms(wind: LocalWind) -> FloatArray:
    """The four terms of eq. (3), shape (4, n)."""
    steep = 2.0 * wind.drag * wind.mean
    return np.stack(
        [
            wind.drag * (wind.mean**2 + wind.variance),
            steep * wind.fluctuation,
            -steep * wind.along,
            wind.drag * (wind.fluctuation**2 - wind.variance),
        ]
    )


DECOMPOSITIONS: dict[str, Callable[[LocalWind], FloatArray]] = {
    "full": _full,
    "expanded": lambda wind: np.asarray(_terms(wind).sum(axis=0)),
    "linear": lambda wind: np.asarray(_terms(wind)[:3].sum(axis=0)),
}
"""Local forces (n,): of eq. (1), of the four terms of eq. (3), and of its first three, as the paper keeps them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WindForceParts:
    """Terms of eq. (3), summed over the segments by eq. (2); shape (6,) each, N and N·m."""

    mean: FloatArray
    exciting: FloatArray
    damping: FloatArray
    second_order: FloatArray


def mean_force(
    segments: Segments,
    speed: FloatArray,
    speed_variance: FloatArray,
    heading: float,
    air_density: float = DEFAULT_AIR_DENSITY,
) -> FloatArray:
    """Mean wind force on a platform at rest, the first term of eq. (3).

    Parameters
    ----------
    segments
        The areas, n of them.
    speed, speed_variance
        Mean and variance of the wind speed at the segments, shape (n,), m/s and m²/s².
    heading
        Direction toward which the wind blows, rad.
    air_density
        In kg/m³.

    Returns
    -------
    Force and moment about the reference point, shape (6,), N and N·m.
    """
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    drag = 0.5 * air_density * segments.area * segments.shape_coefficient
    local = drag * (np.asarray(speed) ** 2 + np.asarray(speed_variance))
    moment = local[:, None] * np.cross(segments.position, direction)
    return np.concatenate([np.sum(local) * direction, moment.sum(axis=0)])


class WindLoads:
    """Wind force on a moving platform as a function of time, from a turbulent wind field at its segments.

    Parameters
    ----------
    segments
        The areas; the field has its points at their positions.
    field
        Wind speed at the segments.
    heading
        Direction toward which the wind blows, rad.
    air_density
        In kg/m³.
    decomposition
        Name in `DECOMPOSITIONS`.

    Raises
    ------
    ScenarioError
        If the decomposition is not known.
    """

    def __init__(
        self,
        *,
        segments: Segments,
        field: SpeedField,
        heading: float,
        air_density: float,
        decomposition: str = "full",
    ) -> None:
        self.segments = segments
        self.field = field
        self.heading = heading
        self.air_density = air_density
        self._local_force = entry(DECOMPOSITIONS, decomposition, "decomposition of the wind force")
        self._drag = 0.5 * air_density * segments.area * segments.shape_coefficient
        self._area_share = segments.area / segments.area.sum()
        self._mean_wind_speed = float(self._area_share @ field.speed)
        self._cosine, self._sine = math.cos(heading), math.sin(heading)

    def _at(self, time: float, velocity: FloatArray, yaw: float) -> tuple[LocalWind, FloatArray]:
        transformation, along = _transformation(self.segments.position, self._cosine, self._sine, velocity, yaw)
        wind = LocalWind(
            drag=self._drag,
            mean=self.field.speed,
            variance=self.field.sampled_variance,
            fluctuation=self.field.fluctuation(time),
            along=along,
        )
        return wind, transformation

    def evaluate(self, time: float, velocity: FloatArray, yaw: float) -> FloatArray:
        """Force and moment about the reference point at `time`, shape (6,), N and N·m.

        Parameters
        ----------
        time
            In s, >= 0.
        velocity
            Rates of surge, sway, heave, roll, pitch, yaw, shape (6,), contiguous, m/s and rad/s.
        yaw
            In rad.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        wind, transformation = self._at(time, velocity, yaw)
        return np.asarray(self._local_force(wind) @ transformation)

    def parts(self, time: float, velocity: FloatArray, yaw: float) -> WindForceParts:
        """Terms of the expansion of eq. (3); parameters as of `evaluate`.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        wind, transformation = self._at(time, velocity, yaw)
        mean, exciting, damping, second_order = _terms(wind) @ transformation
        return WindForceParts(mean=mean, exciting=exciting, damping=damping, second_order=second_order)

    def damping_matrix(self, yaw: float = 0.0) -> FloatArray:
        """Aerodynamic damping sum 2 D U T T^T of Fig. 2, shape (6, 6), N·s/m, N·s, N·m·s; `yaw` in rad."""
        transformation, _ = _transformation(self.segments.position, self._cosine, self._sine, np.zeros(6), yaw)
        return np.asarray(transformation.T @ ((2.0 * self._drag * self.field.speed)[:, None] * transformation))

    def wind_speed(self, time: float) -> float:
        """Area-weighted mean over the segments of the wind speed at `time`, m/s; with an admittance, of what acts."""
        return self._mean_wind_speed + float(self._area_share @ self.field.fluctuation(time))

    def mean_force(self) -> FloatArray:
        """Mean force on a platform at rest, with the variance that the samples hold, shape (6,), N and N·m."""
        return mean_force(self.segments, self.field.speed, self.field.sampled_variance, self.heading, self.air_density)

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""
        return self.field.get_state()

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of wind loads with the same parameters."""
        self.field.set_state(state)


def wind_loads(
    *,
    heading: float,
    profile: Profile,
    gusts: Gusts | None = None,
    air_density: float = DEFAULT_AIR_DENSITY,
    segments: Segments | None = None,
    decomposition: str = "full",
) -> WindLoads:
    """Wind loads from the parameters of the wind.

    Parameters
    ----------
    heading
        Direction toward which the wind blows, rad.
    profile
        Mean wind; a speed of zero is still air, which damps the platform's motion by eq. (1) and nothing else.
    gusts
        Turbulence; that of `Gusts()` if None.
    air_density
        In kg/m³.
    segments
        The areas; `default_segments(heading)` if None.
    decomposition
        Name in `DECOMPOSITIONS`.

    Raises
    ------
    ScenarioError
        If a parameter is out of range or a name is not known.
    SolverError
        If the digital filter cannot be fitted.

    Warns
    -----
    FilterFitWarning
        If the filter misses the spectra by more than the limits of its certificate.
    """
    require_positive("air density", air_density, "kg/m³")
    if not np.isfinite(heading):
        raise ScenarioError(f"wind heading is {heading} rad; it must be finite")
    areas = default_segments(heading) if segments is None else segments
    field = wind_field(
        position=areas.position,
        area=areas.area,
        heading=heading,
        profile=profile,
        gusts=Gusts() if gusts is None else gusts,
    )
    return WindLoads(segments=areas, field=field, heading=heading, air_density=air_density, decomposition=decomposition)
