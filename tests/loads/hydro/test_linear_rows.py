"""The reduced product against the sum over components, for seas of one direction and of many."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.hydro.linear_rows import LinearRows, _cosine_sine, evaluate_rows, linear_rows
from tlpsim.loads.waves.airy import velocity_transfer
from tlpsim.loads.waves.field import WaveComponents, wave_components
from tlpsim.loads.waves.sea import SeaState

STATE = SeaState(significant_height=9.0, peak_period=13.0, heading=0.4, water_depth=450.0, highest_frequency=0.35)


def velocities(sea: WaveComponents, points: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Rows of the velocity of the water at points, and two that are odd: zeros, and a great one."""
    rows = velocity_transfer(sea.angular_frequency, sea.wavenumber, sea.heading, 450.0, points)
    rows = rows.reshape(-1, rows.shape[-1])
    return np.vstack([1e6 * rows[:1], np.zeros((1, rows.shape[1])), rows])


def response(rows: LinearRows, amplitudes: NDArray[np.complex128], x: float, y: float) -> NDArray[np.float64]:
    evaluate_rows(amplitudes, x, y, *rows.arrays)
    return rows.response.copy()


@pytest.mark.parametrize("directions", [1, 7])
@pytest.mark.parametrize("points", [1, 2, 60])
def test_rows_are_sums_over_the_components(directions: int, points: int) -> None:
    state = SeaState(
        **{name: getattr(STATE, name) for name in ("significant_height", "peak_period", "heading", "water_depth")},
        directions=directions,
        spreading_exponent=6.0,
    )
    sea = wave_components(state, count=90, seed=2)
    generator = np.random.default_rng(5)
    places = generator.uniform((-45.0, -45.0, -35.0), (45.0, 45.0, 0.0), (points, 3))
    transfer = velocities(sea, places)
    rows = linear_rows(transfer, sea)
    for time, x, y in ((0.0, 0.0, 0.0), (55.0, 17.0, -31.0), (3210.0, -80.0, 4.0)):
        amplitudes = sea.amplitudes(time)
        phase = sea.wavenumber * (x * np.cos(sea.heading) + y * np.sin(sea.heading))
        expected = (transfer @ (amplitudes * np.exp(-1j * phase))).real
        found = response(rows, amplitudes, x, y)
        size = np.abs(transfer) @ np.abs(amplitudes)
        # What is left out, 1e-13 of a row, grown by the mixture of a pivoted decomposition, and phases of some 40 rad.
        np.testing.assert_array_less(np.abs(found - expected), 1e-12 * size + 1e-300)


def test_rows_of_a_long_crested_sea_are_few() -> None:
    sea = wave_components(STATE, count=160, seed=1)
    points = np.random.default_rng(1).uniform((-43.0, -43.0, -35.0), (43.0, 43.0, 0.0), (70, 3))
    rows = linear_rows(velocities(sea, points), sea)
    # Phases over 2 · 61 m of waves of up to 0.49 rad/m turn ten times, each of which takes a sine and a cosine, and the
    # heights as much again.
    assert 2 * 10 < rows.matrix.shape[1] < 100
    assert rows.matrix.shape[1] + rows.mixture.shape[1] == 212


@given(angle=st.floats(-1e5, 1e5))
@settings(deadline=None)  # the first one is compiled
def test_cosine_and_sine(angle: float) -> None:
    # The angle less its quarter turns is rounded at 1e-16 of one, and the turns at 6e-11 times 2e-16.
    np.testing.assert_allclose(_cosine_sine(angle), (math.cos(angle), math.sin(angle)), rtol=0.0, atol=4e-16)


def test_no_waves_and_no_rows() -> None:
    sea = wave_components(STATE, count=3, seed=1)
    assert response(linear_rows(np.zeros((0, 3), dtype=complex), sea), sea.amplitudes(1.0), 0.0, 0.0).shape == (0,)
