"""Loss of tendons: redistribution of tension, its overshoot, momentum and energy, and the exact state."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import generalized_force
from tlpsim.loads.platform.equilibrium import mechanical_energy, static_equilibrium
from tlpsim.loads.platform.motion import (
    PlatformModel,
    advance,
    initial_state,
    remaining,
    restoring_force,
    set_intact,
)
from tlpsim.loads.platform.state import PlatformState
from tlpsim.loads.platform.tendons import tendon_loads

TLP = issc_tlp.platform()
UNDAMPED = issc_tlp.platform(np.zeros(6))
TUBES = replace(TLP, tendons=issc_tlp.tendons(tubes=issc_tlp.steel_tubes() | {"submerged_weight": np.array([1500.0])}))
REST = np.zeros(6)
PRETENSION = 14.0e6 * 9.80665 / 12.0
AXIAL = 3.37e11 / 12.0 / (415.0 / (1.0 + PRETENSION / (3.37e11 / 12.0)))  # N/m of one tendon
SPECIFIC_WEIGHT = 1025.0 * 9.80665
WATERPLANE = 4.0 * np.pi * 8.435**2


def all_but(*lost: int) -> NDArray[np.bool_]:
    return ~np.isin(np.arange(12), lost)


def at_rest(model: PlatformModel, force: NDArray[np.float64] = REST) -> PlatformState:
    return initial_state(model, static_equilibrium(model, force), REST, force)


def test_one_of_each_column_lost_leaves_its_share_to_the_others() -> None:
    """By symmetry heave alone: eight springs and the waterplane take what twelve springs held."""
    left = remaining(TLP, all_but(0, 3, 6, 9))
    heave = 4.0 * PRETENSION / (8.0 * AXIAL + SPECIFIC_WEIGHT * WATERPLANE)
    pose = static_equilibrium(left, REST)
    np.testing.assert_allclose(pose, [0, 0, heave, 0, 0, 0], rtol=1e-7, atol=1e-11)
    np.testing.assert_allclose(tendon_loads(left.tendons, pose)[1], PRETENSION + AXIAL * heave, rtol=1e-9)


def test_one_lost_tilts_the_platform_onto_its_corner() -> None:
    """Vertical springs under a rigid deck; the hull's own restoring by its closed form."""
    lost = 0
    arms = TLP.tendons.fairleads[all_but(lost), :2]
    rise = np.column_stack((np.ones(11), arms[:, 1], -arms[:, 0]))  # of a spring for unit heave, roll and pitch
    stiffness = AXIAL * rise.T @ rise
    second_moment = np.pi * 8.435**4 + WATERPLANE * 43.125**2
    hull = 54.5e6 * 9.80665 * TLP.body.centre_of_buoyancy[2] - 40.5e6 * 9.80665 * 3.0
    tilt = SPECIFIC_WEIGHT * second_moment + hull + 11.0 * PRETENSION * 35.0
    stiffness += np.diag([SPECIFIC_WEIGHT * WATERPLANE, tilt, tilt])
    freed = PRETENSION * np.array([1.0, 43.125, -43.125])  # its pull is gone at (43.125, 43.125)
    tensions = PRETENSION + AXIAL * rise @ np.linalg.solve(stiffness, freed)
    left = remaining(TLP, all_but(lost))
    pose = static_equilibrium(left, REST)
    # Left out are the changes of geometric stiffness with tension, 0.3 % of the tilt's 1.4e12 N·m.
    np.testing.assert_allclose(tendon_loads(left.tendons, pose)[1], tensions, rtol=1e-3)
    # The two beside it take most: 2.5/7 of a tendon's pull each by the springs alone.
    assert tensions[:2].min() > 1.25 * PRETENSION
    assert tensions[5:8].max() < PRETENSION


@pytest.mark.parametrize("lost", [(0,), (0, 1), (0, 3, 6, 9)])
def test_overshoot_of_a_sudden_loss(lost: tuple[int, ...]) -> None:
    for model, least in ((UNDAMPED, 1.7), (TLP, 1.5)):
        state, kept = at_rest(model), all_but(*lost)
        before = state.tensions.copy()
        set_intact(model, state, kept)
        after = tendon_loads(remaining(model, kept).tendons, static_equilibrium(remaining(model, kept), REST))[1]
        static = after - before[kept]
        worst = int(np.argmax(static))
        peak = 0.0
        for _ in range(300):
            advance(model, state, REST, 0.1)
            assert np.all(np.isfinite(state.tensions))
            np.testing.assert_array_equal(state.tensions[~kept], 0.0)
            np.testing.assert_array_equal(state.bottom_tensions[~kept], 0.0)
            peak = max(peak, state.tensions[kept][worst] - before[kept][worst])
        # Each mode of a linear platform overshoots by at most its static step, and at this column all are of one sign.
        # The tethers' stiffness grows with their length by 1e-3.
        assert least * static[worst] < peak < 2.001 * static[worst]


@pytest.mark.parametrize("model", [TLP, TUBES], ids=["massless", "tubes"])
def test_a_loss_jumps_the_acceleration_alone(model: PlatformModel) -> None:
    force = np.array([3e6, 1e6, 0.0, 1e7, 2e7, 3e7])
    state = initial_state(model, static_equilibrium(model, force), [0.5, -0.2, 0.01, 1e-4, 2e-4, 3e-3], force)
    kept = all_but(2, 7)
    before = state.copy()
    set_intact(model, state, kept)
    for name in ("position", "velocity", "force", "history", "filters"):
        np.testing.assert_array_equal(getattr(state, name), getattr(before, name))
    alone = initial_state(remaining(model, kept), before.position, before.velocity, force)
    np.testing.assert_allclose(state.acceleration, alone.acceleration, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(state.tensions[kept], alone.tensions, rtol=1e-12)
    np.testing.assert_allclose(state.bottom_tensions[kept], alone.bottom_tensions, rtol=1e-12)
    assert abs(state.acceleration[2] - before.acceleration[2]) > 0.1
    set_intact(model, state, np.ones(12, dtype=bool))
    np.testing.assert_allclose(state.acceleration, before.acceleration, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(state.tensions, before.tensions, rtol=1e-12)


def test_momentum_after_a_loss_is_the_impulse_of_the_forces() -> None:
    """Heave and surge over ten seconds against another integrator that knows eleven tendons only."""
    kept, end = all_but(4), 10.0
    state = at_rest(TLP)
    left = remaining(TLP, kept)
    set_intact(TLP, state, kept)
    inverse = np.linalg.inv(left.mass)

    def slope(_: float, values: NDArray[np.float64]) -> NDArray[np.float64]:
        drive = generalized_force(REST, values[:6]) - restoring_force(left, values[:6])
        return np.concatenate((values[6:], inverse @ (drive - TLP.linear_damping @ values[6:])))

    start = np.concatenate((state.position, state.velocity))
    exact = solve_ivp(slope, (0.0, end), start, method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
    steps = 1000
    for _ in range(steps):
        advance(TLP, state, REST, end / steps)
    # The trapezoidal velocity is off by (omega h)²/12 = 1e-4 over 35 radians of motion; yaw does not move.
    size = np.abs(exact[[2, 3, 4]]).max()
    np.testing.assert_allclose(state.position[2:5], exact[2:5], rtol=0, atol=1e-3 * size)
    gained = left.mass @ state.velocity
    np.testing.assert_allclose(gained[[2, 3, 4]], (left.mass @ exact[6:])[[2, 3, 4]], rtol=0.02, atol=1e3)


def test_energy_is_kept_after_a_loss() -> None:
    state = at_rest(UNDAMPED)
    set_intact(UNDAMPED, state, all_but(0, 1))
    left = remaining(UNDAMPED, state.intact)
    released = mechanical_energy(UNDAMPED, state)
    lowest = initial_state(UNDAMPED, static_equilibrium(left, REST), REST, REST, all_but(0, 1))
    depth = released - mechanical_energy(UNDAMPED, lowest)
    assert depth > 0.0
    ripple = []
    for n in range(5000):
        advance(UNDAMPED, state, REST, 0.02)
        if n % 7 == 0:
            ripple.append(mechanical_energy(UNDAMPED, state) - released)
    # (omega h)²/6 = 8e-4 of the energy that moves, by the trapezoidal velocity.
    assert np.abs(ripple).max() < 2e-3 * depth
    assert abs(np.mean(ripple[-100:]) - np.mean(ripple[:100])) < 2e-4 * depth


def test_all_lost_leaves_a_ship_without_nan() -> None:
    state = at_rest(TLP)
    set_intact(TLP, state, np.zeros(12, dtype=bool))
    # Buoyancy that is no longer held down, on the mass and added mass.
    assert state.acceleration[2] == pytest.approx(12.0 * PRETENSION / TLP.mass[2, 2], rel=1e-9)
    for _ in range(100):
        advance(TLP, state, REST, 0.1)
        assert np.all(np.isfinite(state.position))
        assert not state.tensions.any()


def test_loss_in_a_storm_goes_on_bit_for_bit_from_a_copy() -> None:
    generator = np.random.default_rng(2)
    forces = np.cumsum(generator.normal(size=(200, 6)), axis=0) * [3e5, 3e5, 1e6, 1e7, 1e7, 1e7]
    state = initial_state(TUBES, REST, REST, REST)
    for n in range(50):
        advance(TUBES, state, forces[n], 0.1)
    set_intact(TUBES, state, all_but(5))
    other = state.copy()
    for n in range(50, 200):
        for each in (state, other):
            advance(TUBES, each, forces[n], 0.1)
            if n == 120:
                set_intact(TUBES, each, all_but(5, 6, 7, 8))
    for each in fields(PlatformState):
        np.testing.assert_array_equal(getattr(state, each.name), getattr(other, each.name))
    assert np.all(np.isfinite(state.tensions))


def test_lost_from_the_start() -> None:
    kept = all_but(3)
    state = initial_state(TLP, REST, REST, REST, kept)
    later = initial_state(TLP, REST, REST, REST)
    set_intact(TLP, later, kept)
    for each in fields(PlatformState):
        np.testing.assert_allclose(getattr(state, each.name), getattr(later, each.name), rtol=1e-9, atol=1e-9)


def test_flags_of_a_wrong_shape_are_refused() -> None:
    state = initial_state(TLP, REST, REST, REST)
    with pytest.raises(ScenarioError, match=r"intact has shape \(3,\), expected \(12,\)"):
        set_intact(TLP, state, np.ones(3, dtype=bool))
