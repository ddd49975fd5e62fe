"""Orders 0, 1 and 2 of the frequency domain, repeated until means and covariances stand still.

See `tlpsim.loads.spectral.response` for the whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import SolverError
from tlpsim.loads.spectral import viscous
from tlpsim.loads.spectral.aerodynamic import LinearWind, linear_wind
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum, covariance
from tlpsim.loads.spectral.dynamics import (
    Dynamics,
    dynamics,
    generalized_loads,
    mean_pose,
    restoring_curvature,
    through,
    transfer,
)
from tlpsim.loads.spectral.group_damping import group_damping
from tlpsim.loads.spectral.problem import GustsOnGrid, Problem, SeaOnGrid, acting_sea
from tlpsim.loads.spectral.second_order import (
    SLOW_DRIFT,
    SecondOrder,
    displaced_products,
    means,
    spectra,
    tether_products,
    whole,
)
from tlpsim.loads.spectral.tendon_drag import tendon_damping
from tlpsim.loads.waves.current import current_velocity

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TOLERANCE = 1e-6
"""Relative change of means and standard deviations at which the iteration ends."""
ROUND_TOLERANCE = 1e-4
"""The same of a round of the second order."""
LARGEST_ITERATION, LARGEST_ROUND = 200, 30

_RELAXATION, _LEAST_SHARE = 0.7, 0.1  # of a new state in the next one
_STALLED = 0.9  # ratio of two changes above which the share is lowered, by this factor
_PARTS = 8  # of a step of the wave groups, over which a response is averaged
_NOTHING = np.array([1e-4, 1e-7])  # m and rad, or a second: sizes below which there is nothing to converge
_LOOSE, _INNER_SHARE = 1e-3, 0.1  # tolerances of orders 0 and 1 within the first and within later rounds
SECOND_ORDER = "second order"
WITH_MEAN = ("following", "displaced position", SLOW_DRIFT)
"""Parts of the second order whose mean is not in the expansion of the drag, nor in that of the tethers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """What the loads are expanded about.

    Attributes
    ----------
    pose
        Mean position, (6,) m, rad.
    strips, pieces, cross
        Covariances of the relative velocities at strips (s, 2, 2) and at pieces of the surface (p, 2, 2), and of the
        latter with the elevation there, (p, 2).
    relative
        Variances of the relative wind speeds, (n,) m²/s².
    velocity, position
        Covariances of the platform's velocity and position, (6, 6).
    second_velocity, second_position
        What the second order has in them.
    second_load, group_load
        Its mean load beside those of the expansions, and that of damping that follows the wave groups, (6,) N, N·m,
        earth-fixed.
    group_damping
        That damping, (6, 6), see `tlpsim.loads.spectral.group_damping`.
    """

    pose: FloatArray
    strips: FloatArray
    pieces: FloatArray
    cross: FloatArray
    relative: FloatArray
    velocity: FloatArray
    position: FloatArray
    second_velocity: FloatArray
    second_position: FloatArray
    second_load: FloatArray
    group_load: FloatArray
    group_damping: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Expanded:
    """The platform, and the loads on it, linear about a state; loads by part are means, (6,) N, N·m, earth-fixed.

    `drifting` is the platform as it answers slow drift, with damping that follows the wave groups, and `curvature` the
    r'' of `tlpsim.loads.spectral.dynamics`, (6, 6, 6).
    """

    system: Dynamics
    drifting: Dynamics
    curvature: FloatArray
    loads: Mapping[str, FloatArray]
    drag: viscous.Drag | None
    linear: viscous.LinearDrag | None
    wind: LinearWind | None


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstOrder:
    """First-order motion.

    Attributes
    ----------
    waves, force
        Decomposed position and earth-fixed loads of waves on their grid, (6, N).
    gusts
        Decomposed position of gusts; None without wind.
    """

    waves: ComplexArray
    force: ComplexArray
    gusts: DecomposedSpectrum | None


def _start(problem: Problem) -> State:
    """The platform at rest in waves and gusts."""
    none, empty = np.zeros((6, 6)), np.zeros((0, 2, 2))
    state = State(
        pose=np.zeros(6),
        strips=empty,
        pieces=empty,
        cross=np.zeros((0, 2)),
        relative=np.zeros(0),
        velocity=none,
        position=none,
        second_velocity=none,
        second_position=none,
        second_load=np.zeros(6),
        group_load=np.zeros(6),
        group_damping=none,
    )
    count = 0 if problem.sea is None else len(problem.sea.grid.root)
    rest = np.zeros((6, count), dtype=np.complex128)
    return _updated(problem, state, None, FirstOrder(waves=rest, force=rest, gusts=None), 1.0)


def _expanded(problem: Problem, state: State, curvature: FloatArray) -> tuple[Expanded, State]:
    """Loads about a state; and the state at the mean position that they give."""
    model = problem.model
    loads = {"external": model.external}
    damping, stiffness, yaw_slope = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
    drag, linear, wind = None, None, None
    if problem.sea is not None:
        waves = problem.sea.waves
        rise = -problem.sea.elements[1].lever @ state.pose
        drag = viscous.expanded(problem.sea.elements, (state.strips, state.pieces), state.cross, rise)
        linear = viscous.linear_drag(drag)
        damping, stiffness = damping + linear.damping, stiffness + linear.stiffness
        loads |= {"viscous": linear.mean, "splash": linear.splash_mean}
        if waves.drift_damping is not None:
            flow = np.zeros(3)
            if waves.doppler and waves.current is not None:
                flow = current_velocity(waves.current, np.zeros(1))[0]
            damping = damping + waves.drift_damping
            loads["wave drift damping"] = waves.drift_damping[:, :3] @ flow
        loads |= {SECOND_ORDER: state.second_load, "wave groups": state.group_load}
    if problem.gusts is not None:
        wind = linear_wind(problem.gusts.wind, float(state.pose[5]), problem.gusts.variance, state.relative)
        damping, yaw_slope = damping + wind.damping, wind.yaw_slope
        loads["wind"] = wind.mean
    tethers = tendon_damping(model.platform, state.pose, generalized_loads(state.pose), state.velocity)
    loads["tendons"], damping = tethers[0], damping + tethers[1]
    load = np.sum(list(loads.values()), axis=0)
    extra = 0.5 * np.einsum("ijk,jk->i", curvature, state.position)
    pose = mean_pose(model.platform, load, yaw_slope, extra, state.pose)
    system = dynamics(model.platform, pose, load, yaw_slope, damping, stiffness)
    found = Expanded(
        system=system,
        drifting=replace(system, damping=system.damping + system.loads @ state.group_damping),
        curvature=curvature,
        loads=loads,
        drag=drag,
        linear=linear,
        wind=wind,
    )
    return found, replace(state, pose=pose)


def wave_motion(sea: SeaOnGrid, expanded: Expanded, response: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """First-order motion (6, N) and earth-fixed loads (6, N) of waves, by `transfer` at the grid's frequencies."""
    assert expanded.linear is not None
    force = sea.excitation + viscous.wave_loads(expanded.linear, *sea.rows)
    count = len(sea.grid.frequency)
    by_direction = force.reshape(6, -1, count) if count else force.reshape(6, 0, 0)
    generalized = np.tensordot(expanded.system.loads, by_direction, axes=1)
    return np.asarray(response @ generalized.transpose(2, 0, 1)).transpose(1, 2, 0).reshape(6, -1), force


def gust_motion(gusts: GustsOnGrid, expanded: Expanded, response: ComplexArray) -> DecomposedSpectrum:
    """Motion of gusts of the first order, by `transfer` at their frequencies."""
    assert expanded.wind is not None
    return gusts.speeds.through(response @ (expanded.system.loads @ expanded.wind.on_gusts))


def rates(motion: DecomposedSpectrum) -> DecomposedSpectrum:
    """Its time derivative."""
    factor = 2j * np.pi * motion.frequency[:, None, None]
    return replace(motion, function=factor * motion.function)


def _first(problem: Problem, expanded: Expanded) -> FirstOrder:
    waves = force = np.zeros((6, 0), dtype=np.complex128)
    if problem.sea is not None:
        waves, force = wave_motion(problem.sea, expanded, first_transfer(problem.sea.grid.frequency, problem, expanded))
    gusts = None
    if problem.gusts is not None:
        gusts = gust_motion(problem.gusts, expanded, first_transfer(problem.gusts.speeds.frequency, problem, expanded))
    return FirstOrder(waves=waves, force=force, gusts=gusts)


def first_transfer(frequency: FloatArray, problem: Problem, expanded: Expanded) -> ComplexArray:
    """Transfer functions of the first order at frequencies (n,) Hz, (n, 6, 6)."""
    return transfer(expanded.system, problem.memory, 2.0 * np.pi * frequency)


def relative_speeds(gusts: GustsOnGrid, along: FloatArray, motion: DecomposedSpectrum) -> DecomposedSpectrum:
    """Wind speeds relative to the segments, of gusts alone; `along` (n, 6) of `LinearWind`."""
    return replace(gusts.speeds, function=gusts.speeds.function - along @ rates(motion).function)


def _updated(problem: Problem, state: State, wind: LinearWind | None, first: FirstOrder, share: float) -> State:
    """The state with covariances of a first-order motion, `share` of the way from the old ones."""
    slow_velocity, position = state.second_velocity, state.second_position
    if first.gusts is not None:
        slow_velocity = slow_velocity + covariance(rates(first.gusts))
        position = position + covariance(first.gusts)
    wave_velocity = np.zeros((6, 6))
    changes: dict[str, FloatArray] = {}
    if problem.sea is not None:
        sea, step = problem.sea, problem.sea.grid.step
        velocity = 1j * sea.grid.omega * first.waves
        wave_velocity = step * (velocity @ velocity.conj().T).real
        position = position + step * (first.waves @ first.waves.conj().T).real
        for name, elements, rows in zip(("strips", "pieces"), sea.elements, sea.rows, strict=True):
            relative, elevation = viscous.relative_rows(elements, rows, first.waves, sea.grid.omega)
            changes[name], cross = viscous.covariances(elements, relative, elevation, step, slow_velocity)
        changes["cross"] = cross
    if problem.gusts is not None:
        changes["relative"] = problem.gusts.variance
        if wind is not None and first.gusts is not None:
            with_gusts = covariance(problem.gusts.speeds, rates(first.gusts))
            own = np.einsum("ni,ij,nj->n", wind.along, slow_velocity + wave_velocity, wind.along)
            changes["relative"] = problem.gusts.variance - 2.0 * np.sum(with_gusts * wind.along, axis=1) + own
    changes |= {"velocity": slow_velocity + wave_velocity, "position": position}
    for name, value in changes.items():
        old = getattr(state, name)
        changes[name] = value if old.shape != value.shape else (1.0 - share) * old + share * value
    return replace(state, **changes)


def _measure(state: State) -> FloatArray:
    """Mean position and spreads, of translations and rotations in parts of the largest of each."""
    rows = np.stack([state.pose, np.sqrt(np.diag(state.position)), np.sqrt(np.diag(state.velocity))])
    largest = np.repeat(np.stack([np.abs(rows[:, :3]).max(axis=1), np.abs(rows[:, 3:]).max(axis=1)], axis=1), 3, axis=1)
    return np.asarray(rows / np.maximum(largest, np.repeat(_NOTHING, 3)))


def _settled(problem: Problem, state: State, tolerance: float) -> tuple[Expanded, FirstOrder, State]:
    """Iterate orders 0 and 1 with a given second order."""
    curvature = restoring_curvature(problem.model.platform, state.pose)
    before, change, share = _measure(state), np.inf, _RELAXATION
    for _ in range(LARGEST_ITERATION):
        expanded, state = _expanded(problem, state, curvature)
        first = _first(problem, expanded)
        state = _updated(problem, state, expanded.wind, first, share)
        after = _measure(state)
        last, change = change, float(np.max(np.abs(after - before)))
        if not np.isfinite(change):
            break
        if change <= tolerance:
            return expanded, first, state
        if change > _STALLED * last:
            share = max(_LEAST_SHARE, _STALLED * share)
        before = after
    raise SolverError(
        f"frequency domain: means and spreads still change by {change:.3g} of their size after {LARGEST_ITERATION} "
        f"iterations, limit {tolerance:g}: the drag or the wind is too strong for a stationary response; look at the "
        "damping, and try a lower sea or wind"
    )


def first_expansion(problem: Problem) -> Expanded:
    """The platform and its loads, linear for waves and gusts on a platform at rest."""
    state = _start(problem)
    return _expanded(problem, state, restoring_curvature(problem.model.platform, state.pose))[0]


def second_order(sea: SeaOnGrid, expanded: Expanded, first: FirstOrder, curvatures: FloatArray) -> SecondOrder:
    """Generalized forces (6) of the second order, and 1/2 c : x x for further curvatures (q, 6, 6)."""
    assert expanded.drag is not None
    grid, loads = sea.grid, expanded.system.loads
    under, surface = (
        viscous.relative_rows(elements, rows, first.waves, grid.omega)
        for elements, rows in zip(sea.elements, sea.rows, strict=True)
    )
    products = {
        "viscous": viscous.viscous_products(expanded.drag, under[0]),
        "splash": viscous.splash_products(expanded.drag, *surface),
        "following": viscous.following_products(expanded.drag, under[1], sea.rows[0]),
    }
    if sea.waves.displaced_position:
        products["displaced position"] = displaced_products(first.waves, first.force, grid)
    found = {name: each._replace(weights=loads @ each.weights) for name, each in products.items() if len(each.one)}
    found["tethers"] = tether_products(first.waves, -expanded.curvature)
    return SecondOrder(
        products=found,
        drift=None if sea.drift is None else np.tensordot(loads, sea.drift, axes=1),
        further=tether_products(first.waves, curvatures),
    )


def _second(problem: Problem, expanded: Expanded, first: FirstOrder, state: State) -> State:
    """The state with mean loads and covariances of the second order."""
    sea = acting_sea(problem)
    if sea is None:
        return state
    parts = second_order(sea, expanded, first, np.zeros((0, 6, 6)))
    with_mean = [value for name, value in means(parts, sea.grid).items() if name in WITH_MEAN]
    load = np.sum([np.zeros(6), *with_mean], axis=0)
    found = spectra(whole(parts, sea.grid), sea.grid)
    omega = 2.0 * np.pi * problem.frequency
    rate = omega**2 * problem.weight
    responses = (transfer(each, problem.memory, omega) for each in (expanded.drifting, expanded.system))
    slow, fast = map(through, (found.difference.at(problem.frequency), found.total.at(problem.frequency)), responses)
    both = slow + fast
    damping, group_load = _group_damping(problem, expanded, np.einsum("m,mij->ij", rate, slow.real))
    return replace(
        state,
        second_load=np.asarray(np.linalg.solve(expanded.system.loads, load)),
        second_velocity=np.einsum("m,mij->ij", rate, both.real),
        second_position=np.einsum("m,mij->ij", problem.weight, both.real),
        group_load=group_load,
        group_damping=damping,
    )


def _group_damping(problem: Problem, expanded: Expanded, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Damping and load of wave groups, for the covariance (6, 6) of the slow velocity that waves make."""
    sea = problem.groups
    assert sea is not None
    assert expanded.drag is not None
    position, force = wave_motion(sea, expanded, first_transfer(sea.grid.frequency, problem, expanded))
    first = FirstOrder(waves=position, force=force, gusts=None)
    forces = whole(second_order(sea, expanded, first, np.zeros((0, 6, 6))), sea.grid).difference
    relative, _ = viscous.relative_rows(sea.elements[0], sea.rows[0], position, sea.grid.omega)
    middle = np.arange(len(sea.grid.frequency))[:, None]
    omega = 2.0 * np.pi * sea.grid.step * (middle + (np.arange(_PARTS) + 0.5) / _PARTS - 0.5)
    # Response at negative frequencies, in the step about zero, is the conjugate one.
    found = transfer(expanded.drifting, problem.memory, np.abs(omega.ravel()))
    found = np.where(omega.ravel()[:, None, None] < 0.0, np.conj(found), found) * 1j * omega.ravel()[:, None, None]
    rates = found.reshape(*omega.shape, 6, 6).mean(axis=1)
    return group_damping(expanded.drag, relative, forces, rates, variance, sea.grid)


def converged(problem: Problem, tolerance: float) -> tuple[Expanded, FirstOrder, State, tuple[float, ...]]:
    """All orders at a standstill, and the relative change in each round of the second order.

    Raises
    ------
    SolverError
        When there is none: no mean position, no stationary response, or no convergence.
    """
    changes: list[float] = []
    inner, last = _LOOSE, max(tolerance, ROUND_TOLERANCE)
    expanded, first, state = _settled(problem, _start(problem), inner)
    for _ in range(LARGEST_ROUND):
        before = _measure(state)
        state = _second(problem, expanded, first, state)
        expanded, first, state = _settled(problem, state, inner)
        changes.append(float(np.max(np.abs(_measure(state) - before))))
        if changes[-1] <= last:
            return expanded, first, state, tuple(changes)
        inner = max(tolerance, min(inner, _INNER_SHARE * changes[-1]))
    raise SolverError(
        f"frequency domain: means and spreads still change by {changes[-1]:.3g} of their size after {LARGEST_ROUND} "
        f"rounds of the second order, limit {last:g}: slow drift feeds on itself; try a lower sea"
    )
