"""Wind forces on a platform: eq. (1) and (2), and the mean of Fig. 2, of Li and Kareem (1990).

    f_m = 0.5 rho A_m C_m (U_m + u_m - v_m) |U_m + u_m - v_m|                                        (1)
    F = sum_m T_m f_m,   T_m = [d; r_m x d]                                                          (2)
    E[F] = sum_m T_m 0.5 rho A_m C_m (U_m² + sigma_m²)                                               (3)

d is the unit vector of the wind, r_m the position of a segment relative to the platform's reference point, turned
with the platform's yaw, and v_m the velocity of that point along the wind from all six rates. The sign in eq. (1),
where the paper has a square, matters only when the wind reverses.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.arma import ProcessState
from tlpsim.loads.wind.field import WindField, wind_field
from tlpsim.loads.wind.profile import require_positive

FloatArray = NDArray[np.float64]

DEFAULT_AIR_DENSITY = 1.225


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Parts of the platform above water on which the wind acts.

    Parameters
    ----------
    position
        Centroids relative to the reference point at zero yaw, shape (n, 3), m; z is the height above mean water
        level.
    area
        Projected areas, shape (n,), m².
    shape_coefficient
        C, shape (n,).

    Raises
    ------
    ScenarioError
        If shapes do not fit, or a height, an area or a coefficient is not positive.
    """

    position: FloatArray
    area: FloatArray
    shape_coefficient: FloatArray

    def __post_init__(self) -> None:
        for name in ("position", "area", "shape_coefficient"):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        count = len(self.area)
        if count == 0 or self.position.shape != (count, 3) or self.shape_coefficient.shape != (count,):
            raise ScenarioError(
                f"wind segments: position {self.position.shape}, area {self.area.shape} and shape coefficient "
                f"{self.shape_coefficient.shape} must have the shapes (n, 3), (n,), (n,) with n >= 1"
            )
        if not np.all(np.isfinite(self.position)):
            raise ScenarioError("wind segments: a position is not finite")
        require_positive("height of a wind segment", self.position[:, 2], "m")
        require_positive("area of a wind segment", self.area, "m²")
        require_positive("shape coefficient of a wind segment", self.shape_coefficient, "")


def default_segments(heading: float) -> Segments:
    """Six equal segments for a large platform: 3000 m² in all, C = 1.2, at heights of 30 and 50 m.

    They stand across the wind at -30, 0 and 30 m from a centre that lies 12 m off the platform's, to the right of
    the wind, so that the mean wind turns the platform (positive yaw). `heading` is the wind's, rad.
    """
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    offsets = np.array([-30.0, 0.0, 30.0]) - 12.0
    position = np.vstack([offsets[:, None] * across + np.array([0.0, 0.0, height]) for height in (30.0, 50.0)])
    return Segments(position=position, area=np.full(6, 500.0), shape_coefficient=np.full(6, 1.2))


def mean_force(
    segments: Segments,
    speed: FloatArray,
    speed_variance: FloatArray,
    heading: float,
    air_density: float = DEFAULT_AIR_DENSITY,
) -> FloatArray:
    """Mean wind force on a platform at rest, eq. (3).

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


@njit(cache=True)
def _segment_forces(
    mean_speed: FloatArray,
    fluctuation: FloatArray,
    drag: FloatArray,
    position: FloatArray,
    cosine: float,
    sine: float,
    velocity: FloatArray,
    yaw: float,
) -> FloatArray:
    """Eq. (1) and (2); `drag` is 0.5 rho A C, `cosine` and `sine` are those of the wind's heading."""
    force = np.zeros(6)
    yaw_cosine, yaw_sine = math.cos(yaw), math.sin(yaw)
    # Angular velocity from the rates of roll, pitch and yaw; the tilt of the deck itself is neglected.
    rate_x = yaw_cosine * velocity[3] - yaw_sine * velocity[4]
    rate_y = yaw_sine * velocity[3] + yaw_cosine * velocity[4]
    rate_z = velocity[5]
    for m in range(len(drag)):
        x = yaw_cosine * position[m, 0] - yaw_sine * position[m, 1]
        y = yaw_sine * position[m, 0] + yaw_cosine * position[m, 1]
        z = position[m, 2]
        arm_x, arm_y, arm_z = -z * sine, z * cosine, x * sine - y * cosine
        along = velocity[0] * cosine + velocity[1] * sine + rate_x * arm_x + rate_y * arm_y + rate_z * arm_z
        relative = mean_speed[m] + fluctuation[m] - along
        local = drag[m] * relative * abs(relative)
        force[0] += local * cosine
        force[1] += local * sine
        force[3] += local * arm_x
        force[4] += local * arm_y
        force[5] += local * arm_z
    return force


class WindLoads:
    """Wind force on a moving platform as a function of time, from a turbulent wind field at its segments.

    Parameters
    ----------
    segments
        The areas; the field has its points at their positions.
    field
        Wind speed fluctuations at the segments.
    heading
        Direction toward which the wind blows, rad.
    air_density
        In kg/m³.
    """

    def __init__(self, *, segments: Segments, field: WindField, heading: float, air_density: float) -> None:
        self.segments = segments
        self.field = field
        self.heading = heading
        self.air_density = air_density
        self._drag = 0.5 * air_density * segments.area * segments.shape_coefficient
        self._area_share = segments.area / segments.area.sum()
        self._mean_wind_speed = float(self._area_share @ field.points.speed)
        self._cosine, self._sine = math.cos(heading), math.sin(heading)

    def evaluate(self, time: float, velocity: FloatArray, yaw: float) -> FloatArray:
        """Force and moment about the reference point at `time`, shape (6,), N and N·m, eq. (1) and (2).

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
        result: FloatArray = _segment_forces(
            self.field.points.speed,
            self.field.fluctuation(time),
            self._drag,
            self.segments.position,
            self._cosine,
            self._sine,
            velocity,
            yaw,
        )
        return result

    def wind_speed(self, time: float) -> float:
        """Area-weighted mean over the segments of the wind speed at `time`, m/s."""
        return self._mean_wind_speed + float(self._area_share @ self.field.fluctuation(time))

    def mean_force(self) -> FloatArray:
        """Mean force on a platform at rest, eq. (3), with the variance that the samples hold, shape (6,)."""
        return mean_force(
            self.segments,
            self.field.points.speed,
            self.field.sampled_variance,
            self.heading,
            self.air_density,
        )

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""
        return self.field.get_state()

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of wind loads with the same parameters."""
        self.field.set_state(state)


def wind_loads(
    *,
    speed_10: float,
    heading: float,
    spectrum: str = "kaimal",
    roughness_length: float = 0.005,
    lateral_coherence: float = 16.0,
    vertical_coherence: float = 10.0,
    air_density: float = DEFAULT_AIR_DENSITY,
    segments: Segments | None = None,
    sampling_step: float = 1.0,
    order: int = 25,
    seed: int = 0,
) -> WindLoads:
    """Wind loads from the parameters of the wind; see `wind_field` and `default_segments`.

    Parameters
    ----------
    speed_10
        Mean wind speed at 10 m, m/s.
    heading
        Direction toward which the wind blows, rad.
    segments
        The areas; `default_segments(heading)` if None.
    air_density
        In kg/m³.

    Raises
    ------
    ScenarioError
        If a parameter is out of range or the spectrum is not known.
    SolverError
        If the autoregressive model cannot be fitted.
    """
    require_positive("air density", air_density, "kg/m³")
    if not np.isfinite(heading):
        raise ScenarioError(f"wind heading is {heading} rad; it must be finite")
    areas = default_segments(heading) if segments is None else segments
    field = wind_field(
        position=areas.position,
        heading=heading,
        speed_10=speed_10,
        roughness_length=roughness_length,
        spectrum=spectrum,
        lateral_coherence=lateral_coherence,
        vertical_coherence=vertical_coherence,
        sampling_step=sampling_step,
        order=order,
        seed=seed,
    )
    return WindLoads(segments=areas, field=field, heading=heading, air_density=air_density)
