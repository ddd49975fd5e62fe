"""The whole of the frequency domain where the response is known in closed form: no boundary elements, few loads."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import simpson

from tlpsim.loads import issc_tlp
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import SolverError
from tlpsim.loads.hydro.excitation import mean_current_force
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.platform.body import generalized_force, turned_matrix
from tlpsim.loads.platform.equilibrium import static_equilibrium
from tlpsim.loads.platform.motion import PlatformModel, tangent_stiffness
from tlpsim.loads.platform.tendons import without_lost
from tlpsim.loads.spectral.model import SpectralModel, SpectralWaves, SpectralWind
from tlpsim.loads.spectral.records import SpectralResponse, band_integral
from tlpsim.loads.spectral.response import FREQUENCY_STEP, PRODUCTS, respond
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.current import power_law_current
from tlpsim.loads.waves.elevation import transition
from tlpsim.loads.waves.field import WaveComponents
from tlpsim.loads.waves.sea import SeaState
from tlpsim.loads.wind.force import mean_force, turned_segments
from tlpsim.loads.wind.segments import default_segments

DAMPED = (0.06, 0.06, 0.03, 0.03, 0.03, 0.06)
STATE = SeaState(spectrum="pierson_moskowitz", significant_height=5.0, peak_period=13.0, heading=0.4, water_depth=450.0)
LENGTH = issc_tlp.WATER_DEPTH - issc_tlp.DRAUGHT
Matrices = Callable[[NDArray[np.float64]], NDArray[np.complex128]]


@cache
def platform() -> PlatformModel:
    return issc_tlp.platform(DAMPED)


def potential_waves(state: SeaState = STATE) -> SpectralWaves:
    """Waves without drag and drift, that act at the origin."""
    members = issc_members(0.0)
    return SpectralWaves(state=state, members=members, displaced_position=False, splash=False)


def gusts(heading: float, spectrum: Callable[[NDArray[np.float64], int], NDArray[np.float64]]) -> SpectralWind:
    """A wind of 30 m/s whose cross-spectra are made of the frequencies and the number of segments."""
    segments = default_segments(heading)
    count = len(segments.area)
    return SpectralWind(
        segments=segments,
        speed=np.full(count, 30.0),
        spectrum=lambda frequency: spectrum(frequency, count).astype(np.complex128),
        heading=heading,
        air_density=1.225,
        decomposition="linear",
        highest_frequency=0.5,
    )


def flat(frequency: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """12 m²/s² per Hz, each segment by itself."""
    return np.tile(12.0 * np.eye(count), (len(frequency), 1, 1))


def slow(frequency: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Fully coherent gusts of 25 m²/s², slower than the platform."""
    density = 2.0 * 25.0 / (0.004 * np.sqrt(2.0 * np.pi)) * np.exp(-0.5 * (frequency / 0.004) ** 2)
    return np.asarray(density[:, None, None] * np.ones((count, count)))


def integral(found: SpectralResponse, part: str) -> NDArray[np.float64]:
    """Variances of the six positions by a part."""
    return np.array([band_integral(found.frequency, each) for each in found.contributions[part].T])


# Waves


def closed_form(found: SpectralResponse, state: SeaState) -> NDArray[np.float64]:
    """Variances of H X sqrt(S) by Simpson's rule, of matrices put together here."""
    model = platform()
    stiffness = tangent_stiffness(model, found.mean_position)
    frequency = np.linspace(0.02, 1.1 * state.highest_frequency, 4001)
    omega = 2.0 * np.pi * frequency
    # The mean yaw of some 1e-5 rad mixes roll and pitch.
    onto = np.column_stack([generalized_force(unit, found.mean_position) for unit in np.eye(6)])
    mass, damping = (turned_matrix(each, found.mean_position[5]) for each in (model.mass, model.linear_damping))
    impedance = stiffness - omega[:, None, None] ** 2 * mass + 1j * omega[:, None, None] * damping
    density = state.density(frequency) * transition(frequency, state.highest_frequency) ** 2
    variance = np.zeros(6)
    parts = state.spread()
    for share, heading in zip(parts.share, parts.heading, strict=True):
        sea = WaveComponents(
            frequency=frequency,
            amplitude=np.ones(4001),
            phase=np.zeros(4001),
            wavenumber=wavenumber(omega, state.water_depth, state.gravity),
            heading=np.full(4001, heading),
            water_depth=state.water_depth,
            gravity=state.gravity,
        )
        force = onto @ inertia_transfer(issc_members(), sea)
        motion = np.linalg.solve(impedance, force.T[:, :, None])[:, :, 0]
        variance += simpson(share * density[:, None] * np.abs(motion) ** 2, x=frequency, axis=0)
    return variance


@pytest.mark.parametrize("directions", [1, 3])
def test_waves_alone_are_the_integral_of_transfer_functions(directions: int) -> None:
    state = replace(STATE, directions=directions)
    found = respond(SpectralModel(platform=platform(), waves=potential_waves(state)))
    expected = closed_form(found, state)
    # The mean position is that of the setdown that the motion leaves, and nearly that of rest.
    assert np.abs(found.mean_position[[0, 1]]).max() < 1e-2
    assert -0.01 < found.mean_position[2] < 0.0
    np.testing.assert_allclose(integral(found, "waves"), expected, rtol=1e-6)
    assert np.all(expected > 0.0)
    # Second order is in the tethers alone, and small: in surge and sway there is next to none.
    assert set(found.contributions) == {"waves", "tethers", "all second order", PRODUCTS}
    assert np.all(integral(found, "all second order")[:2] < 1e-3 * expected[:2])


def test_long_crested_seas_of_a_spread_one_add() -> None:
    """Whatever their directions, each by its own share."""
    state = replace(STATE, directions=2, spreading_exponent=5.0)
    parts = state.spread()
    whole = integral(respond(SpectralModel(platform=platform(), waves=potential_waves(state))), "waves")
    single = [
        integral(
            respond(SpectralModel(platform=platform(), waves=potential_waves(replace(STATE, heading=at)))), "waves"
        )
        for at in parts.heading
    ]
    # The mean positions differ by millimetres of setdown.
    np.testing.assert_allclose(whole, parts.share @ np.array(single), rtol=1e-4)


# Wind and current


@pytest.mark.parametrize(("degree", "heading"), [(0, 0.0), (1, 1.1), (5, 0.5)])
def test_white_noise_on_one_degree_of_freedom(degree: int, heading: float) -> None:
    """Variance G / (4 c k) of the force's one-sided spectrum G, the damping with that of the wind."""
    free = np.arange(6) == degree
    model, wind = replace(platform(), free=free), gusts(heading, flat)
    found = respond(SpectralModel(platform=model, wind=wind))
    pose = found.mean_position
    transformation, shown, along = turned_segments(wind.segments, heading, float(pose[5]))
    factor = 0.5 * 1.225 * wind.segments.area * wind.segments.shape_coefficient * shown * 2.0 * 30.0
    force = np.sum((factor * transformation[:, degree]) ** 2) * 12.0
    damping = model.linear_damping[degree, degree] + np.sum(factor * transformation[:, degree] * along[:, degree])
    variance = np.full(len(wind.speed), 12.0 * 0.5)  # m²/s², of 12 m²/s² per Hz up to 0.5 Hz
    step, stiffness = 1e-4, tangent_stiffness(model, pose)[degree, degree]
    if degree == 5:
        ahead, behind = (
            mean_force(wind.segments, wind.speed, variance, heading, 1.225, pose[5] + change)[5]
            for change in (step, -step)
        )
        stiffness -= (ahead - behind) / (2.0 * step)
    expected = force / (4.0 * damping * stiffness)
    # Above 0.5 Hz lie 1e-5 of it; steps of half of the width of the peak leave as little.
    np.testing.assert_allclose(integral(found, "wind")[degree], expected, rtol=5e-4)
    assert found.modes[0].damping_ratio == pytest.approx(
        0.5 * damping / np.sqrt(stiffness * model.mass[degree, degree]), rel=1e-4
    )
    assert len(found.modes) == 1
    # What is held has neither motion nor spectrum, in any of its quantities.
    for i, name in enumerate(DEGREES_OF_FREEDOM):
        for kind in ("position", "velocity", "acceleration"):
            spread = found.quantities[f"{kind}.{name}"].spread()
            assert (spread > 0.0) == (i == degree)
    np.testing.assert_array_equal(pose[~free], 0.0)


def test_current_and_steady_wind_alone_move_the_platform_to_rest() -> None:
    current = power_law_current(1.1, 0.9, 450.0)
    calm = SpectralWaves(state=replace(STATE, significant_height=0.0), members=issc_members(), current=current)
    pull = mean_current_force(issc_members(), current=current)
    found = respond(SpectralModel(platform=platform(), waves=calm))
    expected = static_equilibrium(platform(), pull)
    np.testing.assert_allclose(found.mean_position, expected, atol=1e-8)
    steady = gusts(0.3, lambda frequency, count: np.zeros((len(frequency), count, count)))

    def push(yaw: float) -> NDArray[np.float64]:
        blow = mean_force(steady.segments, steady.speed, np.zeros(len(steady.speed)), 0.3, 1.225, yaw)
        return np.asarray(pull + blow)

    external = np.array([1e5, 0.0, 0.0, 0.0, 0.0, 1e7])
    both = respond(SpectralModel(platform=platform(), waves=calm, wind=steady, external=external))
    expected = static_equilibrium(platform(), lambda yaw: push(yaw) + external)
    # Yaw is found by a slope over 1e-3 rad, again until it changes by 1e-4 of its size: then to its square.
    np.testing.assert_allclose(both.mean_position, expected, atol=1e-7)
    for quantity in both.quantities.values():
        assert quantity.spread() <= 1e-9 * max(1.0, abs(quantity.mean))
    load = np.sum([each for name, each in both.mean_loads.items() if name != "tethers"], axis=0)
    np.testing.assert_allclose(load, push(float(expected[5])) + external, rtol=1e-4)


@cache
def blown() -> SpectralResponse:
    return respond(SpectralModel(platform=platform(), wind=gusts(0.0, slow)))


def test_setdown_of_a_platform_in_wind() -> None:
    """Tethers that keep their length L: z = -(x² + y²) / (2 L), mean, spectra and skewness.

    What the tethers give beside that, the heave stiffness of the water plane over that of the tethers (1 %), the
    stretch under T x²/(2 L²) (1 %), x/L of the second order (x²/L² = 2e-3) and pitch, stay below 3 %.
    """
    found = blown()
    surge, heave = found.quantities["position.surge"], found.quantities["position.heave"]
    offset, variance = surge.mean, surge.spread() ** 2
    assert offset > 5.0
    assert surge.spread() > 1.0
    assert heave.mean == pytest.approx(-(offset**2 + variance) / (2.0 * LENGTH), rel=0.03)
    # Slow motion, which heave follows: linear in surge, and its square.
    linear, square = integral(found, "wind")[2], integral(found, PRODUCTS)[2]
    alone = integral(found, "wind")[0]
    assert linear == pytest.approx((offset / LENGTH) ** 2 * alone, rel=0.05)
    assert square == pytest.approx(alone**2 / (2.0 * LENGTH**2), rel=0.08)
    assert heave.spread() ** 2 == pytest.approx(linear + square, rel=1e-6)
    ratio = found.contributions["wind"][:40, 2] / found.contributions["wind"][:40, 0]
    np.testing.assert_allclose(ratio, (offset / LENGTH) ** 2, rtol=0.06)
    # Cumulants of a x + b x² with a = offset / L, b = 1 / (2 L), of the sign of the setdown.
    b = 0.5
    second = offset**2 * alone + 2.0 * b**2 * alone**2
    third = 6.0 * offset**2 * b * alone**2 + 8.0 * b**3 * alone**3
    fourth = 48.0 * offset**2 * b**2 * alone**3 + 48.0 * b**4 * alone**4
    assert heave.skewness == pytest.approx(-third / second**1.5, rel=0.03)
    assert heave.excess_kurtosis == pytest.approx(fourth / second**2, rel=0.06)
    assert heave.skewness < -0.1
    assert abs(surge.skewness) < 0.1


def test_a_finer_step_changes_next_to_nothing() -> None:
    model = SpectralModel(platform=platform(), wind=gusts(0.0, slow))
    finer = respond(model, step=0.4 * FREQUENCY_STEP, tolerance=1e-8)
    assert finer.frequency[1] == pytest.approx(0.4 * FREQUENCY_STEP)
    for name in ("position.surge", "position.heave", "tendon_tension[1]"):
        one, other = blown().quantities[name], finer.quantities[name]
        assert one.mean == pytest.approx(other.mean, rel=1e-3)
        assert one.spread() == pytest.approx(other.spread(), rel=2e-3)


def test_a_narrow_mode_makes_the_steps_shorter() -> None:
    """Half of its width, damping ratio over period, is resolved by one and a half steps."""
    model = issc_tlp.platform((0.008, 0.05, 0.03, 0.03, 0.03, 0.05))
    wind = gusts(0.0, slow)
    wind = replace(wind, air_density=0.05)  # which damps little
    found = respond(SpectralModel(platform=model, wind=wind))
    narrow = min(mode.damping_ratio / mode.period for mode in found.modes)
    assert found.frequency[1] < FREQUENCY_STEP
    assert found.frequency[1] <= narrow / 1.5 * 1.12


# Refusals


def test_a_platform_without_damping_has_no_stationary_response() -> None:
    bare = issc_tlp.platform((0.0, 0.0, 0.02, 0.02, 0.02, 0.05))
    with pytest.raises(SolverError, match=r"mode of (surge|sway), .* no stationary response"):
        respond(SpectralModel(platform=bare, waves=potential_waves()))


def test_a_platform_adrift_is_refused() -> None:
    tendons = without_lost(platform().tendons, np.zeros(12, dtype=np.bool_))
    adrift = replace(platform(), tendons=tendons, linear_damping=1e6 * np.eye(6))
    with pytest.raises(SolverError, match="frequency domain: "):
        respond(SpectralModel(platform=adrift, waves=potential_waves()))


def test_drift_damping_below_zero_is_told() -> None:
    damping = np.zeros((6, 6))
    damping[0, 0] = -3.0 * platform().linear_damping[0, 0]
    waves = replace(potential_waves(), drift_damping=damping)
    with pytest.raises(SolverError, match=r"mode of surge, .* look at wave drift damping"):
        respond(SpectralModel(platform=platform(), waves=waves))


def test_a_tendon_that_slackens_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tlpsim.loads.spectral.response.SLACK", 8.0)
    high = replace(potential_waves(), state=replace(potential_waves().state, significant_height=25.0))
    with pytest.warns(RuntimeWarning, match=r"tendon_tension\[7\] has a mean of 6\.8 times .* slackens"):
        respond(SpectralModel(platform=platform(), waves=high))
