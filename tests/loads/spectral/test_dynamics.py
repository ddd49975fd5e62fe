"""The platform about its mean position: expansions by differences, transfer by elimination, modes, refusals."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import SolverError
from tlpsim.loads.hydro.radiation import convolution_memory, frequency_response, radiation
from tlpsim.loads.platform.body import generalized_force, turned_matrix
from tlpsim.loads.platform.equilibrium import natural_periods, static_equilibrium
from tlpsim.loads.platform.motion import PlatformModel, restoring_force, tangent_stiffness
from tlpsim.loads.platform.tendons import tendon_loads, without_lost
from tlpsim.loads.spectral.dynamics import (
    Dynamics,
    dynamics,
    fluid_memory,
    generalized_loads,
    mean_pose,
    natural_modes,
    require_damped,
    restoring_curvature,
    tension_expansion,
    transfer,
)

NONE, SIX = np.zeros((6, 6)), np.zeros(6)
LOAD = np.array([4e6, -2e6, 1e5, 3e7, 5e7, 8e7])
OFFSET = np.array([15.0, -8.0, -0.35, 2e-4, -3e-4, 0.08])
DAMPED = (0.05, 0.06, 0.02, 0.03, 0.04, 0.05)


@cache
def platform() -> PlatformModel:
    return issc_tlp.platform(DAMPED)


def at_rest(model: PlatformModel, pose: NDArray[np.float64] = SIX, damping: NDArray[np.float64] = NONE) -> Dynamics:
    load = np.zeros(6)
    return dynamics(model, pose, load, SIX, damping, NONE)


# Expansions


def test_restoring_force_and_tensions_to_the_second_order() -> None:
    """What is left of both is of the third order: it falls by eight where the motion halves."""
    model = platform()
    curvature, stiffness = restoring_curvature(model, OFFSET), tangent_stiffness(model, OFFSET)
    tensions, gradient, bend = tension_expansion(model, OFFSET)
    direction = np.array([1.0, -0.7, 0.05, 2e-4, -3e-4, 8e-3])
    left = []
    for size in (1.0, 0.5, 0.25):
        x = size * direction
        force = restoring_force(model, OFFSET + x) - restoring_force(model, OFFSET)
        quadratic = 0.5 * np.einsum("ijk,j,k->i", curvature, x, x)
        pulled = tendon_loads(model.tendons, OFFSET + x)[1]
        square = 0.5 * np.einsum("tij,i,j->t", bend, x, x)
        left.append((force - stiffness @ x - quadratic, pulled - tensions - gradient @ x - square))
        assert np.abs(left[-1][0]).max() < 0.05 * np.abs(quadratic).max()
        assert np.abs(left[-1][1]).max() < 0.05 * np.abs(square).max()
    for before, after in itertools.pairwise(left):
        for one, other in zip(before, after, strict=True):
            np.testing.assert_allclose(np.linalg.norm(one) / np.linalg.norm(other), 8.0, rtol=0.15)
    np.testing.assert_allclose(curvature, curvature.swapaxes(1, 2), rtol=1e-12)
    # The third derivative of an energy, so symmetric in all three.
    np.testing.assert_allclose(curvature, curvature.transpose(1, 0, 2), atol=1e-4 * np.abs(curvature).max())
    np.testing.assert_allclose(tensions, tendon_loads(model.tendons, OFFSET)[1], rtol=1e-12)


def test_setdown_is_in_the_curvature() -> None:
    """Straight down, a heave force of surge: EA x²/(2 L) over L of all tethers, of stiffness T / L and EA / L."""
    curvature = restoring_curvature(platform(), SIX)
    length = issc_tlp.WATER_DEPTH - issc_tlp.DRAUGHT
    # Energy 1/2 EA/l0 (l - l0)²; its third derivative in x, x, z is EA / (l0 L) - (T / L) / L.
    stiff = issc_tlp.TOTAL_AXIAL_STIFFNESS / length
    tension = issc_tlp.TOTAL_PRETENSION / length
    assert curvature[2, 0, 0] == pytest.approx((stiff - tension) / length, rel=0.01)
    assert curvature[2, 1, 1] == pytest.approx(curvature[2, 0, 0], rel=1e-6)
    assert curvature[2, 0, 1] == pytest.approx(0.0, abs=1e-6 * curvature[2, 0, 0])


# Mean position


@pytest.mark.parametrize("start", [SIX, OFFSET], ids=["from rest", "from an offset"])
def test_mean_position_is_that_of_rest_under_the_same_load(start: NDArray[np.float64]) -> None:
    found = mean_pose(platform(), LOAD, SIX, SIX, start)
    np.testing.assert_allclose(found, static_equilibrium(platform(), LOAD), atol=1e-9)


def test_mean_position_under_a_load_that_turns_and_with_fluctuations() -> None:
    """The force balance itself, with a load linear in yaw and what fluctuations add to the restoring force."""
    slope, extra = np.array([1e6, 2e6, 0.0, 1e7, -1e7, 3e7]), np.array([0.0, 0.0, 2e6, 1e5, 0.0, 0.0])
    start = np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.01])
    pose = mean_pose(platform(), LOAD, slope, extra, start)
    load = LOAD + slope * (pose[5] - 0.01)
    left = restoring_force(platform(), pose) + extra - generalized_force(load, pose)
    np.testing.assert_allclose(left, 0.0, atol=1e-6 * np.abs(LOAD).max())


def test_held_degrees_of_freedom_stay_where_they_are() -> None:
    held = replace(platform(), free=np.array([True, True, False, False, True, False]))
    start = np.array([0.0, 0.0, 0.1, 0.002, 0.0, 0.05])
    pose = mean_pose(held, LOAD, SIX, SIX, start)
    np.testing.assert_array_equal(pose[[2, 3, 5]], start[[2, 3, 5]])
    assert abs(pose[0]) > 5.0
    response = transfer(at_rest(held), fluid_memory(held, 0.1, 4.0), np.array([0.0, 0.5]))
    assert not response[:, [2, 3, 5]].any()
    assert not response[:, :, [2, 3, 5]].any()
    names = [mode.name for mode in natural_modes(at_rest(held), fluid_memory(held, 0.1, 4.0))]
    assert sorted(names) == ["pitch", "surge", "sway"]
    still = replace(platform(), free=np.zeros(6, dtype=np.bool_))
    np.testing.assert_array_equal(mean_pose(still, LOAD, SIX, SIX, start), start)
    assert natural_modes(at_rest(still), fluid_memory(still, 0.1, 4.0)) == ()


def test_too_much_load_has_no_mean_position() -> None:
    with pytest.raises(SolverError, match=r"no mean position under the mean load .*lower the loads"):
        mean_pose(platform(), 1e4 * LOAD, SIX, SIX, SIX)


def test_a_platform_that_nothing_holds_has_no_mean_position() -> None:
    adrift = replace(platform(), tendons=without_lost(platform().tendons, np.zeros(12, dtype=np.bool_)))
    with pytest.raises(SolverError, match="no mean position"):
        mean_pose(adrift, LOAD, SIX, SIX, SIX)


# Transfer functions and modes


def test_transfer_solves_the_equation_of_motion() -> None:
    """At a turned mean position under a load, from the same matrices put together here."""
    model = platform()
    pose = static_equilibrium(model, LOAD)
    more, stiff = np.diag([1e5, 2e5, 1e5, 1e8, 1e8, 1e8]), np.diag([0.0, 0.0, 1e5, 0.0, 0.0, 0.0])
    slope = np.array([1e5, 0.0, 0.0, 0.0, 0.0, 1e6])
    system = dynamics(model, pose, LOAD, slope, more, stiff)
    step = 1e-6
    turning = np.column_stack(
        [
            (
                generalized_force(LOAD + slope * step * unit[5], pose + step * unit)
                - generalized_force(LOAD - slope * step * unit[5], pose - step * unit)
            )
            / (2.0 * step)
            for unit in np.eye(6)
        ]
    )
    loads = np.column_stack([generalized_force(unit, pose) for unit in np.eye(6)])
    np.testing.assert_allclose(generalized_loads(pose), loads)
    stiffness = tangent_stiffness(model, pose) - turning + loads @ stiff
    np.testing.assert_allclose(system.stiffness, stiffness, rtol=1e-6, atol=1e-6 * np.abs(LOAD).max())
    omega = np.array([0.0, 0.06, 0.5, 3.3])
    found = transfer(system, fluid_memory(model, 0.1, 4.0), omega)
    mass = turned_matrix(model.mass, pose[5])
    damping = turned_matrix(model.linear_damping, pose[5]) + loads @ more
    force = np.array([1.0, 2.0j, 3.0, 40.0, 50.0, 60.0])
    for w, response in zip(omega, found, strict=True):
        x = response @ force
        back = (stiffness - w**2 * mass + 1j * w * damping) @ x
        np.testing.assert_allclose(back, force, rtol=1e-6, atol=1e-5)


def test_modes_of_the_platform_without_memory() -> None:
    """Periods are the undamped ones, and damping ratios those that the damping was made of where nothing couples."""
    model = platform()
    modes = natural_modes(at_rest(model), fluid_memory(model, 0.1, 4.0))
    found = {mode.name: mode for mode in modes}
    assert len(found) == 6
    periods = dict(zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), natural_periods(model), strict=True))
    for name, mode in found.items():
        # Damping of 6 % and its coupling change the modulus of an eigenvalue by less than 1e-3.
        assert mode.period == pytest.approx(periods[name], rel=2e-3), name
    ratios = dict(zip(periods, DAMPED, strict=True))
    for name in ("heave", "yaw"):  # surge and pitch, sway and roll share the added mass
        assert found[name].damping_ratio == pytest.approx(ratios[name], rel=1e-6)
    for name in ("surge", "sway"):
        assert found[name].damping_ratio == pytest.approx(ratios[name], rel=0.02)
    assert [mode.period for mode in modes] == sorted((mode.period for mode in modes), reverse=True)


def test_an_overdamped_mode_is_told_as_such() -> None:
    model = issc_tlp.platform((3.0, 0.1, 0.02, 0.02, 0.02, 0.1))
    found = {mode.name: mode for mode in natural_modes(at_rest(model), fluid_memory(model, 0.1, 4.0))}
    assert len(found) == 6
    assert found["surge"].damping_ratio == pytest.approx(1.0)
    assert found["sway"].damping_ratio == pytest.approx(0.1, rel=0.02)


def test_the_memory_of_the_fluid_lengthens_the_surge_period() -> None:
    """Memory in the mode is the added mass of the database at its frequency: 102.6 s, and 97.9 s without it."""
    database = issc_database()
    kernel = radiation(database)
    body = replace(issc_tlp.body(), added_mass=kernel.added_mass_infinite)
    bare = PlatformModel(body=body, tendons=issc_tlp.tendons(), memory=convolution_memory(kernel))
    memory = fluid_memory(bare, 0.1, 4.0)
    # A little damping of the modes that radiate none.
    damping = np.diag(1e-4 * 2.0 * np.sqrt(np.diag(bare.mass) * np.diag(bare.stiffness)))
    found = {mode.name: mode for mode in natural_modes(at_rest(bare, damping=damping), memory)}
    at = int(np.argmin(np.abs(database.omega - 2.0 * np.pi / 102.6)))
    slow = PlatformModel(body=replace(body, added_mass=symmetric(database.added_mass[at])), tendons=issc_tlp.tendons())
    for name in ("surge", "sway"):
        assert found[name].period == pytest.approx(natural_periods(slow)[0], rel=1e-3)
        assert found[name].period == pytest.approx(102.6, abs=0.1)
    assert natural_periods(bare)[0] == pytest.approx(97.9, abs=0.1)
    # Between the grid of the memory it is a spline: against the filter's own response.
    substep = 0.1 / np.ceil(0.1 * max(bare.highest_frequency / 0.35, 1.0 / bare.memory.longest_step) - 1e-9)
    omega = np.array([0.0131, 0.0777, 0.4321, 1.2345, 3.3333])
    exact = frequency_response(bare.memory.discrete(substep), omega, substep)
    np.testing.assert_allclose(memory.at(omega), exact, atol=1e-4 * np.abs(exact).max())


def symmetric(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(0.5 * (matrix + matrix.T))


def test_modes_of_a_square_hull_bear_each_name_once() -> None:
    """Surge and sway have one frequency, and which vector comes first is left to rounding."""
    model = issc_tlp.platform((0.05,) * 6)
    for load in (SIX, 1e6 * np.eye(6)[0], 1e6 * np.eye(6)[1]):
        pose = static_equilibrium(model, load)
        modes = natural_modes(dynamics(model, pose, load, SIX, NONE, NONE), fluid_memory(model, 0.1, 4.0))
        assert [mode.name for mode in modes][2] == "yaw"
        assert {mode.name for mode in modes if mode.period > 100.0} == {"surge", "sway"}
        assert {mode.name for mode in modes if mode.period < 2.0} == {"heave", "roll", "pitch"}


# Refusals


@pytest.mark.parametrize(("degree", "name"), [(0, "surge"), (2, "heave"), (5, "yaw")])
def test_a_platform_that_is_not_held_is_named(degree: int, name: str) -> None:
    stiffness = NONE.copy()
    stiffness[degree, degree] = -2.0 * platform().stiffness[degree, degree]
    with pytest.raises(SolverError, match=f"nothing holds the platform in {name} at its mean position"):
        dynamics(platform(), SIX, SIX, SIX, NONE, stiffness)


@pytest.mark.parametrize(("degree", "name"), [(0, "surge"), (2, "heave"), (4, "pitch"), (5, "yaw")])
def test_a_mode_that_gains_energy_is_named(degree: int, name: str) -> None:
    damping = NONE.copy()
    damping[degree, degree] = -3.0 * platform().linear_damping[degree, degree]
    system = at_rest(platform(), damping=damping)
    modes = natural_modes(system, fluid_memory(platform(), 0.1, 4.0))
    with pytest.raises(
        SolverError, match=rf"the mode of {name}, period .* damping ratio of -0\.\d+, expected more than"
    ):
        require_damped(modes)
    require_damped(natural_modes(at_rest(platform()), fluid_memory(platform(), 0.1, 4.0)))
    require_damped(())
