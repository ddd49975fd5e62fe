"""The wind's force, linear about a mean yaw, against that of the time domain."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.platform.body import angular_velocity
from tlpsim.loads.spectral.aerodynamic import linear_wind
from tlpsim.loads.spectral.model import SpectralWind
from tlpsim.loads.wind.force import WindLoads, mean_force
from tlpsim.loads.wind.segments import default_segments

HEADING = 0.6
SEGMENTS = default_segments(HEADING)
COUNT = len(SEGMENTS.area)
SPEED = 30.0 + 0.1 * np.arange(COUNT)
VARIANCE = 20.0 + 0.3 * np.arange(COUNT)
YAWS = [0.0, 0.02, -0.3, 1.1]


class Field:
    """Fluctuations that are given."""

    def __init__(self, speed: NDArray[np.float64], variance: NDArray[np.float64], gust: NDArray[np.float64]) -> None:
        self.speed, self.sampled_variance, self.gust = speed, variance, gust

    def fluctuation(self, time: float) -> NDArray[np.float64]:
        return self.gust


def wind(decomposition: str, speed: NDArray[np.float64] = SPEED) -> SpectralWind:
    return SpectralWind(
        segments=SEGMENTS,
        speed=speed,
        spectrum=lambda frequency: np.zeros((len(frequency), COUNT, COUNT)),
        heading=HEADING,
        air_density=1.225,
        decomposition=decomposition,
        highest_frequency=0.5,
    )


def loads(decomposition: str, gust: NDArray[np.float64], speed: NDArray[np.float64] = SPEED) -> WindLoads:
    return WindLoads(
        segments=SEGMENTS,
        field=Field(speed, VARIANCE, gust),  # type: ignore[arg-type]
        heading=HEADING,
        air_density=1.225,
        decomposition=decomposition,
    )


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize("decomposition", ["linear", "expanded"])
def test_mean_is_that_of_the_force_at_any_yaw(decomposition: str, yaw: float) -> None:
    found = linear_wind(wind(decomposition), yaw, VARIANCE, 2.0 * VARIANCE)
    expected = mean_force(SEGMENTS, SPEED, VARIANCE, HEADING, 1.225, yaw)
    np.testing.assert_allclose(found.mean, expected, rtol=1e-12)
    step = 1e-4
    ahead, behind = (mean_force(SEGMENTS, SPEED, VARIANCE, HEADING, 1.225, yaw + d) for d in (step, -step))
    slope = (ahead - behind) / (2.0 * step)
    np.testing.assert_allclose(found.yaw_slope, slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("yaw", YAWS)
def test_damping_is_that_of_the_force_on_the_rates(yaw: float) -> None:
    """The loads' matrix takes the angular velocity, and the rates of roll and pitch turn into it with yaw."""
    found = linear_wind(wind("linear"), yaw, VARIANCE, VARIANCE)
    pose = np.array([0.0, 0.0, 0.0, 0.0, 0.0, yaw])
    rates = np.column_stack([np.concatenate([unit[:3], angular_velocity(pose, unit)]) for unit in np.eye(6)])
    expected = loads("linear", np.zeros(COUNT)).damping_matrix(yaw) @ rates
    np.testing.assert_allclose(found.damping, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    rng = np.random.default_rng(2)
    gust, velocity = rng.normal(size=COUNT), rng.normal(size=6) * np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
    whole = loads("linear", gust).evaluate(0.0, velocity, yaw)
    np.testing.assert_allclose(found.mean + found.on_gusts @ gust - found.damping @ velocity, whole, rtol=1e-9)
    expanded = linear_wind(wind("expanded"), yaw, VARIANCE, VARIANCE)
    whole = loads("expanded", gust).evaluate(0.0, velocity, yaw)
    squares = expanded.on_squares @ (gust**2 - VARIANCE)
    np.testing.assert_allclose(expanded.mean + found.on_gusts @ gust - found.damping @ velocity + squares, whole)


def test_full_drag_tends_to_the_expanded_one_where_the_wind_never_turns() -> None:
    """U² + Var, 2 U and 1; E|U + w|(U + w) differs from that by what lies beyond U, 7 standard deviations off."""
    few = np.full(COUNT, 16.0)
    full, expanded = (linear_wind(wind(name), 0.1, few, few) for name in ("full", "expanded"))
    for name in ("mean", "yaw_slope", "on_gusts", "damping", "on_squares"):
        one, other = getattr(full, name), getattr(expanded, name)
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-10 * np.abs(other).max())


def test_full_drag_takes_the_variance_of_the_relative_speed() -> None:
    """Against the mean of the force over a normal wind that often turns."""
    low, spread = np.full(COUNT, 3.0), np.full(COUNT, 4.0)
    nodes, weights = np.polynomial.hermite_e.hermegauss(200)
    weights = weights / weights.sum()
    found = linear_wind(wind("full", low), 0.2, np.zeros(COUNT), spread**2)
    forces = np.array(
        [loads("full", 4.0 * x * np.ones(COUNT), low).evaluate(0.0, np.zeros(6), 0.2) for x in nodes]
    )  # fmt: skip
    # Gauss's rule of a function with a kink in its second derivative is good to 1e-4.
    np.testing.assert_allclose(weights @ forces, found.mean, rtol=1e-3)
    np.testing.assert_allclose((weights * nodes) @ forces / 4.0, found.on_gusts.sum(axis=1), rtol=1e-3)
    square = (weights * (nodes**2 - 1.0)) @ forces / (2.0 * 16.0)
    np.testing.assert_allclose(square, found.on_squares.sum(axis=1), rtol=1e-3)
    assert not np.allclose(found.mean, linear_wind(wind("full", low), 0.2, np.zeros(COUNT), 0.5 * spread**2).mean)


def test_still_air_damps_with_the_spread_of_the_motion() -> None:
    """Without wind drag is quadratic, of the linear part sqrt(8 / pi) times the standard deviation of the speed."""
    still, spread = np.zeros(COUNT), np.full(COUNT, 0.7)
    found = linear_wind(wind("full", still), 0.0, still, spread**2)
    at_unit = linear_wind(wind("linear", np.ones(COUNT)), 0.0, still, still)
    assert not found.mean.any()
    np.testing.assert_allclose(found.damping, 0.5 * np.sqrt(8.0 / np.pi) * 0.7 * at_unit.damping, rtol=1e-9)
    np.testing.assert_allclose(found.on_squares, 0.0, atol=1e-9)
    none = linear_wind(wind("full", still), 0.0, still, still)
    assert not none.damping.any()


def test_linear_wind_leaves_squares_out() -> None:
    assert not linear_wind(wind("linear"), 0.0, VARIANCE, VARIANCE).on_squares.any()
    light = linear_wind(replace(wind("linear"), air_density=0.6125), 0.0, VARIANCE, VARIANCE)
    np.testing.assert_allclose(2.0 * light.mean, linear_wind(wind("linear"), 0.0, VARIANCE, VARIANCE).mean)
