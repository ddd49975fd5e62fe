"""The platform about its mean position: stiffness, its change, damping, inertia, transfer functions and modes.

    r(x0) + 1/2 r'' : Cov x = E^T F0                                          mean position              (1)
    Z(omega) = K - omega² M + i omega (B + H(omega)),   H_x = Z^-1            first and second order     (2)
    z_i = -1/2 r''_ijk (x_j x_k - Cov)                                        second-order force         (3)

r is the exact restoring force of weight, buoyancy and tendons (`tlpsim.loads.platform.motion`), K = r' its tangent and
r'' its second derivative: eq. (3) holds the setdown, as the quadratic function of surge and sway that it is, and the
coupling of setdown with yaw that tilts the platform. E^T turns earth-fixed loads into generalized ones. H is the
response of the fluid memory's digital filter at the step of the time domain, so that both domains have one kernel.

The tension of a tendon is expanded likewise, T(x0 + x) = T + T' x + 1/2 T'' : x x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import linear_sum_assignment

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import SolverError
from tlpsim.loads.hydro.radiation import frequency_response
from tlpsim.loads.platform.body import generalized_force, generalized_force_slope, turned_matrix, yaw_turn
from tlpsim.loads.platform.equilibrium import ROUND_OFF, balanced
from tlpsim.loads.platform.memory import DiscreteMemory
from tlpsim.loads.platform.motion import LARGEST_PHASE, PlatformModel, tangent_stiffness, tension_gradients
from tlpsim.loads.platform.tendons import tendon_loads
from tlpsim.loads.remembered import remembered
from tlpsim.loads.spectral.compiled import powers_of_responding, responding, responses
from tlpsim.loads.spectral.records import Mode

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_MEMORY_STEP = 0.005  # rad/s, a small part of 2 pi over the length of the memory
_COMPLEX_STEP = 1e-30
_FILTERS = tuple(each.name for each in fields(DiscreteMemory))  # in the order of its `arrays`
_UNDAMPED = 1e-5  # of critical: less is rounding
_SAME = 1e-6  # relative difference of frequencies that are alike
_DIFFERENCE = np.array([1e-2, 1e-2, 1e-2, 1e-5, 1e-5, 1e-5])  # m, rad, for second derivatives


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Memory:
    """Response of the fluid's memory to the velocity in axes that turn with yaw, for `at`."""

    spline: CubicSpline | None

    def at(self, omega: FloatArray) -> ComplexArray:
        """Force over velocity, (n, 6, 6), at (n,) rad/s."""
        if self.spline is None:
            return np.zeros((len(omega), 6, 6), dtype=np.complex128)
        return np.asarray(self.spline(omega))


_on_grid = remembered(24)(Memory.at)  # the same grids come back in each iteration, and in each case of a sweep


def fluid_memory(platform: PlatformModel, step: float, highest: float) -> Memory:
    """Memory's response up to `highest` (rad/s) as the integrator has it that takes `step` (s)."""
    shortest = max(platform.highest_frequency / LARGEST_PHASE, 1.0 / platform.memory.longest_step)
    substep = step / max(1, math.ceil(step * shortest - 1e-9))
    filters = platform.memory.discrete(substep)
    return _memory(substep, math.ceil(highest / _MEMORY_STEP) + 4, *filters.arrays)


@remembered(8)
def _memory(substep: float, count: int, *arrays: NDArray[Any]) -> Memory:
    filters = DiscreteMemory(**dict(zip(_FILTERS, arrays, strict=True)))
    if not (filters.taps.size or filters.transition.size or np.any(filters.direct)):
        return Memory(spline=None)
    omega = _MEMORY_STEP * np.arange(count)
    return Memory(spline=CubicSpline(omega, frequency_response(filters, omega, substep)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Dynamics:
    """The platform at a mean position.

    Attributes
    ----------
    pose
        Mean position, (6,) m, rad.
    free
        Numbers of the degrees of freedom that move.
    loads
        E^T, generalized forces of earth-fixed loads, (6, 6).
    mass, damping, stiffness
        M, B and K, (6, 6).
    turn
        From axes that turn with yaw to those of the pose, (6, 6), for the memory.
    """

    pose: FloatArray
    free: NDArray[np.int64]
    loads: FloatArray
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    turn: FloatArray


def jacobian(function: Any, pose: FloatArray) -> FloatArray:
    """Derivative of a function (...) of a pose by a complex step, (..., 6)."""
    columns = [function(pose + 1j * _COMPLEX_STEP * unit).imag / _COMPLEX_STEP for unit in np.eye(6)]
    return np.stack(columns, axis=-1)


def generalized_loads(pose: FloatArray) -> FloatArray:
    """E^T at a pose, (6, 6): generalized forces of earth-fixed loads about the reference point."""
    return np.column_stack([generalized_force(unit, pose) for unit in np.eye(6)])


def second_derivative(first: Any, pose: FloatArray) -> FloatArray:
    """Change of a Jacobian (m, 6) with the pose, (m, 6, 6), symmetric in the last two."""
    units = np.diag(_DIFFERENCE)
    parts = [(first(pose + unit) - first(pose - unit)) / (2.0 * unit.max()) for unit in units]
    found = np.stack(parts, axis=-1)
    return np.asarray(0.5 * (found + np.swapaxes(found, 1, 2)))


def restoring_curvature(platform: PlatformModel, pose: FloatArray) -> FloatArray:
    """r'' at a pose, (6, 6, 6) N/m², N/m, N and N·m."""
    return second_derivative(partial(tangent_stiffness, platform), pose)


def tension_expansion(platform: PlatformModel, pose: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tensions at the tops T (t,) N, T' (t, 6) and T'' (t, 6, 6) at a pose."""
    gradients = partial(tension_gradients, platform)
    return tendon_loads(platform.tendons, pose)[1], gradients(pose), second_derivative(gradients, pose)


def mean_pose(
    platform: PlatformModel, load: FloatArray, yaw_slope: FloatArray, extra: FloatArray, start: FloatArray
) -> FloatArray:
    """Position of eq. (1), by Newton's method from `start`.

    Parameters
    ----------
    load
        Mean load at the yaw of `start`, (6,) N, N·m, earth-fixed.
    yaw_slope
        Its change with yaw, (6,).
    extra
        1/2 r'' : Cov x, (6,).

    Raises
    ------
    SolverError
        Where there is no such position near.
    """
    pose = balanced(platform, load, start, yaw_slope, extra)
    if pose is not None:
        return pose
    raise SolverError(
        f"frequency domain: the platform finds no mean position under the mean load {load} (N, N·m) and what "
        f"fluctuations add, {-extra}: lower the loads, or check pretension and tendons"
    )


def dynamics(
    platform: PlatformModel,
    pose: FloatArray,
    load: FloatArray,
    yaw_slope: FloatArray,
    damping: FloatArray,
    stiffness: FloatArray,
) -> Dynamics:
    """The platform about a mean position.

    Parameters
    ----------
    pose
        (6,) m, rad.
    load, yaw_slope
        Mean load and its change with yaw, (6,), earth-fixed.
    damping, stiffness
        Of the loads, (6, 6), on rates and displacements, as earth-fixed loads.

    Raises
    ------
    SolverError
        When the platform is unstable there.
    """
    loads = generalized_loads(pose)
    turning = generalized_force_slope(load, pose)
    turning[:, 5] += loads @ yaw_slope
    whole = tangent_stiffness(platform, pose) - turning + loads @ stiffness
    mass = turned_matrix(platform.mass, float(pose[5]))
    free = np.flatnonzero(platform.free)
    _require_stable(whole, mass, free, platform.body.gravity)
    return Dynamics(
        pose=pose,
        free=free,
        loads=loads,
        mass=mass,
        damping=turned_matrix(platform.linear_damping, float(pose[5])) + loads @ damping,
        stiffness=whole,
        turn=yaw_turn(float(pose[5])),
    )


def _require_stable(stiffness: FloatArray, mass: FloatArray, free: NDArray[np.int64], gravity: float) -> None:
    chosen = np.ix_(free, free)
    if not free.size:
        return
    squared, modes = np.linalg.eig(np.linalg.solve(mass[chosen], stiffness[chosen]))
    worst = int(np.argmin(squared.real))
    if squared[worst].real < ROUND_OFF * max(float(np.abs(squared).max()), gravity):
        name = DEGREES_OF_FREEDOM[free[int(np.argmax(np.abs(modes[:, worst]) * np.sqrt(np.diag(mass)[free])))]]
        raise SolverError(
            f"frequency domain: nothing holds the platform in {name} at its mean position, stiffness over mass "
            f"{squared[worst].real:.4g} 1/s², expected > 0: there is no stationary response; give it tendons, or lower "
            "the mean loads"
        )


def transfer(system: Dynamics, memory: Memory, omega: FloatArray) -> ComplexArray:
    """Z^-1 of eq. (2) at (n,) rad/s, (n, 6, 6) m/N ..., zero for degrees of freedom that are held."""
    cosine, sine = float(system.turn[0, 0]), float(system.turn[1, 0])
    memory_there = _on_grid(memory, omega)
    matrices = (system.stiffness, system.mass, system.damping)
    return np.asarray(responses(omega, memory_there, *matrices, cosine, sine, system.free))


def through(matrices: ComplexArray, response: ComplexArray) -> ComplexArray:
    """Cross-spectra (n, k, k) of what responds to cross-spectra (n, k, k) by transfer functions (n, 6, 6).

    Quantities beside the six forces pass as they are. Both are Hermitian.
    """
    return np.asarray(responding(np.ascontiguousarray(matrices), np.ascontiguousarray(response)))


def powers_through(matrices: ComplexArray, response: ComplexArray) -> FloatArray:
    """Spectra (n, 6) of the positions in `through`."""
    return np.asarray(powers_of_responding(np.ascontiguousarray(matrices), np.ascontiguousarray(response)))


def natural_modes(system: Dynamics, memory: Memory) -> tuple[Mode, ...]:
    """Modes of eq. (2) from its complex eigenvalues, slowest first, each with the memory at its own frequency."""
    chosen, count = np.ix_(system.free, system.free), len(system.free)
    if not count:
        return ()
    omega = np.sort(np.abs(_eigen(system, memory, np.zeros(1), chosen)[0][0]))
    for _ in range(5):
        values, vectors = _eigen(system, memory, omega, chosen)
        energy = np.abs(vectors) ** 2 * np.diag(system.mass)[system.free, None]
        moved = [linear_sum_assignment(-each.T / each.sum(axis=0)[:, None])[1] for each in energy]
        # Surge and sway of a square hull have one frequency, and no order but by name.
        sizes = np.round(np.log(np.abs(values)) / _SAME)
        places = [np.lexsort(keys)[number] for number, keys in enumerate(zip(moved, sizes, strict=True))]
        omega = np.abs(values[np.arange(count), places])
    found: list[Mode] = []
    left = set(range(count))
    for number, at in enumerate(places):
        index = int(moved[number][at])
        if index not in left:
            index = max(left, key=lambda k: energy[number, k, at])
        left.discard(index)
        name, ratio = DEGREES_OF_FREEDOM[system.free[index]], float(-values[number, at].real / omega[number])
        found.append(Mode(name=name, period=float(2.0 * np.pi / omega[number]), damping_ratio=ratio))
    return tuple(found)


def require_damped(modes: tuple[Mode, ...]) -> None:
    """Refuse modes that no stationary response can be in.

    Raises
    ------
    SolverError
        When the damping of a mode is not above zero.
    """
    worst = min(modes, key=lambda mode: mode.damping_ratio, default=None)
    if worst is not None and worst.damping_ratio <= _UNDAMPED:
        raise SolverError(
            f"frequency domain: the mode of {worst.name}, period {worst.period:.4g} s, has a damping ratio of "
            f"{worst.damping_ratio:.3g}, expected more than {_UNDAMPED:g}: there is no stationary response; give it "
            "damping (platform.damping_ratios), or look at wave drift damping"
        )


def _eigen(
    system: Dynamics, memory: Memory, omega: FloatArray, chosen: tuple[NDArray[np.int64], ...]
) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues with positive imaginary part (n, count), and vectors (n, count, count), with the memory at omega."""
    at = np.maximum(omega, _MEMORY_STEP)
    rates = (system.turn @ memory.at(at) @ system.turn.T)[:, chosen[0], chosen[1]]
    mass = system.mass[chosen] + rates.imag / at[:, None, None]
    count = len(system.free)
    whole = np.zeros((len(at), 2 * count, 2 * count))
    whole[:, np.arange(count), count + np.arange(count)] = 1.0
    springs = np.broadcast_to(system.stiffness[chosen], mass.shape)
    whole[:, count:] = -np.linalg.solve(mass, np.concatenate([springs, system.damping[chosen] + rates.real], axis=2))
    values, vectors = np.linalg.eig(whole)
    # Of each pair the one that turns forward; overdamped ones have none.
    order = np.argsort(-values.imag, axis=1)[:, :count]
    forward = np.take_along_axis(vectors[:, :count], order[:, None], axis=2)
    return np.take_along_axis(values, order, axis=1), forward
