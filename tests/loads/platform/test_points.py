"""Points of the platform against rotations by scipy and derivatives of a motion in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tlpsim.loads import issc_tlp
from tlpsim.loads.platform.motion import advance, initial_state
from tlpsim.loads.platform.points import point_motion

POINTS = np.array([[0.0, 0.0, 22.5], [43.125, 43.125, -35.0], [-20.0, 31.0, 5.0]])
AMPLITUDES = np.array([10.0, 6.0, 2.0, 0.2, 0.3, 0.9])
FREQUENCIES = np.array([0.3, 0.4, 0.9, 0.7, 0.8, 0.5])
PHASES = np.arange(6.0)


def pose(time: float) -> np.ndarray:
    return AMPLITUDES * np.sin(FREQUENCIES * time + PHASES)


def place(time: float) -> np.ndarray:
    at = pose(time)
    return at[:3] + Rotation.from_euler("ZYX", at[:2:-1]).apply(POINTS)


@pytest.mark.parametrize("time", [0.0, 1.7, 40.3])
def test_position_and_acceleration_of_a_moving_point(time: float) -> None:
    state = initial_state(issc_tlp.platform(), pose(time), np.zeros(6), np.zeros(6))
    state.velocity[:] = AMPLITUDES * FREQUENCIES * np.cos(FREQUENCIES * time + PHASES)
    state.acceleration[:] = -(FREQUENCIES**2) * pose(time)
    positions, accelerations = point_motion(POINTS, state)
    np.testing.assert_allclose(positions, place(time), rtol=0, atol=1e-12)
    step, weights = 0.02, np.array([1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90])
    samples = np.array([place(time + k * step) for k in range(-3, 4)])
    expected = np.tensordot(weights, samples, axes=1) / step**2
    # Sixth order: 50 m of 1 rad/s to the eighth times h⁶/560 = 6e-12, and rounding of 50 m eps/h² = 3e-11.
    np.testing.assert_allclose(accelerations, expected, rtol=0, atol=1e-9)


def test_the_deck_follows_the_integrated_motion() -> None:
    model, step = issc_tlp.platform(), 0.05
    state = initial_state(model, [5.0, 2.0, -0.02, 0.0, 0.0, 0.1], np.zeros(6), np.zeros(6))
    places, accelerations = [], []
    for _ in range(400):
        advance(model, state, np.array([2e6, 1e6, 0.0, 0.0, 0.0, 1e8]), step)
        one, other = point_motion(POINTS, state)
        places.append(one)
        accelerations.append(other)
    second = np.diff(places, n=2, axis=0) / step**2
    largest = np.abs(accelerations).max()
    # Second differences of the tether modes are off by (omega h)²/12 = 0.3 % of them.
    np.testing.assert_allclose(np.array(accelerations)[1:-1], second, rtol=0, atol=5e-3 * largest)
