"""Position and acceleration of points that are fixed in the platform, such as the deck or a fairlead.

    x_p = x + R p                                                                                           (1)
    a_p = x'' + alpha × R p + omega × (omega × R p),  omega = E (roll', pitch', yaw'),  alpha = omega'      (2)

Exact at any pose. The acceleration is that of the motion, in earth axes; what an accelerometer on board feels is
R^T (a_p + g e_z) in body axes.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.platform.state import PlatformState

FloatArray = NDArray[np.float64]


def point_motion(points: FloatArray, state: PlatformState) -> tuple[FloatArray, FloatArray]:
    """Positions and accelerations of points of the platform.

    Parameters
    ----------
    points : (n, 3) m, from the reference point, fixed in the body.
    state : of the platform.

    Returns
    -------
    positions : (n, 3) m, earth-fixed.
    accelerations : (n, 3) m/s², earth-fixed, without gravity.
    """
    positions, accelerations = np.empty((len(points), 3)), np.empty((len(points), 3))
    move_points(points, state.position, state.velocity, state.acceleration, positions, accelerations)
    return positions, accelerations


@njit(cache=True)
def move_points(points, pose, velocity, acceleration, positions, accelerations):  # type: ignore[no-untyped-def]
    """Eqs. (1) and (2) of `points` (n, 3) -> `positions`, `accelerations` (n, 3)."""
    sr, sp, sy = math.sin(pose[3]), math.sin(pose[4]), math.sin(pose[5])
    cr, cp, cy = math.cos(pose[3]), math.cos(pose[4]), math.cos(pose[5])
    roll, pitch, yaw = velocity[3], velocity[4], velocity[5]
    # Axes of roll (cy cp, sy cp, -sp), of pitch (-sy, cy, 0) and of yaw (0, 0, 1), and how the first two turn.
    ox, oy, oz = cy * cp * roll - sy * pitch, sy * cp * roll + cy * pitch, yaw - sp * roll
    roll2, pitch2, yaw2 = acceleration[3], acceleration[4], acceleration[5]
    ax = cy * cp * roll2 - sy * pitch2 - (sy * cp * yaw + cy * sp * pitch) * roll - cy * yaw * pitch
    ay = sy * cp * roll2 + cy * pitch2 + (cy * cp * yaw - sy * sp * pitch) * roll - sy * yaw * pitch
    az = yaw2 - sp * roll2 - cp * pitch * roll
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        rx = cy * cp * px + (cy * sp * sr - sy * cr) * py + (cy * sp * cr + sy * sr) * pz
        ry = sy * cp * px + (sy * sp * sr + cy * cr) * py + (sy * sp * cr - cy * sr) * pz
        rz = -sp * px + cp * sr * py + cp * cr * pz
        ux, uy, uz = oy * rz - oz * ry, oz * rx - ox * rz, ox * ry - oy * rx
        positions[i, 0], positions[i, 1], positions[i, 2] = pose[0] + rx, pose[1] + ry, pose[2] + rz
        accelerations[i, 0] = acceleration[0] + ay * rz - az * ry + oy * uz - oz * uy
        accelerations[i, 1] = acceleration[1] + az * rx - ax * rz + oz * ux - ox * uz
        accelerations[i, 2] = acceleration[2] + ax * ry - ay * rx + ox * uy - oy * ux
