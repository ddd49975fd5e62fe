import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.coherence import cross_spectrum, davenport


def test_davenport_of_two_points_in_closed_form() -> None:
    position = np.array([[0.0, 0.0, 20.0], [3.0, 4.0, 50.0]])
    speed = np.array([30.0, 34.0])
    heading = 0.3
    across = 4.0 * np.cos(heading) - 3.0 * np.sin(heading)
    frequency = np.array([0.0, 0.02, 0.1])
    expected = np.exp(-frequency * np.sqrt((10.0 * 30.0) ** 2 + (16.0 * across) ** 2) / 32.0)
    coherence = davenport(frequency, position, speed, heading)
    np.testing.assert_allclose(coherence[:, 0, 1], expected, rtol=1e-13)
    np.testing.assert_allclose(coherence[:, 1, 0], expected, rtol=1e-13)
    np.testing.assert_allclose(np.diagonal(coherence, axis1=1, axis2=2), 1.0)


def test_separation_along_the_wind_does_not_count() -> None:
    heading = 1.1
    position = np.array([[0.0, 0.0, 20.0], [50.0 * np.cos(heading), 50.0 * np.sin(heading), 20.0]])
    coherence = davenport(np.array([0.1]), position, np.array([30.0, 30.0]), heading)
    assert coherence[0, 0, 1] == pytest.approx(1.0, abs=1e-12)


def test_cross_spectrum_has_the_spectra_on_its_diagonal_and_the_coherence_off_it() -> None:
    def density(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([1.0 + frequency, 4.0 + frequency], axis=1)

    def coherence(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.tile(np.array([[1.0, 0.5], [0.5, 1.0]]), (len(frequency), 1, 1))

    matrix = cross_spectrum(density, coherence)(np.array([0.0]))[0]
    np.testing.assert_allclose(matrix, [[1.0, 1.0], [1.0, 4.0]])


def test_negative_decay_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"lateral coherence coefficient of the wind is -1.0"):
        davenport(np.zeros(1), np.zeros((1, 3)), np.ones(1), 0.0, lateral=-1.0)
