"""The motion of the platform in time: one-step Newmark filter with exact nonlinear restoring.

    I + B u + F_m + r(x) = Q(t, x) + D(x, x')                                                               (1)
    r = gradient of the potential energy of weight, buoyancy and tendons,  Q = (force, E^T moment) of the external load
    (see body.py),  F_m = force of the fluid's memory of u (see memory.py),  D = drag of the tendons (see tendons.py)
    u = P^T x',  P = diag(Rz(yaw), 1): the rates in axes that turn with yaw                                 (2)
    I = d/dt dL/dx' - dL/dx of L = 1/2 u^T M u, with p = M u and k = e_z:                                   (3)
    I = P [M u' + yaw' (k × p_lin, 0) + (0, k (k . u_lin × p_lin))],  u' = P^T x'' - yaw' (k × u_lin, 0)    (4)
    x_{n+1} = x_n + h v_n + h² [(1/2 - beta) a_n + beta a_{n+1}],   v_{n+1} = v_n + h/2 (a_n + a_{n+1})     (5)

With gamma = 1/2 and constant stiffness this is the digital filter
    (M + h/2 B + beta h² K) x_{n+1} = [2M - (1 - 2 beta) h² K] x_n - [M - h/2 B + beta h² K] x_{n-1}
                                      + h² [beta F_{n+1} + (1 - 2 beta) F_n + beta F_{n-1}],
for beta = 0 the central-difference filter of Li & Kareem (1990). Fox-Goodwin (beta = 1/12) has a frequency
error of (omega h)⁴/480 and is the default; position and acceleration share that accuracy, while velocity
has the trapezoidal rule's relative error of (omega h)²/12. The acceleration of each sub-step is
corrected with the tangent stiffness at zero pose in the effective matrix until it stands still. The memory's
filters run at the sub-step; what of them acts at once counts as damping.

Yaw may be of any size: mass, added mass, damping and memory turn with it, so that a platform that is turned together
with its anchors and loads moves alike. Roll and pitch are small where inertia is concerned: M does not tilt, and
terms quadratic in their rates are left out. The external load is linear in time between the ends of a step.

A tendon is lost or restored between two steps, by `set_intact`: position and velocity go on, while tensions and
acceleration jump to what eq. (1) gives, with the same force of the fluid's memory before and after.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.platform.body import (
    Body,
    fixed_array,
    generalized_force,
    mass_matrix,
    turned_matrix,
    yaw_turn,
)
from tlpsim.loads.platform.integration import LARGEST_ITERATION, NOT_CONVERGED, NOT_FINITE, integrate
from tlpsim.loads.platform.memory import Memory, NoMemory
from tlpsim.loads.platform.state import PlatformState, fit_history
from tlpsim.loads.platform.statics import restoring, restoring_gradients
from tlpsim.loads.platform.tendons import (
    POINTS,
    Tendons,
    current_along_lines,
    drag_factors,
    effective_mass,
    line_lengths,
    tendon_drag,
    tendon_loads,
    without_lost,
)
from tlpsim.loads.waves.current import Current

METHODS = {"central_difference": 0.0, "fox_goodwin": 1.0 / 12.0, "average_acceleration": 0.25}
"""beta of each integration method; gamma is 1/2 in all."""
LARGEST_PHASE = 0.35
"""rad, limit of omega_max h: Fox-Goodwin's frequency error stays below 3.2e-5, and all methods are stable."""
_SPARE = 64  # sub-steps of one step that fit into the ring of velocities beside what the memory needs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlatformModel:
    """Body, tendons and damping, with what the integrator derives from them.

    Attributes
    ----------
    body, tendons : the parts.
    linear_damping : (6, 6) N·s/m, N·s, N·m·s, on the rates u of eq. (2); none by default.
    free : (6,) bool, degrees of freedom that move; all by default. Held ones keep their position.
    method : a key of `METHODS`.
    memory : force of radiated waves; with it the body's added mass is that of infinite frequency.
    current : in which the tendons stand; None for water at rest.
    flow : (tendons, 6, 2) m/s, current at points of the tendons; None without one (derived).
    mass : (6, 6) mass matrix with added mass and the effective mass of the tendons (derived).
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
    current: Current | None = None
    flow: NDArray[np.float64] | None = field(init=False, repr=False)
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
        flow = None if self.current is None else current_along_lines(tendons, self.current)
        object.__setattr__(self, "flow", flow)
        lines = np.column_stack(
            (
                tendons.fairleads,
                tendons.anchors,
                tendons.axial_stiffness,
                tendons.unstretched_length,
                0.5 * tendons.submerged_weight * line_lengths(tendons),
                drag_factors(tendons, body.water_density),
                np.zeros((len(tendons.pretension), 0)) if flow is None else flow.reshape(len(flow), 2 * len(POINTS)),
            )
        )
        line_masses = fixed_array(effective_mass(tendons, body.water_density), (-1, 6, 6), "tendon effective mass")
        mass = mass_matrix(body) + line_masses.sum(axis=0)
        object.__setattr__(self, "linear_damping", damping)
        object.__setattr__(self, "free", free)
        object.__setattr__(self, "mass", fixed_array(mass, (6, 6), "mass matrix"))
        hydrostatics = fixed_array(hydrostatics, (12,), "hydrostatics")
        lines = fixed_array(lines, (-1, lines.shape[1]), "tendon lines")
        stiffness = fixed_array(_stiffness(np.zeros(6), hydrostatics, lines), (6, 6), "tangent stiffness")
        object.__setattr__(self, "stiffness", stiffness)
        object.__setattr__(self, "highest_frequency", _highest_frequency(self.mass, stiffness, free))
        matrices = fixed_array([self.mass, damping, stiffness], (3, 6, 6), "system matrices")
        object.__setattr__(self, "arrays", (matrices, hydrostatics, lines, line_masses, free))


def _highest_frequency(mass: NDArray[np.float64], stiffness: NDArray[np.float64], free: NDArray[np.bool_]) -> float:
    chosen = np.ix_(free, free)
    if not np.any(free):
        return 0.0
    root = np.linalg.inv(np.linalg.cholesky(mass[chosen]))
    squared = float(np.linalg.eigvalsh(root @ stiffness[chosen] @ root.T)[-1])
    return math.sqrt(max(squared, 0.0))


def restoring_force(model: PlatformModel, pose: NDArray[Any]) -> NDArray[Any]:
    """r(x), gradient of the potential energy by the pose, (6,) N, N·m, at `pose` (6,) m, rad, which may be complex."""
    return np.asarray(restoring(pose, *model.arrays[1:3])[0])


def tangent_stiffness(model: PlatformModel, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Tangent stiffness dr/dx at `pose` (6,) m, rad: (6, 6) N/m, N, N·m, exact (complex step), symmetric."""
    return _stiffness(pose, *model.arrays[1:3])


def _stiffness(
    pose: NDArray[np.float64], hydrostatics: NDArray[np.float64], lines: NDArray[np.float64]
) -> NDArray[np.float64]:
    stiffness = restoring_gradients(pose, hydrostatics, lines)[0]
    return np.asarray(0.5 * (stiffness + stiffness.T))


def tension_gradients(model: PlatformModel, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Derivatives of the tensions at the tops by `pose` (6,) m, rad: (n, 6) N/m, N, exact (complex step)."""
    return np.asarray(restoring_gradients(pose, *model.arrays[1:3])[1])


def remaining(model: PlatformModel, intact: ArrayLike) -> PlatformModel:
    """The model without the lost tendons and what they weigh and carry; `intact` (n,) bool."""
    return replace(model, tendons=without_lost(model.tendons, intact))


def inertia_force(
    model: PlatformModel, pose: NDArray[np.float64], velocity: NDArray[np.float64], acceleration: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Inertia force I of eq. (4), (6,) N, N·m, of pose, velocity and acceleration (6,)."""
    turn = yaw_turn(pose[5])
    turned = turn.T @ velocity
    momentum = model.mass @ turned
    axis, turning = np.array([0.0, 0.0, 1.0]), velocity[5]
    change = turn.T @ acceleration
    change[:3] -= turning * np.cross(axis, turned[:3])
    force = model.mass @ change
    force[:3] += turning * np.cross(axis, momentum[:3])
    force[5] += np.cross(turned[:3], momentum[:3])[2]
    return np.asarray(turn @ force)


def _balance(
    model: PlatformModel, pose: NDArray[np.float64], velocity: NDArray[np.float64], load: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Force that is left for the acceleration, (6,) N, N·m: eq. (1) without memory and without M x''."""
    drag = tendon_drag(model.tendons, pose, velocity, model.body.water_density, model.flow)
    damping = turned_matrix(model.linear_damping, pose[5]) @ velocity
    quadratic = inertia_force(model, pose, velocity, np.zeros(6))
    return generalized_force(load + drag, pose) - restoring_force(model, pose) - damping - quadratic


def _solved(model: PlatformModel, yaw: float, drive: NDArray[np.float64]) -> NDArray[np.float64]:
    acceleration, free = np.zeros(6), model.free
    mass = turned_matrix(model.mass, yaw)[np.ix_(free, free)]
    acceleration[free] = np.linalg.solve(mass, drive[free])
    return acceleration


def initial_state(
    model: PlatformModel,
    position: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    intact: ArrayLike | None = None,
) -> PlatformState:
    """State at the start, with the acceleration that the equation of motion gives.

    Parameters
    ----------
    position, velocity : (6,) m, rad; velocities of held degrees of freedom are set to zero.
    force : (6,) N, N·m, external load, earth-fixed, about the reference point.
    intact : (n,) bool, false for a tendon that is lost from the start; all intact by default.

    Raises
    ------
    ScenarioError
        For a wrong shape or a value that is not finite.
    """
    free = model.free
    pose = np.array(fixed_array(position, (6,), "initial position"))
    rates = np.where(free, fixed_array(velocity, (6,), "initial velocity"), 0.0)
    load = np.array(fixed_array(force, (6,), "initial force"))
    kept = _flags(model, intact)
    left = model if kept.all() else remaining(model, kept)
    top, bottom = _tensions(left, kept, pose)
    return PlatformState(
        position=pose,
        velocity=rates,
        acceleration=_solved(left, pose[5], _balance(left, pose, rates, load)),
        force=load,
        tensions=top,
        bottom_tensions=bottom,
        intact=kept,
    )


def _flags(model: PlatformModel, intact: ArrayLike | None) -> NDArray[np.bool_]:
    count = len(model.tendons.pretension)
    kept = np.ones(count, dtype=np.bool_) if intact is None else np.array(intact, dtype=np.bool_)
    if kept.shape != (count,):
        raise ScenarioError(f"intact has shape {kept.shape}, expected ({count},): give one flag a tendon")
    return kept


def _tensions(
    left: PlatformModel, kept: NDArray[np.bool_], pose: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tensions (n,) at the tops and the bottoms, N, of all tendons where `left` has those that are kept."""
    top, bottom = np.zeros(len(kept)), np.zeros(len(kept))
    _, top[kept], bottom[kept] = tendon_loads(left.tendons, pose)
    return top, bottom


def set_intact(model: PlatformModel, state: PlatformState, intact: ArrayLike) -> None:
    """Lose tendons, or take them back, at the present time of `state`, in place.

    Parameters
    ----------
    intact : (n,) bool, false for a lost tendon. One that comes back is as long as it was.

    Raises
    ------
    ScenarioError
        For a wrong shape.
    """
    kept = _flags(model, intact)
    if np.array_equal(kept, state.intact):
        return
    pose, rates = state.position, state.velocity
    before, after = remaining(model, state.intact), remaining(model, kept)
    drive = _balance(after, pose, rates, state.force) - _balance(before, pose, rates, state.force)
    drive += turned_matrix(before.mass, pose[5]) @ state.acceleration  # with the memory's force, which does not jump
    state.acceleration[:] = _solved(after, pose[5], drive)
    state.intact[:] = kept
    state.tensions[:], state.bottom_tensions[:] = _tensions(after, kept, pose)


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
    outcome = integrate(
        state.position,
        state.velocity,
        state.acceleration,
        state.force,
        state.tensions,
        state.bottom_tensions,
        state.intact,
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
    if outcome == NOT_FINITE:
        raise StepError(f"platform force at the step's end is {load}, expected finite numbers")
    if outcome == NOT_CONVERGED:
        raise StepError(
            f"platform motion did not converge within {LARGEST_ITERATION} corrections from position "
            f"{state.position} with a sub-step of {step / substeps:.4g} s: reduce the load or the step"
        )
