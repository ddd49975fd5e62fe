import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import (
    pressure_head_transfer,
    surface_velocity_gradient_transfer,
    travel,
    velocity_transfer,
    wavenumber,
)

GRAVITY = 9.80665


@given(omega=st.floats(1e-3, 20.0), depth=st.floats(0.5, 5000.0))
def test_dispersion_relation_holds(omega: float, depth: float) -> None:
    k = float(wavenumber(omega, depth))
    assert GRAVITY * k * np.tanh(k * depth) == pytest.approx(omega**2, rel=1e-12)


def test_deep_and_shallow_limits() -> None:
    assert wavenumber(0.7, np.inf) == pytest.approx(0.7**2 / GRAVITY, rel=1e-15)
    assert wavenumber(0.7, 5000.0) == pytest.approx(0.7**2 / GRAVITY, rel=1e-14)
    # omega = sqrt(g d) k (1 - (kd)²/6): kd = 0.01 here.
    depth = 10.0
    omega = 0.01 / depth * np.sqrt(GRAVITY * depth)
    assert wavenumber(omega, depth) == pytest.approx(omega / np.sqrt(GRAVITY * depth), rel=2e-5)


@pytest.mark.parametrize("depth", [12.0, 80.0])
def test_kinematics_are_the_hyperbolic_functions(depth: float) -> None:
    omega, heading = np.array([0.5, 0.9]), 0.6
    k = wavenumber(omega, depth)
    points = np.array([[3.0, -7.0, 0.0], [10.0, 4.0, -0.4 * depth], [0.0, 0.0, -depth]])
    velocity = velocity_transfer(omega, k, heading, depth, points)
    pressure = pressure_head_transfer(k, heading, depth, points)
    for p, (x, y, z) in enumerate(points):
        phasor = np.exp(-1j * k * (x * np.cos(heading) + y * np.sin(heading)))
        horizontal = omega * phasor * np.cosh(k * (z + depth)) / np.sinh(k * depth)
        np.testing.assert_allclose(velocity[p, 0], horizontal * np.cos(heading), rtol=1e-12)
        np.testing.assert_allclose(velocity[p, 1], horizontal * np.sin(heading), rtol=1e-12)
        vertical = 1j * omega * phasor * np.sinh(k * (z + depth)) / np.sinh(k * depth)
        np.testing.assert_allclose(velocity[p, 2], vertical, rtol=1e-12, atol=1e-15)
        expected = phasor * np.cosh(k * (z + depth)) / np.cosh(k * depth)
        np.testing.assert_allclose(pressure[p], expected, rtol=1e-12)


@pytest.mark.parametrize("depth", [30.0, np.inf])
def test_flow_is_free_of_divergence_and_rotation_and_obeys_the_pressure(depth: float) -> None:
    omega, heading = np.array([0.4, 0.8]), -2.1
    k = wavenumber(omega, depth)
    place, step = np.array([5.0, -3.0, -8.0]), 1e-3
    points = place + step * np.vstack([np.eye(3), -np.eye(3)])
    velocity = velocity_transfer(omega, k, heading, depth, points)
    gradient = (velocity[:3] - velocity[3:]) / (2 * step)  # [direction of change, component, wave]
    # Central differences: (k step)² / 6 is 1e-9 of the gradient, and round-off 1e-13 / step.
    scale = np.abs(gradient).max()
    np.testing.assert_allclose(np.einsum("iin->n", gradient), 0.0, atol=1e-8 * scale)
    np.testing.assert_allclose(gradient - np.swapaxes(gradient, 0, 1), 0.0, atol=1e-8 * scale)
    pressure = GRAVITY * pressure_head_transfer(k, heading, depth, points)
    acceleration = 1j * omega * velocity_transfer(omega, k, heading, depth, place[None])[0]
    np.testing.assert_allclose(-(pressure[:3] - pressure[3:]) / (2 * step), acceleration, rtol=1e-7)


def test_conditions_at_the_surface_and_the_bottom() -> None:
    omega, depth = np.array([0.3, 1.2]), 25.0
    k = wavenumber(omega, depth)
    velocity = velocity_transfer(omega, k, 0.0, depth, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -depth]]))
    np.testing.assert_allclose(velocity[0, 2], 1j * omega, rtol=1e-12)  # w = d eta / dt
    np.testing.assert_allclose(velocity[1, 2], 0.0, atol=1e-15)
    surface = pressure_head_transfer(k, 0.0, depth, np.zeros((1, 3)))
    np.testing.assert_allclose(surface, 1.0, rtol=1e-14)  # p = rho g eta


def test_very_deep_water_does_not_overflow_and_is_deep_water() -> None:
    omega = np.array([0.5, 6.0])
    points = np.array([[1.0, 2.0, -10.0], [0.0, 0.0, -3000.0]])
    k = wavenumber(omega, 5000.0)
    deep = velocity_transfer(omega, wavenumber(omega, np.inf), 0.2, np.inf, points)
    np.testing.assert_allclose(velocity_transfer(omega, k, 0.2, 5000.0, points), deep, rtol=1e-12)


@pytest.mark.parametrize("depth", [12.0, 450.0, np.inf])
def test_gradient_at_the_surface_is_the_derivative_of_the_velocity(depth: float) -> None:
    omega = np.array([0.4, 0.9, 1.6])
    number, place = wavenumber(omega, depth), np.array([[13.0, -7.0]])
    found = surface_velocity_gradient_transfer(omega, number, 0.7, depth, place)
    step = 1e-4
    heights = [velocity_transfer(omega, number, 0.7, depth, np.array([[13.0, -7.0, -k * step]])) for k in range(3)]
    # One-sided difference of second order, for there is no water above: error k³ step² / 3.
    np.testing.assert_allclose(found, (1.5 * heights[0] - 2.0 * heights[1] + 0.5 * heights[2]) / step, atol=1e-7)


def test_travel_advances_one_period_in_a_wavelength() -> None:
    k = np.array([0.02])
    length = 2 * np.pi / 0.02
    phase = travel(k, 0.5, np.array([length * np.cos(0.5)]), np.array([length * np.sin(0.5)]))
    np.testing.assert_allclose(phase, 1.0, atol=1e-12)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="angular frequency of a wave"):
        wavenumber(np.array([0.5, 0.0]), 100.0)
    with pytest.raises(ScenarioError, match=r"water depth is -5.0 m; it must be > 0"):
        wavenumber(0.5, -5.0)
    with pytest.raises(ScenarioError, match="water depth is nan"):
        wavenumber(0.5, float("nan"))
    with pytest.raises(ScenarioError, match=r"z = 1.0 m; it must be from -10.0 to 0 m"):
        velocity_transfer(np.ones(1), np.ones(1), 0.0, 10.0, np.array([[0.0, 0.0, 1.0]]))
