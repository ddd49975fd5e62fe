"""Kinematics in a regular wave against closed forms, and in the filtered sea against theory and each other."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.differentiation import derivative_gain
from tlpsim.loads.waves.airy import velocity_transfer, wavenumber
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import regular_wave
from tlpsim.loads.waves.kinematics import ACCELERATION, kinematics
from tlpsim.loads.waves.sea import SeaState

AMPLITUDE, PERIOD, DEPTH = 3.0, 9.0, 40.0
WAVE = regular_wave(amplitude=AMPLITUDE, period=PERIOD, heading=0.0, water_depth=DEPTH)
K, OMEGA = WAVE.wavenumber[0], 2.0 * np.pi / PERIOD


def at(heights: list[float], x: float = 0.0) -> NDArray[np.float64]:
    return np.array([[x, 0.0, z] for z in heights])


def test_below_the_surface_the_closed_form_of_finite_depth() -> None:
    time, x, z = 2.2, 31.0, -12.0
    found = kinematics(WAVE, time, at([z], x))
    angle = OMEGA * time - K * x
    along = AMPLITUDE * OMEGA * np.cosh(K * (z + DEPTH)) / np.sinh(K * DEPTH)
    up = AMPLITUDE * OMEGA * np.sinh(K * (z + DEPTH)) / np.sinh(K * DEPTH)
    assert found.elevation[0] == pytest.approx(AMPLITUDE * np.cos(angle))
    np.testing.assert_allclose(found.velocity[0], [along * np.cos(angle), 0.0, -up * np.sin(angle)], atol=1e-12)
    expected = [-OMEGA * along * np.sin(angle), 0.0, -OMEGA * up * np.cos(angle)]
    np.testing.assert_allclose(found.acceleration[0], expected, atol=1e-12)


def test_stretching_under_a_crest_in_closed_form() -> None:
    scale = AMPLITUDE * OMEGA / np.sinh(K * DEPTH)
    points = at([2.0])
    none, vertical, linear, wheeler = (
        kinematics(WAVE, 0.0, points, stretching=name).velocity[0, 0]
        for name in ("none", "vertical", "linear", "wheeler")
    )
    assert none == 0.0
    assert vertical == pytest.approx(scale * np.cosh(K * DEPTH))
    assert linear == pytest.approx(scale * (np.cosh(K * DEPTH) + 2.0 * K * np.sinh(K * DEPTH)))
    level = DEPTH * (2.0 - AMPLITUDE) / (DEPTH + AMPLITUDE)
    assert wheeler == pytest.approx(scale * np.cosh(K * (level + DEPTH)))


def test_vertical_velocity_on_the_stretched_surface_is_that_of_the_surface() -> None:
    # Kinematic condition of linear theory, d eta / dt = w at the level z = 0, which Wheeler puts on the surface.
    for time in (0.7, 2.0, 5.1):
        elevation = kinematics(WAVE, time, at([-1.0])).elevation[0]
        found = kinematics(WAVE, time, at([elevation]), stretching="wheeler")
        assert found.velocity[0, 2] == pytest.approx(-AMPLITUDE * OMEGA * np.sin(OMEGA * time), abs=1e-9)


def test_above_the_surface_it_is_dry() -> None:
    found = kinematics(WAVE, PERIOD / 2, at([-2.0, 1.0]), stretching="wheeler")
    assert found.wet.tolist() == [False, False]
    np.testing.assert_array_equal(found.velocity, 0.0)
    np.testing.assert_array_equal(found.acceleration, 0.0)


@pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
def test_differentiated_acceleration_has_the_gain_of_the_difference(step: float) -> None:
    points = at([-5.0, -20.0], 17.0)
    exact = kinematics(WAVE, 3.3, points).acceleration
    found = kinematics(WAVE, 3.3, points, acceleration="differentiation", sampling_step=step).acceleration
    np.testing.assert_allclose(found, derivative_gain(1.0 / PERIOD, step, 6) * exact, rtol=1e-9, atol=1e-12)


def test_hybrid_acceleration_follows_the_wave() -> None:
    # Quintic interpolation of 0.111 Hz at 0.5 s and the image's derivative: 1e-5; the difference adds nothing.
    points = at([-5.0, -20.0], 17.0)
    exact = kinematics(WAVE, 3.3, points).acceleration
    found = kinematics(WAVE, 3.3, points, acceleration="hybrid").acceleration
    np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-4)


@pytest.fixture(scope="module")
def sea() -> ArmaSea:
    state = SeaState(
        spectrum="jonswap",
        significant_height=8.0,
        peak_period=12.0,
        heading=0.3,
        water_depth=DEPTH,
        directions=3,
        spreading_exponent=6.0,
    )
    return ArmaSea(state, reach=60.0, seed=2)


POINTS = np.array([[0.0, 0.0, -3.0], [43.0, -20.0, -15.0], [-43.0, 10.0, -35.0]])


def test_filtered_kinematics_have_the_theoretical_variance(sea: ArmaSea) -> None:
    state = sea.state
    times = np.arange(0.0, 6000.0, 1.0)
    found = [kinematics(sea, time, POINTS) for time in times]
    frequency = (np.arange(700) + 0.5) * 0.35 / 700
    omega = 2.0 * np.pi * frequency
    number = wavenumber(omega, DEPTH)
    variance = np.zeros((2, 3, 3))
    parts = state.spread()
    for heading, share in zip(parts.heading, parts.share, strict=True):
        gain = np.abs(velocity_transfer(omega, number, heading, DEPTH, POINTS)) ** 2
        density = share * state.density(frequency) * 0.35 / 700
        variance += np.array([gain @ density, gain @ (density * omega**2)])
    for k, name in enumerate(("velocity", "acceleration")):
        record = np.array([getattr(one, name) for one in found])
        # 6000 s hold some 500 independent values: 3 to 5 % of a standard deviation; three of them.
        np.testing.assert_allclose(record.std(axis=0), np.sqrt(variance[k]), rtol=0.12)


@pytest.mark.parametrize("model", [name for name in ACCELERATION if name != "convolution"])
def test_models_of_the_acceleration_agree_in_the_filtered_sea(sea: ArmaSea, model: str) -> None:
    times = np.arange(100.0, 300.0, 1.7)
    exact = np.array([kinematics(sea, time, POINTS).acceleration for time in times])
    found = np.array([kinematics(sea, time, POINTS, acceleration=model).acceleration for time in times])
    # The sixth-order difference at 0.5 s loses 0.04 % at 0.2 Hz and 0.9 % at 0.35 Hz, the end of the band. Near the
    # surface the kernels of neighbouring samples add their own errors of 5e-4.
    error = np.sqrt(np.mean((found - exact) ** 2, axis=0)) / exact.std(axis=0)
    assert error.max() < 2e-3


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="acceleration 'hybird' is not known; did you mean 'hybrid'"):
        kinematics(WAVE, 0.0, at([-1.0]), acceleration="hybird")
    with pytest.raises(ScenarioError, match="below the sea bed"):
        kinematics(WAVE, 0.0, at([-50.0]))
    with pytest.raises(ScenarioError, match="sampling step of the wave kinematics is 0"):
        kinematics(WAVE, 0.0, at([-1.0]), sampling_step=0.0)
