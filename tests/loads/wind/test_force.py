from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.force import Segments, WindLoads, default_segments, mean_force, wind_loads

FloatArray = NDArray[np.float64]


def steady(segments: Segments, speed: FloatArray, fluctuation: FloatArray, heading: float) -> WindLoads:
    """Wind loads in a wind that does not change."""
    field = SimpleNamespace(points=SimpleNamespace(speed=speed), fluctuation=lambda time: fluctuation)
    return WindLoads(segments=segments, field=field, heading=heading, air_density=1.2)  # type: ignore[arg-type]


def test_force_and_moment_on_one_segment() -> None:
    segments = Segments(
        position=np.array([[3.0, -5.0, 40.0]]), area=np.array([800.0]), shape_coefficient=np.array([1.5])
    )
    loads = steady(segments, np.array([30.0]), np.array([4.0]), 0.0)
    force = loads.evaluate(0.0, np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.0)
    local = 0.5 * 1.2 * 800.0 * 1.5 * (30.0 + 4.0 - 1.5) ** 2
    # Wind toward +x at z = 40 m pitches the platform up the y axis; at y = -5 m it yaws it by +5 m times the force.
    np.testing.assert_allclose(force, local * np.array([1.0, 0.0, 0.0, 0.0, 40.0, 5.0]), rtol=1e-14)


@given(
    heading=st.floats(-np.pi, np.pi),
    yaw=st.floats(-1.0, 1.0),
    rates=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6),
    seed=st.integers(0, 1000),
)
@settings(max_examples=60, deadline=None)
def test_forces_of_turned_and_moving_segments(heading: float, yaw: float, rates: list[float], seed: int) -> None:
    generator = np.random.default_rng(seed)
    position = np.column_stack([generator.uniform(-50, 50, (4, 2)), generator.uniform(10, 60, 4)])
    segments = Segments(
        position=position, area=generator.uniform(100, 500, 4), shape_coefficient=generator.uniform(1, 2, 4)
    )
    speed, fluctuation = generator.uniform(20, 30, 4), generator.normal(0, 3, 4)
    velocity = np.array(rates)
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    turn = Rotation.from_euler("z", yaw)
    # Rates of roll and pitch turn about axes that the yaw has turned.
    spin = turn.apply(np.array([velocity[3], velocity[4], 0.0])) + np.array([0.0, 0.0, velocity[5]])
    expected = np.zeros(6)
    for m in range(4):
        arm = turn.apply(position[m])
        along = direction @ (velocity[:3] + np.cross(spin, arm))
        relative = speed[m] + fluctuation[m] - along
        local = 0.6 * segments.area[m] * segments.shape_coefficient[m] * relative * abs(relative) * direction
        expected += np.concatenate([local, np.cross(arm, local)])
    force = steady(segments, speed, fluctuation, heading).evaluate(0.0, velocity, yaw)
    np.testing.assert_allclose(force, expected, rtol=1e-9, atol=1e-6 * np.abs(expected).max())


def test_aerodynamic_damping_is_that_of_the_expansion() -> None:
    # Fig. 2 of the paper: dF/dX' = -sum 2 D U T T^T. Central differences are exact for a square.
    segments = default_segments(0.7)
    speed = np.linspace(25.0, 30.0, 6)
    loads = steady(segments, speed, np.zeros(6), 0.7)
    direction = np.tile([np.cos(0.7), np.sin(0.7), 0.0], (6, 1))
    transformation = np.hstack([direction, np.cross(segments.position, direction)])
    drag = 0.6 * segments.area * segments.shape_coefficient
    damping = transformation.T @ ((2.0 * drag * speed)[:, None] * transformation)
    step = 1e-3
    slope = np.column_stack(
        [
            (loads.evaluate(0.0, -step * unit, 0.0) - loads.evaluate(0.0, step * unit, 0.0)) / (2 * step)
            for unit in np.eye(6)
        ]
    )
    np.testing.assert_allclose(slope, damping, atol=1e-7 * np.abs(damping).max())


def test_mean_force_on_one_segment() -> None:
    segments = Segments(
        position=np.array([[0.0, 8.0, 30.0]]), area=np.array([500.0]), shape_coefficient=np.array([1.2])
    )
    force = mean_force(segments, np.array([20.0]), np.array([9.0]), np.pi / 2, air_density=1.25)
    local = 0.5 * 1.25 * 500.0 * 1.2 * (400.0 + 9.0)
    # Toward +y: roll by -z F.
    np.testing.assert_allclose(force, local * np.array([0.0, 1.0, 0.0, -30.0, 0.0, 0.0]), atol=1e-6 * local)


def test_time_average_of_the_force_is_the_mean_force() -> None:
    segments = Segments(
        position=np.array([[0.0, 0.0, 30.0]]), area=np.array([500.0]), shape_coefficient=np.array([1.2])
    )
    loads = wind_loads(speed_10=25.0, heading=0.0, segments=segments, seed=11)
    count = 20_000
    at_rest = np.zeros(6)
    average = np.mean([loads.evaluate(float(n), at_rest, 0.0)[0] for n in range(count)])
    speed = loads.field.points.speed[0]
    drag = 0.5 * 1.225 * 500.0 * 1.2
    # The record's own mean speed, which varies most, is taken out of the linear term; what is left of the average is
    # U² + mean(u²), whose standard deviation is sqrt(int S² df / T).
    drift = np.mean([loads.wind_speed(float(n)) for n in range(count)]) - speed
    frequency = np.linspace(0.0, 0.5, 2001)
    density = loads.field.spectrum(frequency)[:, 0, 0]
    deviation = drag * np.sqrt(np.trapezoid(density**2, frequency) / count)
    remaining = average - 2.0 * drag * speed * drift
    assert abs(remaining - loads.mean_force()[0]) < 4.0 * deviation
    # The band is sharp enough to see the share of the variance in the mean.
    assert 4.0 * deviation < 0.25 * drag * loads.field.sampled_variance[0]


def test_default_segments_yaw_the_platform_positively() -> None:
    loads = wind_loads(speed_10=25.0, heading=0.4)
    assert loads.segments.area.sum() == pytest.approx(3000.0)
    force = loads.mean_force()
    # Equal forces at one height would act 12 m to the right of the centre.
    assert force[5] == pytest.approx(12.0 * np.hypot(force[0], force[1]), rel=1e-12)


def test_wind_speed_is_the_area_weighted_mean() -> None:
    segments = Segments(
        position=np.array([[0.0, 0.0, 20.0], [0.0, 0.0, 40.0]]),
        area=np.array([300.0, 100.0]),
        shape_coefficient=np.ones(2),
    )
    loads = steady(segments, np.array([20.0, 24.0]), np.array([1.0, -3.0]), 0.0)
    assert loads.wind_speed(0.0) == pytest.approx(0.75 * 21.0 + 0.25 * 21.0)


def test_restored_state_repeats_forces() -> None:
    loads = wind_loads(speed_10=25.0, heading=0.4, seed=2)
    velocity = np.linspace(-0.1, 0.1, 6)
    loads.evaluate(10.0, velocity, 0.0)
    state = loads.get_state()
    expected = [loads.evaluate(10.0 + 0.5 * n, velocity, 0.01) for n in range(100)]
    loads.set_state(state)
    np.testing.assert_array_equal([loads.evaluate(10.0 + 0.5 * n, velocity, 0.01) for n in range(100)], expected)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="must have the shapes"):
        Segments(position=np.zeros((2, 3)), area=np.ones(3), shape_coefficient=np.ones(3))
    with pytest.raises(ScenarioError, match="height of a wind segment"):
        Segments(position=np.zeros((1, 3)), area=np.ones(1), shape_coefficient=np.ones(1))
    with pytest.raises(ScenarioError, match="a position is not finite"):
        Segments(position=np.full((1, 3), np.nan), area=np.ones(1), shape_coefficient=np.ones(1))
    with pytest.raises(ScenarioError, match="area of a wind segment"):
        Segments(position=np.array([[0.0, 0.0, 9.0]]), area=-np.ones(1), shape_coefficient=np.ones(1))
    with pytest.raises(ScenarioError, match="air density is 0"):
        wind_loads(speed_10=20.0, heading=0.0, air_density=0.0)
    with pytest.raises(ScenarioError, match="wind heading is inf"):
        wind_loads(speed_10=20.0, heading=float("inf"))
