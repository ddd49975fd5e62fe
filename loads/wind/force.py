"""Wind forces on a platform: eq. (1) and (2), and the expansion of Fig. 2, of Li and Kareem (1990).

    f_m = D_m (U_m + u_m - v_m) |U_m + u_m - v_m|,   D_m = 0.5 rho A_m C_m                           (1)
    F = sum_m T_m f_m,   T_m = [d; r_m x d],   v_m = T_m^T X'                                        (2)

d is the unit vector of the wind, r_m the position of a segment relative to the platform's reference point, turned
with the platform's yaw, and v_m the velocity of that point along the wind from all six rates. The area A_m is that at
the platform's yaw, eq. (2) of `tlpsim.loads.wind.segments`. The sign in eq. (1), where the paper has a square,
matters only when the wind reverses. Without it eq. (1) is the sum of

    mean            D_m (U_m² + sigma_m²)                                                            (3)
    exciting        2 D_m U_m u_m
    damping         -2 D_m U_m v_m
    second order    D_m (u_m² - sigma_m²)

and of D_m (v_m² - 2 u_m v_m), which Fig. 2 leaves out. The wind itself, its coherence and its admittance, is that at
the segments at zero yaw.
"""

import math
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


DECOMPOSITIONS: dict[str, tuple[float, ...]] = {
    "full": (),
    "expanded": (1.0, 1.0, 1.0, 1.0),
    "linear": (1.0, 1.0, 1.0, 0.0),
}
"""Weights of the terms of eq. (3): none for eq. (1) itself, all four, and the first three, as the paper keeps them."""
_MEAN = (1.0, 0.0, 0.0, 0.0)


@njit(cache=True)
def _turned(
    position: FloatArray, plan: FloatArray, cosine: float, sine: float, velocity: FloatArray, yaw: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """T_m^T (n, 6) and v_m (n,) of eq. (2), and areas over those at zero yaw (n,); `cosine`, `sine` of the heading."""
    count = len(position)
    transformation = np.empty((count, 6))
    along = np.empty(count)
    shown = np.ones(count)
    yaw_cosine, yaw_sine = math.cos(yaw), math.sin(yaw)
    across = abs(sine * yaw_cosine - cosine * yaw_sine)
    facing = abs(cosine * yaw_cosine + sine * yaw_sine)
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
        breadth = plan[m, 0] * abs(sine) + plan[m, 1] * abs(cosine)
        if breadth > 0.0:
            shown[m] = (plan[m, 0] * across + plan[m, 1] * facing) / breadth
        transformation[m, 0] = cosine
        transformation[m, 1] = sine
        transformation[m, 2] = 0.0
        transformation[m, 3] = arm_x
        transformation[m, 4] = arm_y
        transformation[m, 5] = arm_z
    return transformation, along, shown


@njit(cache=True)
def _wind_force(wind, fluctuation, velocity, yaw, force):  # type: ignore[no-untyped-def]
    """Eqs. (1) to (3) into `force` (6,), N and N·m; `wind` as of `_kernel_arrays`, `fluctuation` (n,) m/s."""
    position, plan, drag, mean, variance, heading, weights = wind
    transformation, along, shown = _turned(position, plan, heading[0], heading[1], velocity, yaw)
    force[:] = 0.0
    for m in range(len(drag)):
        gust, speed = fluctuation[m], mean[m]
        if len(weights) == 0:
            relative = speed + gust - along[m]
            local = relative * abs(relative)
        else:
            local = weights[0] * (speed * speed + variance[m]) + weights[3] * (gust * gust - variance[m])
            local += 2.0 * speed * (weights[1] * gust - weights[2] * along[m])
        for i in range(6):
            force[i] += drag[m] * shown[m] * local * transformation[m, i]


def _kernel_arrays(
    segments: Segments,
    speed: FloatArray,
    speed_variance: FloatArray,
    heading: float,
    air_density: float,
    weights: tuple[float, ...],
) -> tuple[FloatArray, ...]:
    """What `_wind_force` reads, all of it writable, so that it is compiled once."""
    drag = 0.5 * air_density * segments.area * segments.shape_coefficient
    direction = math.cos(heading), math.sin(heading)
    arrays = segments.position, segments.plan, drag, speed, speed_variance, direction, weights
    return tuple(np.array(array, dtype=np.float64) for array in arrays)


def turned_segments(segments: Segments, heading: float, yaw: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Geometry of eq. (2) at a yaw of the platform.

    Parameters
    ----------
    segments
        The areas, n of them.
    heading, yaw
        Of the wind and of the platform, rad.

    Returns
    -------
    T_m^T, shape (n, 6); areas over those at zero yaw, shape (n,); and the speed v_m of the segments along the wind a
    unit rate of each degree of freedom, shape (n, 6).
    """
    direction = math.cos(heading), math.sin(heading)
    position, plan = np.array(segments.position), np.array(segments.plan)
    units = [_turned(position, plan, *direction, unit, yaw) for unit in np.eye(6)]
    return units[0][0], units[0][2], np.column_stack([along for _, along, _ in units])


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
    yaw: float = 0.0,
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
    yaw
        At which the platform rests, rad.

    Returns
    -------
    Force and moment about the reference point, shape (6,), N and N·m.
    """
    force = np.empty(6)
    wind = _kernel_arrays(segments, speed, speed_variance, heading, air_density, _MEAN)
    _wind_force(wind, np.zeros(len(segments.area)), np.zeros(6), yaw, force)
    return force


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

    Attributes
    ----------
    arrays
        What the kernel reads (derived).

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
        weights = entry(DECOMPOSITIONS, decomposition, "decomposition of the wind force")
        self.arrays = _kernel_arrays(segments, field.speed, field.sampled_variance, heading, air_density, weights)
        self._area_share = segments.area / segments.area.sum()
        self._mean_wind_speed = float(self._area_share @ field.speed)

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
        force = np.empty(6)
        _wind_force(self.arrays, self.field.fluctuation(time), velocity, yaw, force)
        return force

    def parts(self, time: float, velocity: FloatArray, yaw: float) -> WindForceParts:
        """Terms of the expansion of eq. (3); parameters as of `evaluate`.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        fluctuation, forces = self.field.fluctuation(time), np.empty((4, 6))
        for term, force in zip(np.eye(4), forces, strict=True):
            _wind_force((*self.arrays[:-1], term), fluctuation, velocity, yaw, force)
        mean, exciting, damping, second_order = forces
        return WindForceParts(mean=mean, exciting=exciting, damping=damping, second_order=second_order)

    def damping_matrix(self, yaw: float = 0.0) -> FloatArray:
        """Aerodynamic damping sum 2 D U T T^T of Fig. 2, shape (6, 6), N·s/m, N·s, N·m·s; `yaw` in rad.

        It acts on the velocity of the reference point and the angular velocity of the platform, both in earth-fixed
        axes; at zero yaw they are the rates of the degrees of freedom.
        """
        position, plan, drag, speed, _, (cosine, sine), _ = self.arrays
        transformation, _, shown = _turned(position, plan, cosine, sine, np.zeros(6), yaw)
        return np.asarray(transformation.T @ ((2.0 * drag * shown * speed)[:, None] * transformation))

    def wind_speed(self, time: float) -> float:
        """Mean over the segments of the wind speed at `time`, m/s; with an admittance, of what acts.

        The weights are the areas at zero yaw.
        """
        return self._mean_wind_speed + float(self._area_share @ self.field.fluctuation(time))

    def mean_force(self, yaw: float = 0.0) -> FloatArray:
        """Mean force on a platform at rest at `yaw` (rad), with the variance of the samples, shape (6,), N and N·m."""
        speed, variance = self.field.speed, self.field.sampled_variance
        return mean_force(self.segments, speed, variance, self.heading, self.air_density, yaw)

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
