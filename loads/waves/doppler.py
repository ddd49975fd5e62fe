"""Waves on a current: wavenumber, and a sea whose waves ride on it.

    (omega - k U)² = g k tanh(k d)                                                                   (1)
    U_k = int_-d^0 U(z) 2k cosh 2k(z+d) / sinh 2kd dz                                                (2)
    sigma = omega - k U                                                                              (3)

omega is the frequency at a fixed place, at which the amplitudes of a sea turn, and U the current along the wave. The
frequency sigma is that seen by the water which the current carries: pressure, velocity and acceleration of the water
are those of a wave of frequency sigma and wavenumber k in still water (Peregrine 1976). A current with a profile acts
on a wave by its mean over the depth that the wave reaches, eq. (2) (Kirby and Chen 1989; Stewart and Joy 1974 in deep
water), correct to the first order in U over the wave's speed. Against the wave, eq. (1) has a root only while the
group still advances, d sigma / dk > -U; in deep water while U > -g / (4 omega). The spectrum is that of the waves as
measured on the current.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.current import Current, current_velocity
from tlpsim.loads.waves.sea import Sea

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ITERATIONS = 60
_TOLERANCE = 1e-13
_PROFILE_POINTS = 32
_DEEP = 300.0  # 2 k d beyond which sinh overflows and the bottom does not matter
_SMALLEST_GROUP_SPEED = 1e-6  # of a wave that the current does not stop, relative to its phase speed


def _group_speed(number: FloatArray, depth: float, gravity: float) -> FloatArray:
    """Group speed in still water, m/s, of waves of wavenumber `number` > 0."""
    if np.isinf(depth):
        return np.asarray(0.5 * np.sqrt(gravity / number))
    kd = number * depth
    tanh = np.tanh(kd)
    # 2 kd / sinh 2kd by tanh, which does not overflow: (1 - tanh²) kd / tanh.
    return np.asarray(0.5 * np.sqrt(gravity * tanh / number) * (1.0 + kd * (1.0 - tanh**2) / tanh))


def wavenumber_in_current(
    angular_frequency: ArrayLike, depth: float, current_along: ArrayLike, gravity: float = STANDARD_GRAVITY
) -> FloatArray:
    """Wavenumber k in rad/m of waves on a current, the smallest root of eq. (1), by Newton's method.

    Parameters
    ----------
    angular_frequency
        omega of eq. (1), at a fixed place, rad/s, > 0, shape (N,) or scalar.
    depth
        In m; infinity for deep water.
    current_along
        Speed of the current along the wave, negative against it, shape (N,) or scalar, m/s.
    gravity
        In m/s².

    Raises
    ------
    ScenarioError
        If the current stops a wave, or an argument is out of range.
    SolverError
        If the iteration does not converge.
    """
    still = wavenumber(angular_frequency, depth, gravity)
    omega, speed = np.broadcast_arrays(np.asarray(angular_frequency, dtype=np.float64), current_along)
    if not np.all(np.isfinite(speed)):
        raise ScenarioError("current along the waves is not finite; give it in m/s")
    discriminant = 1.0 + 4.0 * omega * speed / gravity
    _require_passage(discriminant > 0.0, omega, speed)
    # sqrt(g k tanh kd) + kU is concave in k, so that Newton's method from below its root never leaves that side. Two
    # lower bounds: the root of deep water (rounded down), and that of the longest waves' speed.
    k = 4.0 * omega**2 / gravity / (1.0 + np.sqrt(discriminant)) ** 2
    if np.isfinite(depth):
        longest = np.sqrt(gravity * depth) + speed
        _require_passage(longest > 0.0, omega, speed)
        k = np.maximum(k, omega / longest)
    k = np.where(speed == 0.0, still, k)
    for _ in range(_ITERATIONS):
        tanh = np.tanh(k * depth) if np.isfinite(depth) else 1.0
        slope = _group_speed(k, depth, gravity) + speed
        _require_passage(slope > _SMALLEST_GROUP_SPEED * omega / k, omega, speed)
        step = (omega - k * speed - np.sqrt(gravity * k * tanh)) / slope
        k = k + step
        if np.all(np.abs(step) <= _TOLERANCE * k * (1.0 + omega / (k * slope))):
            return np.asarray(k)
    raise SolverError(f"dispersion relation in a current did not converge in {_ITERATIONS} steps at depth {depth} m")


def _require_passage(passes: NDArray[np.bool_], omega: FloatArray, speed: FloatArray) -> None:
    if not np.all(passes):
        worst = int(np.argmin(np.where(passes, np.inf, omega).ravel()))
        raise ScenarioError(
            f"a current of {float(speed.ravel()[worst]):.4g} m/s along the waves stops those of "
            f"{float(omega.ravel()[worst]) / (2.0 * np.pi):.4g} Hz and above; lower the highest wave frequency below "
            "that, or leave out the current's effect on the waves"
        )


def current_along_waves(current: Current, wavenumbers: FloatArray, heading: FloatArray, depth: float) -> FloatArray:
    """Speed U_k of a current that acts on waves, eq. (2), along them.

    Parameters
    ----------
    wavenumbers, heading
        Shape (N,), rad/m and rad.
    depth
        In m; may be infinite.

    Returns
    -------
    Shape (N,), m/s.
    """
    nodes, shares = np.polynomial.legendre.leggauss(_PROFILE_POINTS)
    quantile = 0.5 * (nodes[:, None] + 1.0)
    # The heights below which a share q of the weight of eq. (2) lies: sinh 2k(z+d) = q sinh 2kd.
    twice = 2.0 * wavenumbers
    bounded = np.minimum(twice * depth, _DEEP)
    height = np.where(
        twice * depth < _DEEP,
        (np.arcsinh(quantile * np.sinh(bounded)) - bounded) / twice,
        np.maximum(np.log(quantile) / twice, -depth),
    )
    velocity = current_velocity(current, np.clip(height, -depth, 0.0).ravel())[:, :2].reshape(*height.shape, 2)
    mean = np.einsum("q,qnd->nd", 0.5 * shares, velocity)
    return np.asarray(mean[:, 0] * np.cos(heading) + mean[:, 1] * np.sin(heading))


@dataclass(frozen=True, slots=True, kw_only=True)
class SeaInCurrent:
    """A sea whose waves ride on a current; a `tlpsim.loads.waves.sea.Sea`.

    Its amplitudes turn at omega, while `angular_frequency` is sigma of eq. (3), with which the transfer functions of
    the water hold; i sigma times a velocity is the acceleration of the water that the current carries along, and not
    its rate at a fixed place.

    Parameters
    ----------
    sea
        The sea as it is measured at a fixed place.
    angular_frequency
        sigma, shape (N,), rad/s.
    wavenumber
        Shape (N,), rad/m.
    """

    sea: Sea
    angular_frequency: FloatArray
    wavenumber: FloatArray

    @property
    def heading(self) -> FloatArray:
        """Directions of propagation, shape (N,), rad."""
        return self.sea.heading

    @property
    def water_depth(self) -> float:
        """In m; may be infinite."""
        return self.sea.water_depth

    @property
    def gravity(self) -> float:
        """In m/s²."""
        return self.sea.gravity

    def amplitudes(self, time: float) -> ComplexArray:
        """Complex amplitudes at `time` (s), shape (N,), m."""
        return self.sea.amplitudes(time)


def sea_in_current(sea: Sea, current: Current) -> SeaInCurrent:
    """The waves of `sea`, on a current, eqs. (1) to (3).

    Raises
    ------
    ScenarioError
        If the current stops a wave.
    """
    omega = sea.angular_frequency
    along = current_along_waves(current, sea.wavenumber, sea.heading, sea.water_depth)
    number = wavenumber_in_current(omega, sea.water_depth, along, sea.gravity) if len(omega) else sea.wavenumber
    return SeaInCurrent(sea=sea, angular_frequency=omega - number * along, wavenumber=number)


def delay_ratio(
    current: Current, highest_frequency: float, heading: float, depth: float, gravity: float = STANDARD_GRAVITY
) -> float:
    """How much longer a group of the highest waves takes over a distance on the current than in still water.

    The `reach` of a sea by digital filters (`tlpsim.loads.waves.elevation`) must be larger by this factor.

    Parameters
    ----------
    highest_frequency
        In Hz.
    heading
        Of the waves, rad.
    depth, gravity
        In m and m/s².

    Raises
    ------
    ScenarioError
        If the current stops those waves.
    """
    omega = np.array([2.0 * np.pi * highest_frequency])
    still = wavenumber(omega, depth, gravity)
    along = current_along_waves(current, still, np.array([heading]), depth)
    number = wavenumber_in_current(omega, depth, along, gravity)
    ratio = _group_speed(still, depth, gravity) / (_group_speed(number, depth, gravity) + along)
    return float(ratio[0])
