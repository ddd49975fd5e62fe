from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.field import Gusts, WindField
from tlpsim.loads.wind.force import DECOMPOSITIONS, WindLoads, mean_force, wind_loads
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.segments import (
    Boxes,
    Segments,
    default_segments,
    projected_breadth,
    projected_segments,
    with_constant_areas,
)

FloatArray = NDArray[np.float64]


def steady(
    segments: Segments, speed: FloatArray, fluctuation: FloatArray, heading: float, decomposition: str = "full"
) -> WindLoads:
    """Wind loads in a wind that does not change, of a variance of 4 m²/s²."""
    field = SimpleNamespace(
        speed=speed, sampled_variance=np.full(len(speed), 4.0), fluctuation=lambda time: fluctuation
    )
    return WindLoads(
        segments=segments,
        field=field,  # type: ignore[arg-type]
        heading=heading,
        air_density=1.2,
        decomposition=decomposition,
    )


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
    plan = generator.uniform(10, 90, (4, 2))
    plan[2:] = 0.0
    segments = Segments(
        position=position, area=generator.uniform(100, 500, 4), shape_coefficient=generator.uniform(1, 2, 4), plan=plan
    )
    area = segments.area.copy()
    area[:2] *= projected_breadth(plan[:2], heading - yaw) / projected_breadth(plan[:2], heading)
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
        local = 0.6 * area[m] * segments.shape_coefficient[m] * relative * abs(relative) * direction
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
    np.testing.assert_allclose(loads.damping_matrix(), damping, rtol=1e-12, atol=1e-6)


@given(
    heading=st.floats(-np.pi, np.pi),
    yaw=st.floats(-0.5, 0.5),
    rates=st.lists(st.floats(-0.05, 0.05), min_size=6, max_size=6),
    seed=st.integers(0, 1000),
)
@settings(max_examples=40, deadline=None)
def test_the_expansion_is_the_full_force_less_the_products_that_it_leaves_out(
    heading: float, yaw: float, rates: list[float], seed: int
) -> None:
    generator = np.random.default_rng(seed)
    segments = default_segments(heading)
    speed, fluctuation, velocity = generator.uniform(25, 30, 6), generator.normal(0, 2, 6), np.array(rates)
    loads = {
        name: steady(segments, speed, fluctuation, heading, name).evaluate(0.0, velocity, yaw)
        for name in DECOMPOSITIONS
    }

    # D (v² - 2 u v): eq. (1) in a wind of speed u, less itself on a platform at rest. It must not reverse, so 30 m/s
    # is added to u and taken out again.
    def square(wind: FloatArray, moves: FloatArray) -> FloatArray:
        return steady(segments, wind, np.zeros(6), heading).evaluate(0.0, moves, yaw)

    still = np.zeros(6)
    left_out = square(fluctuation + 30.0, velocity) - square(fluctuation + 30.0, still)
    left_out += steady(segments, np.full(6, 30.0), np.zeros(6), heading).damping_matrix(yaw) @ _spin(velocity, yaw)
    scale = np.abs(loads["full"]).max()
    np.testing.assert_allclose(loads["full"] - loads["expanded"], left_out, atol=1e-9 * scale)
    parts = steady(segments, speed, fluctuation, heading).parts(0.0, velocity, yaw)
    linear = parts.mean + parts.exciting + parts.damping
    np.testing.assert_allclose(linear, loads["linear"], atol=1e-12 * scale)
    np.testing.assert_allclose(linear + parts.second_order, loads["expanded"], atol=1e-12 * scale)


def _spin(velocity: FloatArray, yaw: float) -> FloatArray:
    """Velocity and angular velocity of a platform from the rates of its degrees of freedom."""
    turn = Rotation.from_euler("z", yaw)
    return np.concatenate([velocity[:3], turn.apply([velocity[3], velocity[4], velocity[5]])])


DECK = Boxes(position=[[5.0, -8.0, 40.0]], size=[[90.0, 60.0, 12.0]], shape_coefficient=[1.2])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("heading", "yaw", "breadth"),
    [
        (0.0, 0.0, 60.0),
        (0.0, np.pi / 2, 90.0),
        (0.0, -np.pi / 2, 90.0),
        (np.pi / 2, -np.pi / 2, 60.0),
        (0.0, np.pi, 60.0),
        (0.3, 0.3 - 0.5, 90.0 * np.sin(0.5) + 60.0 * np.cos(0.5)),
    ],
)
def test_a_turned_box_shows_the_wind_another_face(heading: float, yaw: float, breadth: float) -> None:
    segments = projected_segments(DECK, heading)
    count = len(segments.area)
    loads = steady(segments, np.full(count, 20.0), np.full(count, 3.0), heading)
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    # Pieces turn about the reference point with the box, so that the force stays at the centre of the box.
    force = 0.6 * 1.2 * breadth * 12.0 * 23.0**2 * direction
    moment = np.cross(Rotation.from_euler("z", yaw).apply([5.0, -8.0, 40.0]), force)
    found = loads.evaluate(0.0, np.zeros(6), yaw)
    np.testing.assert_allclose(found, [*force, *moment], rtol=1e-12, atol=1e-9 * np.abs(moment).max())
    # With the variance of 4 m²/s² of the record the mean is that of 20² + 4.
    np.testing.assert_allclose(loads.mean_force(yaw), found * (404.0 / 529.0), rtol=1e-12, atol=1e-3)
    parts = loads.parts(0.0, np.zeros(6), yaw)
    np.testing.assert_allclose(parts.mean, loads.mean_force(yaw), rtol=1e-12)
    np.testing.assert_allclose(parts.mean + parts.exciting + parts.second_order, found, rtol=1e-12, atol=1e-3)


def test_a_square_box_shows_root_two_more_when_turned_by_an_eighth() -> None:
    square = projected_segments(
        Boxes(position=np.array([[0.0, 0.0, 40.0]]), size=np.array([[80.0, 80.0, 10.0]]), shape_coefficient=np.ones(1)),
        0.0,
    )
    loads = steady(square, np.full(3, 25.0), np.zeros(3), 0.0)
    ahead, turned = (loads.evaluate(0.0, np.zeros(6), yaw)[0] for yaw in (0.0, np.pi / 4))
    assert turned / ahead == pytest.approx(np.sqrt(2.0), rel=1e-12)


def test_areas_can_be_kept_at_any_yaw() -> None:
    turning = projected_segments(DECK, 0.3)
    table = Segments(position=turning.position, area=turning.area, shape_coefficient=turning.shape_coefficient)
    count = len(table.area)
    speed, gust, velocity = np.linspace(20.0, 25.0, count), np.linspace(-3.0, 3.0, count), np.linspace(-0.2, 0.2, 6)
    tables = (table, with_constant_areas(turning), turning)
    forces = [steady(each, speed, gust, 0.3).evaluate(0.0, velocity, 0.2) for each in tables]
    np.testing.assert_array_equal(forces[1], forces[0])
    ratio = (projected_breadth(DECK.size, 0.1) / projected_breadth(DECK.size, 0.3))[0]
    np.testing.assert_allclose(forces[2], ratio * forces[0], rtol=1e-12)
    assert ratio < 0.9


def test_damping_of_a_turned_platform_is_the_slope_of_the_force() -> None:
    """Central differences, exact for a square, in velocity and angular velocity."""
    yaw, heading, step = 0.3, 0.7, 1e-3
    segments = projected_segments(DECK, heading)
    count = len(segments.area)
    loads = steady(segments, np.linspace(25.0, 30.0, count), np.zeros(count), heading)
    rates = Rotation.from_euler("z", -yaw).apply(np.eye(3))
    units = np.block([[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), rates]])
    forces = [[loads.evaluate(0.0, sign * step * unit, yaw) for sign in (-1.0, 1.0)] for unit in units]
    slope = np.column_stack([(back - forth) / (2.0 * step) for back, forth in forces])
    damping = loads.damping_matrix(yaw)
    np.testing.assert_allclose(slope, damping, rtol=0.0, atol=1e-8 * np.abs(damping).max())
    np.testing.assert_allclose(damping, damping.T, rtol=1e-12)


def test_what_the_expansion_leaves_out_of_a_storm_is_small() -> None:
    """An hour in 27 m/s on a platform that surges by 1.5 m in 100 s and 1 m in 14 s, and yaws by 0.02 rad in 80 s.

    "full" - "expanded" is D (v² - 2 u v) at every time. With v of 0.27 m/s rms and U of 31 m/s its mean is v²/U²,
    8e-5 of the force, and 2 u v of a record of an hour, as much again. Of the spread 2 D U u it can be v/U, 9e-3, at
    most, and is far less where u and v are independent. "linear" lacks u² - sigma²: a mean of I² times the error of
    the variance in the record, 1e-3; of the spread I²/4 and half the skewness of the record times I, 0.3 by 0.1 / 2.
    """
    heading = 0.6
    loads = {
        name: wind_loads(heading=heading, profile=Profile(speed_10=26.9), gusts=Gusts(seed=5), decomposition=name)
        for name in DECOMPOSITIONS
    }
    full, segments = loads["full"], default_segments(heading)
    drag = 0.5 * 1.225 * segments.area * segments.shape_coefficient
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    forces = {name: np.empty((3600, 6)) for name in loads}
    for k in range(3600):
        time = float(k)
        slow, fast, turn = (2.0 * np.pi / period for period in (100.0, 14.0, 80.0))
        velocity = np.zeros(6)
        velocity[0] = 1.5 * slow * np.cos(slow * time) + fast * np.cos(fast * time)
        velocity[5] = 0.02 * turn * np.cos(turn * time)
        yaw = 0.02 * np.sin(turn * time)
        for name, each in loads.items():
            forces[name][k] = each.evaluate(time, velocity, yaw)
        if k % 100 == 0:
            moments = np.cross(Rotation.from_euler("z", yaw).apply(segments.position.copy()), direction)
            transformation = np.hstack([np.tile(direction, (6, 1)), moments])
            along = transformation @ velocity
            left_out = drag * (along**2 - 2.0 * full.field.fluctuation(time) * along) @ transformation
            difference = forces["full"][k] - forces["expanded"][k]
            np.testing.assert_allclose(difference, left_out, rtol=0.0, atol=1e-11 * np.abs(forces["full"][k]).max())
    degrees = [0, 1, 5]
    mean = {name: force.mean(axis=0)[degrees] for name, force in forces.items()}
    spread = {name: force.std(axis=0)[degrees] for name, force in forces.items()}
    for name, (of_mean, of_spread) in {"expanded": (3e-4, 3e-3), "linear": (1e-3, 2e-2)}.items():
        assert np.abs(mean[name] / mean["full"] - 1.0).max() < of_mean, name
        assert np.abs(spread[name] / spread["full"] - 1.0).max() < of_spread, name
    assert np.all(mean["expanded"] < mean["full"])


def test_terms_of_the_expansion_on_one_segment() -> None:
    # Fig. 2 of the paper by hand, for one area of D = 0.6 x 500 x 1.2 = 360 kg/m at z = 40 m in a wind of 30 m/s.
    segments = Segments(
        position=np.array([[0.0, 0.0, 40.0]]), area=np.array([500.0]), shape_coefficient=np.array([1.2])
    )
    loads = steady(segments, np.array([30.0]), np.array([3.0]), 0.0)
    parts = loads.parts(0.0, np.array([0.5, 0.0, 0.0, 0.0, 0.01, 0.0]), 0.0)
    expected = {
        "mean": 360.0 * (900.0 + 4.0),
        "exciting": 2.0 * 360.0 * 30.0 * 3.0,
        "damping": -2.0 * 360.0 * 30.0 * (0.5 + 0.01 * 40.0),
        "second_order": 360.0 * (9.0 - 4.0),
    }
    for name, force in expected.items():
        np.testing.assert_allclose(
            getattr(parts, name), force * np.array([1.0, 0.0, 0.0, 0.0, 40.0, 0.0]), rtol=1e-12, atol=1e-9
        )


def test_still_air_resists_motion_and_nothing_else() -> None:
    segments = Segments(
        position=np.array([[0.0, 0.0, 40.0]]), area=np.array([500.0]), shape_coefficient=np.array([1.2])
    )
    loads = wind_loads(heading=0.0, profile=Profile(speed_10=0.0), segments=segments)
    np.testing.assert_array_equal(loads.evaluate(10.0, np.zeros(6), 0.1), np.zeros(6))
    np.testing.assert_array_equal(loads.mean_force(), np.zeros(6))
    assert loads.wind_speed(10.0) == 0.0
    loads.set_state(loads.get_state())
    moving = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    resistance = -0.5 * 1.225 * 500.0 * 1.2 * 4.0
    np.testing.assert_allclose(loads.evaluate(0.0, moving, 0.0)[0], resistance)
    np.testing.assert_allclose(loads.evaluate(0.0, -moving, 0.0)[0], -resistance)


def test_mean_force_on_one_segment() -> None:
    segments = Segments(
        position=np.array([[0.0, 8.0, 30.0]]), area=np.array([500.0]), shape_coefficient=np.array([1.2])
    )
    force = mean_force(segments, np.array([20.0]), np.array([9.0]), np.pi / 2, air_density=1.25)
    local = 0.5 * 1.25 * 500.0 * 1.2 * (400.0 + 9.0)
    # Toward +y: roll by -z F.
    np.testing.assert_allclose(force, local * np.array([0.0, 1.0, 0.0, -30.0, 0.0, 0.0]), atol=1e-6 * local)


@pytest.mark.parametrize(("yaw", "ratio"), [(0.0, 1.0), (0.3, np.cos(0.3) + 1.5 * np.sin(0.3))])
def test_time_average_of_the_force_is_the_mean_force(yaw: float, ratio: float) -> None:
    segments = Segments(
        position=np.array([[0.0, 0.0, 30.0]]),
        area=np.array([500.0]),
        shape_coefficient=np.array([1.2]),
        plan=np.array([[90.0, 60.0]]),
    )
    loads = wind_loads(heading=0.0, profile=Profile(speed_10=25.0), gusts=Gusts(seed=11), segments=segments)
    assert isinstance(loads.field, WindField)
    count = 20_000
    at_rest = np.zeros(6)
    average = np.mean([loads.evaluate(float(n), at_rest, yaw)[0] for n in range(count)])
    speed = loads.field.speed[0]
    drag = 0.5 * 1.225 * 500.0 * 1.2 * ratio
    # The record's own mean speed, which varies most, is taken out of the linear term; what is left of the average is
    # U² + mean(u²), whose standard deviation is sqrt(int S² df / T).
    drift = np.mean([loads.wind_speed(float(n)) for n in range(count)]) - speed
    frequency = np.linspace(0.0, 0.5, 2001)
    density = loads.field.spectrum(frequency)[:, 0, 0]
    deviation = drag * np.sqrt(np.trapezoid(density**2, frequency) / count)
    remaining = average - 2.0 * drag * speed * drift
    assert abs(remaining - loads.mean_force(yaw)[0]) < 4.0 * deviation
    # The band is sharp enough to see the share of the variance in the mean.
    assert 4.0 * deviation < 0.25 * drag * loads.field.sampled_variance[0]


def test_wind_speed_is_the_area_weighted_mean() -> None:
    segments = Segments(
        position=np.array([[0.0, 0.0, 20.0], [0.0, 0.0, 40.0]]),
        area=np.array([300.0, 100.0]),
        shape_coefficient=np.ones(2),
    )
    loads = steady(segments, np.array([20.0, 24.0]), np.array([1.0, -3.0]), 0.0)
    assert loads.wind_speed(0.0) == pytest.approx(0.75 * 21.0 + 0.25 * 21.0)


def test_restored_state_repeats_forces() -> None:
    loads = wind_loads(heading=0.4, profile=Profile(speed_10=40.0), gusts=Gusts(seed=2))
    velocity = np.linspace(-0.1, 0.1, 6)
    loads.evaluate(10.0, velocity, 0.0)
    state = loads.get_state()
    expected = [loads.evaluate(10.0 + 0.5 * n, velocity, 0.01) for n in range(100)]
    loads.set_state(state)
    np.testing.assert_array_equal([loads.evaluate(10.0 + 0.5 * n, velocity, 0.01) for n in range(100)], expected)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="air density is 0"):
        wind_loads(heading=0.0, profile=Profile(speed_10=20.0), air_density=0.0)
    with pytest.raises(ScenarioError, match="wind heading is inf"):
        wind_loads(heading=float("inf"), profile=Profile(speed_10=20.0))
    with pytest.raises(ScenarioError, match="decomposition of the wind force 'ful' is not known; did you mean 'full'"):
        wind_loads(heading=0.0, profile=Profile(speed_10=0.0), decomposition="ful")
