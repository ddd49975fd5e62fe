"""The rigid body of the platform: inertia, weight, buoyancy, and the frames that its loads refer to.

Reference point: the platform's origin, on still water level at zero pose. A pose is (surge, sway, heave,
roll, pitch, yaw) with R = Rz(yaw) Ry(pitch) Rx(roll). Loads are earth-fixed forces and moments about the
moving reference point. The equations:

    mass matrix     M = [[m 1, -m S(c)], [m S(c), I_G + m (c.c 1 - c c^T)]] + A,    c = centre of gravity
    hydrostatics    weight -m g at R c, buoyancy rho g V at R b, and the change of buoyancy of a hull with walls along
                    the body's z axis, of energy 1/2 rho g int zeta² dA / R_zz with zeta = z + (R s)_z at the points s
                    of the waterplane at zero pose
    angle rates     omega = E (roll', pitch', yaw'), so that a moment m does the work (E^T m) . angles'

The energy is that of the displaced water, int rho g (-z) dV, in closed form: a filament dA of the hull is wet up to
-zeta/R_zz on the body's z axis. It is exact at any setdown, yaw and tilt as long as the water's surface cuts the walls
only. The hydrostatic load is its gradient, exactly and at any pose. Functions of a pose also take complex poses, so
that their derivatives follow to machine precision from a complex step.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads import rigid_body
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError


def fixed_array(values: ArrayLike, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """Read-only, contiguous copy of `values`.

    Parameters
    ----------
    shape : expected shape, -1 for any length.
    name : what the values are, for the error message.

    Raises
    ------
    ScenarioError
        When the shape differs or a value is not finite.
    """
    array = np.array(values, dtype=np.float64, order="C")
    if array.size == 0 and shape[0] in (-1, 0):
        array = array.reshape(0, *shape[1:])  # a list without entries does not say of which shape they would be
    fits = array.ndim == len(shape) and all(want in (-1, have) for want, have in zip(shape, array.shape, strict=True))
    if not fits:
        expected = str(shape).replace("-1", "n")
        raise ScenarioError(f"{name} has shape {array.shape}, expected {expected}: give one value for each entry")
    if not np.all(np.isfinite(array)):
        raise ScenarioError(f"{name} holds {array[~np.isfinite(array)][0]}, expected finite numbers")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """Rigid body afloat.

    Attributes
    ----------
    mass : kg, > 0.
    centre_of_gravity : (3,) m, from the reference point.
    inertia : (3, 3) kg·m², about the centre of gravity; symmetric, positive definite.
    added_mass : (6, 6) kg, kg·m, kg·m², about the reference point; symmetric.
    displaced_volume : m³, at zero pose.
    centre_of_buoyancy : (3,) m, from the reference point, at zero pose.
    waterplane_area : m², centred on the reference point.
    waterplane_moments : (2,) m⁴, second moments about the x axis (∫y²dA) and the y axis (∫x²dA).
    water_density : kg/m³.
    gravity : m/s².

    Raises
    ------
    ScenarioError
        For a wrong shape, a value out of range, or a mass matrix that is not positive definite.
    """

    mass: float
    centre_of_gravity: NDArray[np.float64]
    inertia: NDArray[np.float64]
    added_mass: NDArray[np.float64]
    displaced_volume: float
    centre_of_buoyancy: NDArray[np.float64]
    waterplane_area: float
    waterplane_moments: NDArray[np.float64]
    water_density: float = SEA_WATER_DENSITY
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for name, shape in (
            ("centre_of_gravity", (3,)),
            ("inertia", (3, 3)),
            ("added_mass", (6, 6)),
            ("centre_of_buoyancy", (3,)),
            ("waterplane_moments", (2,)),
        ):
            object.__setattr__(self, name, fixed_array(getattr(self, name), shape, f"body {name}"))
        for name in ("mass", "water_density", "gravity"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ScenarioError(f"body {name} is {getattr(self, name)}, expected a finite number > 0")
        for name in ("displaced_volume", "waterplane_area"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ScenarioError(f"body {name} is {getattr(self, name)}, expected a finite number >= 0")
        if np.any(self.waterplane_moments < 0.0):
            raise ScenarioError(f"body waterplane_moments are {self.waterplane_moments}, expected >= 0")
        for name in ("inertia", "added_mass"):
            matrix = getattr(self, name)
            asymmetry = float(np.abs(matrix - matrix.T).max())
            if asymmetry > 1e-9 * float(np.abs(matrix).max()):
                raise ScenarioError(
                    f"body {name} is not symmetric, largest asymmetry {asymmetry:.6g}: give (A + A^T)/2"
                )
        for name, matrix in (("inertia", self.inertia), ("mass matrix with added mass", mass_matrix(self))):
            lowest = float(np.linalg.eigvalsh(matrix)[0])
            if lowest <= 0.0:
                raise ScenarioError(
                    f"body {name} is not positive definite, its lowest eigenvalue is {lowest:.6g}: "
                    "check inertia, added_mass and centre_of_gravity"
                )


def mass_matrix(body: Body) -> NDArray[np.float64]:
    """Mass and added mass about the reference point at zero pose, (6, 6) kg, kg·m, kg·m²."""
    return rigid_body.mass_matrix(body.mass, body.centre_of_gravity, body.inertia) + body.added_mass


def rotation_matrix(angles: NDArray[Any]) -> NDArray[Any]:
    """Body axes to earth axes, R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3), from (roll, pitch, yaw) in rad."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def angular_velocity(pose: NDArray[np.float64], velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    """E (roll', pitch', yaw'), (3,) rad/s, earth-fixed, from pose and velocity (6,)."""
    (_, sp, sy), (_, cp, cy) = np.sin(pose[3:]), np.cos(pose[3:])
    roll, pitch, yaw = velocity[3:]
    return np.array([cy * cp * roll - sy * pitch, sy * cp * roll + cy * pitch, yaw - sp * roll])


def yaw_turn(yaw: float) -> NDArray[np.float64]:
    """P = diag(Rz(yaw), 1), (6, 6), from rates in axes that turn with yaw to those of the pose; yaw in rad."""
    turn = np.eye(6)
    turn[:3, :3] = rotation_matrix(np.array([0.0, 0.0, yaw]))
    return turn


def turned_matrix(matrix: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """Matrix of rates in axes that turn with yaw to that of the rates of the pose, P M P^T, P = diag(Rz(yaw), 1).

    The rates of roll and pitch refer to turned axes as they are.

    Parameters
    ----------
    matrix : (6, 6).
    yaw : rad.
    """
    turn = yaw_turn(yaw)
    return turn @ matrix @ turn.T


def generalized_force(load: NDArray[Any], pose: NDArray[Any]) -> NDArray[Any]:
    """Load that does work on the rates of the pose, (6,): forces as they are, moments E^T m.

    The columns of E are the axes that roll, pitch and yaw turn about: Rz Ry e_x, Rz e_y and e_z.

    Parameters
    ----------
    load : (6,) N, N·m, earth-fixed, about the reference point.
    pose : (6,) m, rad.
    """
    (_, sp, sy), (_, cp, cy) = np.sin(pose[3:]), np.cos(pose[3:])
    x, y, z = load[3:]
    about_axes = np.array([cp * (cy * x + sy * y) - sp * z, cy * y - sy * x, z])
    return np.concatenate((load[:3], about_axes))


def generalized_force_slope(load: NDArray[np.float64], pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Change of `generalized_force` of a constant load with the pose, (6, 6) N·m/rad in its columns of the angles."""
    (_, sp, sy), (_, cp, cy) = np.sin(pose[3:]), np.cos(pose[3:])
    x, y, z = load[3:]
    result = np.zeros((6, 6))
    result[3, 4] = -sp * (cy * x + sy * y) - cp * z
    result[3, 5] = cp * (cy * y - sy * x)
    result[4, 5] = -sy * y - cy * x
    return result


def _surface_squares(body: Body, pose: NDArray[Any], turn: NDArray[Any]) -> Any:
    """int zeta² dA over the waterplane, m⁴."""
    about_x, about_y = body.waterplane_moments
    return body.waterplane_area * pose[2] ** 2 + about_y * turn[2, 0] ** 2 + about_x * turn[2, 1] ** 2


def hydrostatic_load(body: Body, pose: NDArray[Any]) -> NDArray[Any]:
    """Weight and buoyancy, (6,) N, N·m, earth-fixed, about the reference point, at `pose` (6,) m, rad."""
    turn = rotation_matrix(pose[3:])
    specific_weight = body.water_density * body.gravity
    weight, buoyancy = body.mass * body.gravity, specific_weight * body.displaced_volume
    arm = buoyancy * (turn @ body.centre_of_buoyancy) - weight * (turn @ body.centre_of_gravity)
    about_x, about_y = body.waterplane_moments
    upright, heave_stiffness = turn[2, 2], specific_weight * body.waterplane_area
    tilt = specific_weight * (about_y * turn[2, 0] * turn[:, 0] + about_x * turn[2, 1] * turn[:, 1]) / upright
    tilt = tilt - specific_weight * _surface_squares(body, pose, turn) / (2.0 * upright**2) * turn[:, 2]
    vertical = buoyancy - weight - heave_stiffness * pose[2] / upright
    return np.array([0.0, 0.0, vertical, arm[1] - tilt[1], tilt[0] - arm[0], 0.0])


def hydrostatic_energy(body: Body, pose: NDArray[Any]) -> Any:
    """Potential energy of weight and buoyancy, J, zero at zero pose for centres on the still water level."""
    turn = rotation_matrix(pose[3:])
    specific_weight = body.water_density * body.gravity
    rise_of_gravity = pose[2] + turn[2] @ body.centre_of_gravity
    rise_of_buoyancy = pose[2] + turn[2] @ body.centre_of_buoyancy
    return (
        body.mass * body.gravity * rise_of_gravity
        - specific_weight * body.displaced_volume * rise_of_buoyancy
        + 0.5 * specific_weight * _surface_squares(body, pose, turn) / turn[2, 2]
    )
