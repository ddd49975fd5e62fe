"""Compiled static loads of a platform at a pose, and their derivatives: weight, buoyancy and tendons.

    r(x) = -E^T (load of weight, buoyancy and tendons)                                                    (1)
    dr/dx_j = Im r(x + i s e_j) / s,   s = 1e-30                                                          (2)

The kernels repeat `hydrostatic_load`, `tendon_loads` and `generalized_force` as one loop without temporaries; tests
hold the two forms together. Eq. (2), a complex step, is exact: no difference is taken, so that no step is too small.
"""

import numpy as np
from numba import njit

_STEP = 1e-30


@njit(cache=True)
def restoring(pose, hydrostatics, lines):  # type: ignore[no-untyped-def]
    """Restoring force (6,) and tensions at the tops (n,) at a real or complex pose (6,); see `PlatformModel.arrays`."""
    sr, sp, sy = np.sin(pose[3]), np.sin(pose[4]), np.sin(pose[5])
    cr, cp, cy = np.cos(pose[3]), np.cos(pose[4]), np.cos(pose[5])
    xx, xy, xz = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    yx, yy, yz = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    zx, zy, zz = -sp, cp * sr, cp * cr
    weight, buoyancy = hydrostatics[0], hydrostatics[1]
    heave_stiffness, roll_stiffness, pitch_stiffness = hydrostatics[3], hydrostatics[4], hydrostatics[5]
    squares = heave_stiffness * pose[2] * pose[2] + pitch_stiffness * zx * zx + roll_stiffness * zy * zy
    bx = buoyancy * hydrostatics[9] - weight * hydrostatics[6] - pitch_stiffness * zx / zz
    by = buoyancy * hydrostatics[10] - weight * hydrostatics[7] - roll_stiffness * zy / zz
    bz = buoyancy * hydrostatics[11] - weight * hydrostatics[8] + 0.5 * squares / (zz * zz)
    force = np.zeros(3, dtype=pose.dtype)
    moment = np.zeros(3, dtype=pose.dtype)
    force[2] = buoyancy - weight - heave_stiffness * pose[2] / zz
    moment[0] = yx * bx + yy * by + yz * bz
    moment[1] = -(xx * bx + xy * by + xz * bz)
    tops = np.zeros(lines.shape[0], dtype=pose.dtype)
    for i in range(lines.shape[0]):
        px, py, pz = lines[i, 0], lines[i, 1], lines[i, 2]
        rx, ry, rz = xx * px + xy * py + xz * pz, yx * px + yy * py + yz * pz, zx * px + zy * py + zz * pz
        dx, dy, dz = lines[i, 3] - pose[0] - rx, lines[i, 4] - pose[1] - ry, lines[i, 5] - pose[2] - rz
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        tension = lines[i, 6] * (length - lines[i, 7]) / lines[i, 7]
        if not tension.real > 0.0:
            tension = 0.0 * tension
        top = tension - lines[i, 8] * dz / length
        if top.real > 0.0:
            tops[i] = top
        pull = tension / length
        tx, ty, tz = pull * dx, pull * dy, pull * dz - lines[i, 8]
        force[0] += tx
        force[1] += ty
        force[2] += tz
        moment[0] += ry * tz - rz * ty
        moment[1] += rz * tx - rx * tz
        moment[2] += rx * ty - ry * tx
    total = np.empty(6, dtype=pose.dtype)
    total[:3] = -force
    total[3] = sp * moment[2] - cp * (cy * moment[0] + sy * moment[1])
    total[4] = sy * moment[0] - cy * moment[1]
    total[5] = -moment[2]
    return total, tops


@njit(cache=True)
def restoring_gradients(pose, hydrostatics, lines):  # type: ignore[no-untyped-def]
    """Derivatives of `restoring` by a real pose, eq. (2): of the force (6, 6) and of the tensions (n, 6)."""
    stiffness = np.empty((6, 6))
    slopes = np.empty((lines.shape[0], 6))
    for j in range(6):
        stepped = pose.astype(np.complex128)
        stepped[j] += 1j * _STEP
        total, tops = restoring(stepped, hydrostatics, lines)
        stiffness[:, j] = total.imag / _STEP
        slopes[:, j] = tops.imag / _STEP
    return stiffness, slopes
