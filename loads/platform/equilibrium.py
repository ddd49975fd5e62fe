"""What the platform model gives without stepping in time: energy, periods, damping and equilibrium.

The equations:

    energy          1/2 v^T M v + V(x),  V of weight, buoyancy and tendons
    periods         (K - omega² M) phi = 0 with the tangent stiffness K at a pose; single: K_ii/M_ii
    damping         B_ii = 2 zeta_i sqrt(M_ii K_ii)
    equilibrium     r(x) = Q(x), by Newton's method with the exact tangent

Where the model has a fluid memory, M holds the added mass of infinite frequency, and so do energy, periods and damping.
That is right for the tether modes; slow modes carry more added mass, of which the memory makes the difference (the ISSC
TLP's surge period is 102.6 s with it and 97.9 s by M alone).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.platform.body import (
    fixed_array,
    generalized_force,
    generalized_force_slope,
    hydrostatic_energy,
    turned_matrix,
)
from tlpsim.loads.platform.motion import PlatformModel, remaining, restoring_force, tangent_stiffness
from tlpsim.loads.platform.state import PlatformState
from tlpsim.loads.platform.tendons import tendon_drag, tendon_energy

LARGEST_INCREMENTS = 64
ROUND_OFF = 1e-9
"""of the highest squared frequency, 1/s²"""
LARGEST_ITERATION = 30
LARGEST_REPETITION = 50
YAW_TOLERANCE = 1e-9
"""rad, between two repetitions of an equilibrium under a load that changes with yaw"""


def potential_energy(model: PlatformModel, pose: NDArray[Any]) -> Any:
    """Potential energy of weight, buoyancy and tendons, J, at `pose` (6,) m, rad."""
    return hydrostatic_energy(model.body, pose) + tendon_energy(model.tendons, pose)


def mechanical_energy(model: PlatformModel, state: PlatformState) -> float:
    """Kinetic energy with added mass plus potential energy above that of zero pose, J."""
    if not state.intact.all():
        model = remaining(model, state.intact)
    mass = turned_matrix(model.mass, float(state.position[5]))
    kinetic = 0.5 * float(state.velocity @ mass @ state.velocity)
    return kinetic + float(potential_energy(model, state.position) - potential_energy(model, np.zeros(6)))


def natural_periods(model: PlatformModel, pose: ArrayLike = (0.0,) * 6) -> NDArray[np.float64]:
    """Undamped natural periods of the coupled free degrees of freedom.

    Parameters
    ----------
    pose : (6,) m, rad, where the tangent stiffness is taken.

    Returns
    -------
    (6,) s, each mode under the degree of freedom that holds most of its kinetic energy; nan for a held one,
    inf for a mode that nothing restores.
    """
    free = np.flatnonzero(model.free)
    periods = np.full(6, np.nan)
    if free.size:
        chosen = np.ix_(free, free)
        at = _pose(pose)
        mass, stiffness = turned_matrix(model.mass, at[5])[chosen], tangent_stiffness(model, at)[chosen]
        squared, modes = eigh(stiffness, mass)
        share = np.abs(modes * (mass @ modes))
        rows, columns = linear_sum_assignment(-share)
        periods[free[rows]] = _period(squared[columns], stiffness, mass)
    return periods


def single_periods(model: PlatformModel, pose: ArrayLike = (0.0,) * 6) -> NDArray[np.float64]:
    """Natural periods with only one degree of freedom free at a time, (6,) s; inf where nothing restores.

    `pose` is (6,) m, rad, where the tangent stiffness is taken.
    """
    at = _pose(pose)
    mass, stiffness = turned_matrix(model.mass, at[5]), tangent_stiffness(model, at)
    return _period(np.diag(stiffness) / np.diag(mass), stiffness, mass)


def _pose(pose: ArrayLike) -> NDArray[np.float64]:
    return np.array(fixed_array(pose, (6,), "pose"))


def _period(
    squared: NDArray[np.float64], stiffness: NDArray[np.float64], mass: NDArray[np.float64]
) -> NDArray[np.float64]:
    # Round-off of a vanishing stiffness must not come out as a long but finite period.
    floor = 1e-14 * float(np.max(np.abs(np.diag(stiffness)) / np.diag(mass)))
    restored = squared > floor
    return np.where(restored, 2.0 * np.pi / np.sqrt(np.where(restored, squared, 1.0)), np.inf)


def damping_from_ratios(model: PlatformModel, ratios: ArrayLike) -> NDArray[np.float64]:
    """Diagonal linear damping 2 zeta_i sqrt(M_ii K_ii), (6, 6) N·s/m, N·m·s, at zero pose.

    Parameters
    ----------
    ratios : (6,) fractions of critical damping of the single degrees of freedom, >= 0.

    Raises
    ------
    ScenarioError
        For a negative ratio, or a ratio where no stiffness restores the degree of freedom.
    """
    values = fixed_array(ratios, (6,), "damping ratios")
    mass, stiffness = np.diag(model.mass), np.diag(model.stiffness)
    for name, ratio, restoring in zip(DEGREES_OF_FREEDOM, values, stiffness, strict=True):
        if ratio < 0.0:
            raise ScenarioError(f"damping ratio in {name} is {ratio}, expected >= 0")
        if ratio > 0.0 and restoring <= 0.0:
            raise ScenarioError(
                f"damping ratio in {name} is {ratio}, but its stiffness is {restoring:.6g}: "
                "give a linear damping coefficient instead"
            )
    return np.diag(2.0 * values * np.sqrt(mass * np.maximum(stiffness, 0.0)))


def require_upright(model: PlatformModel) -> None:
    """Refuse a platform that capsizes or sinks away by itself.

    Raises
    ------
    ScenarioError
        When a combination of the free degrees of freedom has negative stiffness at zero pose.
    """
    free = np.flatnonzero(model.free)
    if not free.size:
        return
    chosen = np.ix_(free, free)
    squared, modes = eigh(model.stiffness[chosen], model.mass[chosen])
    if squared[0] < -ROUND_OFF * max(abs(squared[-1]), model.body.gravity):
        mode = np.abs(modes[:, 0]) * np.sqrt(np.diag(model.mass)[free])
        name = DEGREES_OF_FREEDOM[free[int(np.argmax(mode))]]
        raise ScenarioError(
            f"the platform is unstable in {name} at zero position, stiffness over mass {squared[0]:.4g} 1/s², expected "
            ">= 0: it capsizes; lower the centre_of_gravity, or give it more waterplane_moment, tendons or pretension"
        )


def static_equilibrium(
    model: PlatformModel, force: ArrayLike | Callable[[float], ArrayLike], start: ArrayLike = (0.0,) * 6
) -> NDArray[np.float64]:
    """Pose at rest under a constant load, or one that changes with yaw, and in the current of the model's tendons.

    The load goes on at once and, where Newton's method does not converge so, in 2, 4, ... 64 increments. A load that
    changes with yaw is taken at the yaw of the last pose, again and again until that stands still.

    Parameters
    ----------
    force : (6,) N, N·m, earth-fixed, about the reference point; or a function of yaw (rad) that gives it.
    start : (6,) m, rad, first guess; held degrees of freedom stay there.

    Returns
    -------
    (6,) m, rad.

    Raises
    ------
    SolverError
        When no equilibrium is found.
    """
    if callable(force):
        pose = _pose(start)
        for _ in range(LARGEST_REPETITION):
            yaw = float(pose[5])
            pose = static_equilibrium(model, force(yaw), pose)
            if abs(pose[5] - yaw) <= YAW_TOLERANCE:
                return pose
        raise SolverError(
            f"static equilibrium: yaw, now {pose[5]:.6g} rad, still changes by more than {YAW_TOLERANCE:g} rad after "
            f"{LARGEST_REPETITION} repetitions, as the load turns with it: check where the load acts"
        )
    load, origin = fixed_array(force, (6,), "static force"), _pose(start)
    if model.flow is not None:
        load = load + tendon_drag(model.tendons, np.zeros(6), np.zeros(6), model.body.water_density, model.flow)
    increments = 1
    while increments <= LARGEST_INCREMENTS:
        found: NDArray[np.float64] | None = origin
        for number in range(1, increments + 1):
            if found is not None:
                found = balanced(model, load * (number / increments), found)
        if found is not None:
            return found
        increments *= 2
    raise SolverError(
        f"platform has no equilibrium near {origin} under the load {load}, "
        f"tried in up to {LARGEST_INCREMENTS} increments: check the load, the pretension and the held "
        "degrees of freedom"
    )


def balanced(
    model: PlatformModel,
    load: NDArray[np.float64],
    start: NDArray[np.float64],
    yaw_slope: NDArray[np.float64] | None = None,
    extra: NDArray[np.float64] | None = None,
) -> NDArray[np.float64] | None:
    """Pose at which r(x) + extra = E^T (load + slope (yaw - yaw of the start)), by Newton's method; None for none.

    Parameters
    ----------
    load : (6,) N, N·m, earth-fixed, about the reference point.
    start : (6,) m, rad; held degrees of freedom stay there.
    yaw_slope : change of the load with yaw, (6,) N/rad, N·m/rad; none by default.
    extra : generalized force beside the restoring one, (6,); none by default.
    """
    pose, free = start.copy(), np.flatnonzero(model.free)
    if not free.size:
        return pose
    chosen = np.ix_(free, free)
    slope = np.zeros(6) if yaw_slope is None else yaw_slope
    beside = np.zeros(6) if extra is None else extra
    for _ in range(LARGEST_ITERATION):
        acting = load + slope * (pose[5] - start[5])
        left = restoring_force(model, pose) + beside - generalized_force(acting, pose)
        tangent = tangent_stiffness(model, pose) - generalized_force_slope(acting, pose)
        tangent[:, 5] -= generalized_force(slope, pose)
        try:
            change = np.linalg.solve(tangent[chosen], -left[free])
        except np.linalg.LinAlgError:
            return None
        pose[free] += change
        # Beyond a radian or ten kilometres there is no equilibrium of a moored platform.
        if not np.all(np.isfinite(pose)) or np.abs(pose[3:]).max() > 1.0 or np.abs(pose[:3]).max() > 1e4:
            return None
        # Round-off of the weight over the surge stiffness is some 1e-13 m; convergence is quadratic.
        if np.abs(change).max() <= 1e-11 * max(1.0, float(np.abs(pose).max())):
            return pose
    return None
