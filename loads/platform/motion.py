"""The motion of the platform in time: one-step Newmark filter with exact nonlinear restoring.

    M x'' + B x' + F_m + r(x) = Q(t, x),  r = gradient of the potential energy of weight, buoyancy and tendons,
                                          Q = (force, E^T moment) of the external load (see body.py),
                                          F_m = force of the fluid's memory of x' (see memory.py)
    x_{n+1} = x_n + h v_n + h² [(1/2 - beta) a_n + beta a_{n+1}],   v_{n+1} = v_n + h/2 (a_n + a_{n+1})

With gamma = 1/2 and constant stiffness this is the digital filter
    (M + h/2 B + beta h² K) x_{n+1} = [2M - (1 - 2 beta) h² K] x_n - [M - h/2 B + beta h² K] x_{n-1}
                                      + h² [beta F_{n+1} + (1 - 2 beta) F_n + beta F_{n-1}],
for beta = 0 the central-difference filter of Li & Kareem (1990). Fox-Goodwin (beta = 1/12) has a frequency
error of (omega h)⁴/480 and is the default; position and acceleration share that accuracy, while velocity
has the trapezoidal rule's relative error of (omega h)²/12. The acceleration of each sub-step is
corrected with the tangent stiffness at zero pose in the effective matrix until it stands still. The memory's
filters run at the sub-step; what of them acts at once counts as damping.

Inertia is that of small angles: M is constant, and terms quadratic in the rates are left out. The
external load is linear in time between the ends of a step.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.platform.body import Body, fixed_array, generalized_force, hydrostatic_load, mass_matrix
from tlpsim.loads.platform.memory import Memory, NoMemory
from tlpsim.loads.platform.state import PlatformState, fit_history
from tlpsim.loads.platform.tendons import Tendons, tendon_loads

METHODS = {"central_difference": 0.0, "fox_goodwin": 1.0 / 12.0, "average_acceleration": 0.25}
"""beta of each integration method; gamma is 1/2 in all."""
LARGEST_PHASE = 0.35
"""rad, limit of omega_max h: Fox-Goodwin's frequency error stays below 3.2e-5, and all methods are stable."""
LARGEST_ITERATION = 30
_SPARE = 64  # sub-steps of one step that fit into the ring of velocities beside what the memory needs
_NOT_FINITE, _NOT_CONVERGED = -1, -2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlatformModel:
    """Body, tendons and damping, with what the integrator derives from them.

    Attributes
    ----------
    body, tendons : the parts.
    linear_damping : (6, 6) N·s/m, N·s, N·m·s, on the rates of the pose; none by default.
    free : (6,) bool, degrees of freedom that move; all by default. Held ones keep their position.
    method : a key of `METHODS`.
    memory : force of radiated waves; with it the body's added mass is that of infinite frequency.
    mass : (6, 6) mass matrix with added mass (derived).
    stiffness : (6, 6) tangent stiffness at zero pose (derived).
    highest_frequency : rad/s, largest natural frequency of the free degrees of freedom (derived).
    arrays : what the integration kernel reads (derived).

    Raises
    ------
    ScenarioError
        For a wrong shape, negative damping, or an unknown method.
    """

    body: Body
    tendons: Tendons
    linear_damping: NDArray[np.float64] = field(default_factory=lambda: np.zeros((6, 6)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.ones(6, dtype=np.bool_))
    method: str = "fox_goodwin"
    memory: Memory = field(default_factory=NoMemory)
    mass: NDArray[np.float64] = field(init=False, repr=False)
    stiffness: NDArray[np.float64] = field(init=False, repr=False)
    highest_frequency: float = field(init=False, repr=False)
    arrays: tuple[NDArray[Any], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ScenarioError(f"integration method is {self.method!r}, expected one of {', '.join(METHODS)}")
        damping = fixed_array(self.linear_damping, (6, 6), "linear_damping")
        lowest = float(np.linalg.eigvalsh(0.5 * (damping + damping.T))[0])
        if lowest < -1e-12 * float(np.abs(damping).max()):
            raise ScenarioError(f"linear_damping feeds energy in, its lowest eigenvalue is {lowest:.6g}, expected >= 0")
        free = np.array(self.free, dtype=np.bool_)
        if free.shape != (6,):
            raise ScenarioError(f"free has shape {free.shape}, expected (6,): give one flag a degree of freedom")
        free.flags.writeable = False
        body, tendons = self.body, self.tendons
        specific_weight = body.water_density * body.gravity
        weight, buoyancy = body.mass * body.gravity, specific_weight * body.displaced_volume
        # A tendon's tension carries the rounding of its length times its stiffness: EA eps.
        largest = weight + buoyancy + float(tendons.axial_stiffness.sum())
        noise = 16.0 * float(np.finfo(np.float64).eps) * largest
        hydrostatics = np.concatenate(
            (
                [weight, buoyancy, noise],
                specific_weight * np.array([body.waterplane_area, *body.waterplane_moments]),
                body.centre_of_gravity,
                body.centre_of_buoyancy,
            )
        )
        lines = np.column_stack(
            (tendons.fairleads, tendons.anchors, tendons.axial_stiffness, tendons.unstretched_length)
        )
        object.__setattr__(self, "linear_damping", damping)
        object.__setattr__(self, "free", free)
        object.__setattr__(self, "mass", fixed_array(mass_matrix(body), (6, 6), "mass matrix"))
        stiffness = fixed_array(tangent_stiffness(self, np.zeros(6)), (6, 6), "tangent stiffness")
        object.__setattr__(self, "stiffness", stiffness)
        object.__setattr__(self, "highest_frequency", _highest_frequency(self.mass, stiffness, free))
        matrices = fixed_array([self.mass, damping, stiffness], (3, 6, 6), "system matrices")
        hydrostatics = fixed_array(hydrostatics, (12,), "hydrostatics")
        lines = fixed_array(lines, (-1, 8), "tendon lines")
        object.__setattr__(self, "arrays", (matrices, hydrostatics, lines, free))


def _highest_frequency(mass: NDArray[np.float64], stiffness: NDArray[np.float64], free: NDArray[np.bool_]) -> float:
    chosen = np.ix_(free, free)
    if not np.any(free):
        return 0.0
    root = np.linalg.inv(np.linalg.cholesky(mass[chosen]))
    squared = float(np.linalg.eigvalsh(root @ stiffness[chosen] @ root.T)[-1])
    return math.sqrt(max(squared, 0.0))


def restoring_force(model: PlatformModel, pose: NDArray[Any]) -> NDArray[Any]:
    """r(x), gradient of the potential energy by the pose, (6,) N, N·m, at `pose` (6,) m, rad."""
    load = hydrostatic_load(model.body, pose) + tendon_loads(model.tendons, pose)[0]
    return -generalized_force(load, pose)


def tangent_stiffness(model: PlatformModel, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Tangent stiffness dr/dx at `pose` (6,) m, rad: (6, 6) N/m, N, N·m, exact (complex step), symmetric."""
    step = 1e-30  # no difference is taken, so no step is too small
    columns = [restoring_force(model, pose + 1j * step * unit).imag / step for unit in np.eye(6)]
    stiffness = np.column_stack(columns)
    return 0.5 * (stiffness + stiffness.T)


def initial_state(model: PlatformModel, position: ArrayLike, velocity: ArrayLike, force: ArrayLike) -> PlatformState:
    """State at the start, with the acceleration that the equation of motion gives.

    Parameters
    ----------
    position, velocity : (6,) m, rad; velocities of held degrees of freedom are set to zero.
    force : (6,) N, N·m, external load, earth-fixed, about the reference point.

    Raises
    ------
    ScenarioError
        For a wrong shape or a value that is not finite.
    """
    free = model.free
    pose = np.array(fixed_array(position, (6,), "initial position"))
    rates = np.where(free, fixed_array(velocity, (6,), "initial velocity"), 0.0)
    load = np.array(fixed_array(force, (6,), "initial force"))
    drive = generalized_force(load, pose) - restoring_force(model, pose) - model.linear_damping @ rates
    acceleration = np.zeros(6)
    acceleration[free] = np.linalg.solve(model.mass[np.ix_(free, free)], drive[free])
    return PlatformState(
        position=pose,
        velocity=rates,
        acceleration=acceleration,
        force=load,
        tensions=tendon_loads(model.tendons, pose)[1],
    )


def advance(model: PlatformModel, state: PlatformState, force_end: ArrayLike, step: float) -> None:
    """Move `state` ahead by `step`, in place.

    Parameters
    ----------
    force_end : (6,) N, N·m, external load at the end of the step, earth-fixed, about the reference point.
        The load goes linearly from the remembered one at the step's start to this.
    step : s, > 0; split into sub-steps of at most `LARGEST_PHASE` / `highest_frequency`.

    Raises
    ------
    StepError
        For a bad step or load, or when the correction does not converge. The state is then unchanged.
    """
    load = np.array(force_end, dtype=np.float64)
    if load.shape != (6,):
        raise StepError(f"platform force at the step's end has shape {load.shape}, expected (6,)")
    if not 0.0 < step < math.inf:
        raise StepError(f"platform step is {step} s, expected a finite number > 0")
    shortest = max(model.highest_frequency / LARGEST_PHASE, 1.0 / model.memory.longest_step)
    substeps = max(1, math.ceil(step * shortest - 1e-9))
    memory = model.memory.discrete(step / substeps)
    fit_history(state, step / substeps, memory.taps.shape[0] + max(substeps, _SPARE), memory.transition.shape[0])
    outcome = _advance(
        state.position,
        state.velocity,
        state.acceleration,
        state.force,
        state.tensions,
        state.history,
        state.cursor,
        state.filters,
        load,
        step / substeps,
        substeps,
        METHODS[model.method],
        *model.arrays,
        *memory.arrays,
    )
    if outcome == _NOT_FINITE:
        raise StepError(f"platform force at the step's end is {load}, expected finite numbers")
    if outcome == _NOT_CONVERGED:
        raise StepError(
            f"platform motion did not converge within {LARGEST_ITERATION} corrections from position "
            f"{state.position} with a sub-step of {step / substeps:.4g} s: reduce the load or the step"
        )


# The kernels repeat hydrostatic_load, tendon_loads and generalized_force as one loop without temporaries, two
# orders of magnitude faster; a test holds the two forms together. They stand in one file because the cache
# of a jitted function sees changes in its own file only.


@njit(cache=True)
def _generalized_load(pose, external, hydrostatics, lines, total, tensions):  # type: ignore[no-untyped-def]
    """External load minus restoring on the rates of the pose -> `total` (6,); tensions (n,) on the way."""
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
    arm_x = xx * bx + xy * by + xz * bz - pitch_stiffness * zx * xx - roll_stiffness * zy * xy
    arm_y = yx * bx + yy * by + yz * bz - pitch_stiffness * zx * yx - roll_stiffness * zy * yy
    fx, fy, fz = external[0], external[1], external[2] + buoyancy - weight - heave_stiffness * pose[2]
    mx, my, mz = external[3] + arm_y, external[4] - arm_x, external[5]
    for i in range(lines.shape[0]):
        px, py, pz = lines[i, 0], lines[i, 1], lines[i, 2]
        rx, ry, rz = xx * px + xy * py + xz * pz, yx * px + yy * py + yz * pz, zx * px + zy * py + zz * pz
        dx, dy, dz = lines[i, 3] - pose[0] - rx, lines[i, 4] - pose[1] - ry, lines[i, 5] - pose[2] - rz
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        tension = max(0.0, lines[i, 6] * (length - lines[i, 7]) / lines[i, 7])
        tensions[i] = tension
        tx, ty, tz = tension * dx / length, tension * dy / length, tension * dz / length
        fx, fy, fz = fx + tx, fy + ty, fz + tz
        mx, my, mz = mx + ry * tz - rz * ty, my + rz * tx - rx * tz, mz + rx * ty - ry * tx
    total[0], total[1], total[2] = fx, fy, fz
    total[3], total[4], total[5] = cp * (cy * mx + sy * my) - sp * mz, cy * my - sy * mx, mz


@njit(cache=True)
def _invert(matrix):  # type: ignore[no-untyped-def]
    """Gauss-Jordan inverse in place; no pivoting, as a dominant mass matrix keeps the pivots positive."""
    size = matrix.shape[0]
    for k in range(size):
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
def _remember(  # type: ignore[no-untyped-def]
    velocity, history, cursor, filters, pairs, taps, transition, drive, output, extent, predicted, force
):
    """Force of the past of a sub-step -> `force` (6,), eq. (1) of memory.py; filters half way -> `predicted`.

    Puts the velocity at the sub-step's start into the ring and returns its row.
    """
    rows, states = history.shape[0], filters.shape[0]
    cursor = cursor + 1 if cursor + 1 < rows else 0
    for i in range(6):
        history[cursor, i] = velocity[i]
        force[i] = 0.0
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
            total += drive[m, i] * velocity[i]
        predicted[m] = total
        for i in range(6):
            force[i] += output[i, m] * total
    return cursor


@njit(cache=True)
def _advance(  # type: ignore[no-untyped-def]
    position,
    velocity,
    acceleration,
    force,
    tensions,
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
    mass, damping, stiffness = matrices[0], matrices[1] + direct, matrices[2]
    x, v, a = position.copy(), velocity.copy(), acceleration.copy()
    inverse = mass + 0.5 * h * damping + beta * h * h * stiffness
    for i in range(6):
        if not math.isfinite(force_end[i]):
            return _NOT_FINITE
        if not free[i]:
            inverse[i, :] = 0.0
            inverse[:, i] = 0.0
            inverse[i, i] = 1.0
    _invert(inverse)
    external, total, pull = np.empty(6), np.empty(6), np.empty(lines.shape[0])
    predicted, rates, past = np.empty(6), np.empty(6), np.empty(6)
    newest, states, half_way = cursor[0], filters.copy(), np.empty(filters.shape[0])
    floor = hydrostatics[2] ** 2 / mass[0, 0]  # below it, corrections are round-off
    for k in range(substeps):
        fraction = (k + 1) / substeps
        newest = _remember(v, history, newest, states, pairs, taps, transition, drive, output, extent, half_way, past)
        for i in range(6):
            external[i] = force[i] + (force_end[i] - force[i]) * fraction
            predicted[i] = x[i] + h * v[i] + (0.5 - beta) * h * h * a[i]
            rates[i] = v[i] + 0.5 * h * a[i]
        converged = False
        for _ in range(LARGEST_ITERATION):
            for i in range(6):
                x[i] = predicted[i] + beta * h * h * a[i]
                v[i] = rates[i] + 0.5 * h * a[i]
            _generalized_load(x, external, hydrostatics, lines, total, pull)
            for i in range(6):
                total[i] -= past[i]
                for j in range(6):
                    total[i] -= mass[i, j] * a[j] + damping[i, j] * v[j]
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
            return _NOT_CONVERGED
        for i in range(6):
            x[i] = predicted[i] + beta * h * h * a[i]
            v[i] = rates[i] + 0.5 * h * a[i]
        for m in range(states.shape[0]):
            states[m] = half_way[m]
            for i in range(6):
                states[m] += drive[m, i] * v[i]
    cursor[0] = newest
    filters[:] = states
    position[:], velocity[:], acceleration[:], force[:], tensions[:] = x, v, a, force_end, pull
    return 0
