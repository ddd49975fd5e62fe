"""The compiled integrator of the platform's motion; equations in motion.py.

The kernels repeat hydrostatic_load, tendon_loads, tendon_drag, generalized_force and inertia_force as one loop without
temporaries, two orders of magnitude faster; tests hold the two forms together. They stand in one file because the cache
of a jitted function sees changes in its own file only.
"""

import math

import numpy as np
from numba import njit

from tlpsim.loads.platform.tendons import POINTS, WEIGHTS

LARGEST_ITERATION = 30
NOT_FINITE, NOT_CONVERGED = -1, -2


@njit(cache=True)
def generalized_load(  # type: ignore[no-untyped-def]
    pose, velocity, external, hydrostatics, lines, intact, total, tensions, bottom_tensions
):
    """External load, tendons and drag minus restoring on the rates of the pose -> `total` (6,); tensions (n,)."""
    sr, sp, sy = math.sin(pose[3]), math.sin(pose[4]), math.sin(pose[5])
    cr, cp, cy = math.cos(pose[3]), math.cos(pose[4]), math.cos(pose[5])
    xx, xy, xz = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    yx, yy, yz = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    zx, zy, zz = -sp, cp * sr, cp * cr
    weight, buoyancy = hydrostatics[0], hydrostatics[1]
    heave_stiffness, roll_stiffness, pitch_stiffness = hydrostatics[3], hydrostatics[4], hydrostatics[5]
    bx = buoyancy * hydrostatics[9] - weight * hydrostatics[6]
    by = buoyancy * hydrostatics[10] - weight * hydrostatics[7]
    bz = buoyancy * hydrostatics[11] - weight * hydrostatics[8]
    squares = heave_stiffness * pose[2] * pose[2] + pitch_stiffness * zx * zx + roll_stiffness * zy * zy
    about_x, about_y = pitch_stiffness * zx / zz, roll_stiffness * zy / zz
    about_z = -0.5 * squares / (zz * zz)
    arm_x = xx * (bx - about_x) + xy * (by - about_y) + xz * (bz - about_z)
    arm_y = yx * (bx - about_x) + yy * (by - about_y) + yz * (bz - about_z)
    fx, fy, fz = external[0], external[1], external[2] + buoyancy - weight - heave_stiffness * pose[2] / zz
    mx, my, mz = external[3] + arm_y, external[4] - arm_x, external[5]
    ox = cy * cp * velocity[3] - sy * velocity[4]
    oy = sy * cp * velocity[3] + cy * velocity[4]
    oz = velocity[5] - sp * velocity[3]
    for i in range(lines.shape[0]):
        if not intact[i]:
            tensions[i] = 0.0
            bottom_tensions[i] = 0.0
            continue
        px, py, pz = lines[i, 0], lines[i, 1], lines[i, 2]
        rx, ry, rz = xx * px + xy * py + xz * pz, yx * px + yy * py + yz * pz, zx * px + zy * py + zz * pz
        dx, dy, dz = lines[i, 3] - pose[0] - rx, lines[i, 4] - pose[1] - ry, lines[i, 5] - pose[2] - rz
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        tension = max(0.0, lines[i, 6] * (length - lines[i, 7]) / lines[i, 7])
        dx, dy, dz = dx / length, dy / length, dz / length
        half = lines[i, 8]
        tensions[i] = max(0.0, tension - half * dz)
        bottom_tensions[i] = max(0.0, tension + half * dz)
        tx, ty, tz = tension * dx, tension * dy, tension * dz - half
        if lines[i, 9] > 0.0:
            ux = velocity[0] + oy * rz - oz * ry
            uy = velocity[1] + oz * rx - ox * rz
            uz = velocity[2] + ox * ry - oy * rx
            along = ux * dx + uy * dy + uz * dz
            ux, uy, uz = ux - along * dx, uy - along * dy, uz - along * dz
            if lines.shape[1] == 10:
                drag = lines[i, 9] * math.sqrt(ux * ux + uy * uy + uz * uz)
                tx, ty, tz = tx - drag * ux, ty - drag * uy, tz - drag * uz
            else:
                for g in range(len(POINTS)):
                    share, flow_x, flow_y = POINTS[g], lines[i, 10 + 2 * g], lines[i, 11 + 2 * g]
                    slope = flow_x * dx + flow_y * dy
                    qx, qy, qz = (
                        share * ux - flow_x + slope * dx,
                        share * uy - flow_y + slope * dy,
                        share * uz + slope * dz,
                    )
                    drag = 4.0 * lines[i, 9] * WEIGHTS[g] * share * math.sqrt(qx * qx + qy * qy + qz * qz)
                    tx, ty, tz = tx - drag * qx, ty - drag * qy, tz - drag * qz
        fx, fy, fz = fx + tx, fy + ty, fz + tz
        mx, my, mz = mx + ry * tz - rz * ty, my + rz * tx - rx * tz, mz + rx * ty - ry * tx
    total[0], total[1], total[2] = fx, fy, fz
    total[3], total[4], total[5] = cp * (cy * mx + sy * my) - sp * mz, cy * my - sy * mx, mz


@njit(cache=True)
def resisting_force(  # type: ignore[no-untyped-def]
    yaw, velocity, acceleration, mass, damping, past, turned_velocity, turned_acceleration, total
):
    """Inertia, damping and memory on the rates of the pose -> `total` (6,); eqs. (2) to (4) of motion.py."""
    c, s = math.cos(yaw), math.sin(yaw)
    turning = velocity[5]
    u, w = turned_velocity, turned_acceleration
    for i in range(6):
        u[i] = velocity[i]
        w[i] = acceleration[i]
    u[0], u[1] = c * velocity[0] + s * velocity[1], c * velocity[1] - s * velocity[0]
    w[0] = c * acceleration[0] + s * acceleration[1] + turning * u[1]
    w[1] = c * acceleration[1] - s * acceleration[0] - turning * u[0]
    for i in range(6):
        force = past[i]
        for j in range(6):
            force += mass[i, j] * w[j] + damping[i, j] * u[j]
        total[i] = force
    first, second = 0.0, 0.0
    for j in range(6):
        first += mass[0, j] * u[j]
        second += mass[1, j] * u[j]
    fx, fy = total[0] - turning * second, total[1] + turning * first
    total[0], total[1] = c * fx - s * fy, s * fx + c * fy
    total[5] += u[0] * second - u[1] * first


@njit(cache=True)
def _turn(matrix, yaw):  # type: ignore[no-untyped-def]
    """P M P^T in place, P = diag(Rz(yaw), 1)."""
    c, s = math.cos(yaw), math.sin(yaw)
    for j in range(6):
        first, second = matrix[0, j], matrix[1, j]
        matrix[0, j], matrix[1, j] = c * first - s * second, s * first + c * second
    for i in range(6):
        first, second = matrix[i, 0], matrix[i, 1]
        matrix[i, 0], matrix[i, 1] = c * first - s * second, s * first + c * second


@njit(cache=True)
def eliminate(matrix, k, size):  # type: ignore[no-untyped-def]
    """Step k of the inversion in place of the first `size` rows and columns by Gauss and Jordan, about pivot [k, k]."""
    pivot = 1.0 / matrix[k, k]
    matrix[k, k] = 1.0
    for j in range(size):
        matrix[k, j] *= pivot
    for i in range(size):
        if i != k:
            factor = matrix[i, k]
            matrix[i, k] = 0.0
            for j in range(size):
                matrix[i, j] -= factor * matrix[k, j]


@njit(cache=True)
def _invert(matrix):  # type: ignore[no-untyped-def]
    """Gauss-Jordan inverse in place; no pivoting, as a dominant mass matrix keeps the pivots positive."""
    for k in range(matrix.shape[0]):
        eliminate(matrix, k, matrix.shape[0])


@njit(cache=True)
def _remember(  # type: ignore[no-untyped-def]
    yaw, velocity, history, cursor, filters, pairs, taps, transition, drive, output, extent, predicted, force
):
    """Force of the past of a sub-step -> `force` (6,), eq. (1) of memory.py; filters half way -> `predicted`.

    Puts the velocity at the sub-step's start, in axes that turn with yaw, into the ring and returns its row.
    """
    rows, states = history.shape[0], filters.shape[0]
    cursor = cursor + 1 if cursor + 1 < rows else 0
    for i in range(6):
        history[cursor, i] = velocity[i]
        force[i] = 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    history[cursor, 0] = c * velocity[0] + s * velocity[1]
    history[cursor, 1] = c * velocity[1] - s * velocity[0]
    slot = cursor
    for k in range(taps.shape[0]):
        for p in range(pairs.shape[0]):
            force[pairs[p, 0]] += taps[k, p] * history[slot, pairs[p, 1]]
        slot = slot - 1 if slot > 0 else rows - 1
    for m in range(states):
        total = 0.0
        for n in range(extent[m, 0], extent[m, 1]):
            total += transition[m, n] * filters[n]
        for i in range(6):
            total += drive[m, i] * history[cursor, i]
        predicted[m] = total
        for i in range(6):
            force[i] += output[i, m] * total
    return cursor


@njit(cache=True)
def integrate(  # type: ignore[no-untyped-def]
    position,
    velocity,
    acceleration,
    force,
    tensions,
    bottom_tensions,
    intact,
    history,
    cursor,
    filters,
    force_end,
    h,
    substeps,
    beta,
    matrices,
    hydrostatics,
    lines,
    line_masses,
    free,
    direct,
    pairs,
    taps,
    transition,
    drive,
    output,
    extent,
):
    """Newmark sub-steps into the state, 0; or an error code with the state unchanged.

    The ring of velocities has room for all sub-steps beside what the memory reads, so that rows which it may yet
    need are not written over before the step is accepted.
    """
    mass, damping, stiffness = matrices[0].copy(), matrices[1] + direct, matrices[2]
    for i in range(lines.shape[0]):
        if not intact[i]:
            mass -= line_masses[i]
    x, v, a = position.copy(), velocity.copy(), acceleration.copy()
    inverse = mass + 0.5 * h * damping + beta * h * h * stiffness
    _turn(inverse, x[5])
    for i in range(6):
        if not math.isfinite(force_end[i]):
            return NOT_FINITE
        if not free[i]:
            inverse[i, :] = 0.0
            inverse[:, i] = 0.0
            inverse[i, i] = 1.0
    _invert(inverse)
    external, total, resisting = np.empty(6), np.empty(6), np.empty(6)
    pull, bottom_pull = np.empty(lines.shape[0]), np.empty(lines.shape[0])
    turned_velocity, turned_acceleration = np.empty(6), np.empty(6)
    predicted, rates, past = np.empty(6), np.empty(6), np.empty(6)
    newest, states, half_way = cursor[0], filters.copy(), np.empty(filters.shape[0])
    floor = hydrostatics[2] ** 2 / mass[0, 0]  # below it, corrections are round-off
    for k in range(substeps):
        fraction = (k + 1) / substeps
        newest = _remember(
            x[5], v, history, newest, states, pairs, taps, transition, drive, output, extent, half_way, past
        )
        for i in range(6):
            external[i] = force[i] + (force_end[i] - force[i]) * fraction
            predicted[i] = x[i] + h * v[i] + (0.5 - beta) * h * h * a[i]
            rates[i] = v[i] + 0.5 * h * a[i]
        converged = False
        for _ in range(LARGEST_ITERATION):
            for i in range(6):
                x[i] = predicted[i] + beta * h * h * a[i]
                v[i] = rates[i] + 0.5 * h * a[i]
            generalized_load(x, v, external, hydrostatics, lines, intact, total, pull, bottom_pull)
            resisting_force(x[5], v, a, mass, damping, past, turned_velocity, turned_acceleration, resisting)
            for i in range(6):
                total[i] -= resisting[i]
                if not free[i]:
                    total[i] = 0.0
            change, size = 0.0, 0.0
            for i in range(6):
                correction = 0.0
                for j in range(6):
                    correction += inverse[i, j] * total[j]
                a[i] += correction
                change += mass[i, i] * correction * correction
                size += mass[i, i] * a[i] * a[i]
            if math.isfinite(change) and change <= 1e-24 * size + floor:
                converged = True
                break
        if not converged:
            return NOT_CONVERGED
        for i in range(6):
            x[i] = predicted[i] + beta * h * h * a[i]
            v[i] = rates[i] + 0.5 * h * a[i]
        c, s = math.cos(x[5]), math.sin(x[5])
        for m in range(states.shape[0]):
            states[m] = half_way[m] + drive[m, 0] * (c * v[0] + s * v[1]) + drive[m, 1] * (c * v[1] - s * v[0])
            for i in range(2, 6):
                states[m] += drive[m, i] * v[i]
    cursor[0] = newest
    filters[:] = states
    position[:], velocity[:], acceleration[:], force[:] = x, v, a, force_end
    tensions[:], bottom_tensions[:] = pull, bottom_pull
    return 0
