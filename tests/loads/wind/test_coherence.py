import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.coherence import COHERENCES, Decay, coherence_by_name, cross_spectrum, davenport, loosened, npd
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.spectra import WindPoints, wind_points

FloatArray = NDArray[np.float64]


def points_at(position: FloatArray, speed_10: float = 30.0) -> WindPoints:
    return wind_points(position[:, 2], Profile(name="iso", speed_10=speed_10))


def test_davenport_of_two_points_in_closed_form() -> None:
    position = np.array([[0.0, 0.0, 20.0], [3.0, 4.0, 50.0]])
    points = points_at(position)
    heading = 0.3
    across = 4.0 * np.cos(heading) - 3.0 * np.sin(heading)
    along = 3.0 * np.cos(heading) + 4.0 * np.sin(heading)
    frequency = np.array([0.0, 0.02, 0.1])
    separation = np.sqrt((10.0 * 30.0) ** 2 + (16.0 * across) ** 2 + (3.0 * along) ** 2)
    expected = np.exp(-frequency * separation / points.speed.mean())
    coherence = davenport(frequency, position, heading, points, Decay(longitudinal=3.0))
    np.testing.assert_allclose(coherence[:, 0, 1], expected, rtol=1e-13)
    np.testing.assert_allclose(coherence[:, 1, 0], expected, rtol=1e-13)


@pytest.mark.parametrize(
    ("offset", "exponent"),
    # By hand from the standard at 0.1 Hz, both points near 20 m (zg = 2), U0 = 30 m/s, wind toward +x:
    # 2.9 0.1^0.92 40 / 2^0.4 / 30, 45 0.1^0.92 40 / 2^0.4 / 30, and in height 13 0.1^0.85 10^1.25 / sqrt(zg) / 30 with
    # zg = sqrt(20 30) / 10.
    [((40.0, 0.0, 0.0), 0.35228), ((0.0, 40.0, 0.0), 5.46644), ((0.0, 0.0, 10.0), 0.69545)],
)
def test_npd_of_points_apart_in_one_direction(offset: tuple[float, float, float], exponent: float) -> None:
    position = np.array([[0.0, 0.0, 20.0], [0.0, 0.0, 20.0]])
    position[1] += offset
    coherence = npd(np.array([0.0, 0.1]), position, 0.0, points_at(position), Decay())
    assert coherence[0, 0, 1] == 1.0
    assert -np.log(coherence[1, 0, 1]) == pytest.approx(exponent, rel=1e-4)


def test_separation_along_the_wind_does_not_count_by_default() -> None:
    heading = 1.1
    position = np.array([[0.0, 0.0, 20.0], [50.0 * np.cos(heading), 50.0 * np.sin(heading), 20.0]])
    coherence = davenport(np.array([0.1]), position, heading, points_at(position), Decay())
    assert coherence[0, 0, 1] == pytest.approx(1.0, abs=1e-12)


@given(
    name=st.sampled_from(sorted(COHERENCES)),
    heading=st.floats(-np.pi, np.pi),
    seed=st.integers(0, 1000),
    frequency=st.floats(0.0, 2.0),
)
@settings(max_examples=60, deadline=None)
def test_coherence_is_symmetric_of_unit_diagonal_and_turns_with_the_wind(
    name: str, heading: float, seed: int, frequency: float
) -> None:
    generator = np.random.default_rng(seed)
    position = np.column_stack([generator.uniform(-50, 50, (5, 2)), generator.uniform(10, 60, 5)])
    points = points_at(position)
    at = np.array([frequency])
    matrix = COHERENCES[name](at, position, 0.0, points, Decay())[0]
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_array_equal(np.diagonal(matrix), 1.0)
    assert np.all((matrix >= 0.0) & (matrix <= 1.0))
    turn = np.array([[np.cos(heading), np.sin(heading), 0.0], [-np.sin(heading), np.cos(heading), 0.0], [0, 0, 1]])
    turned = COHERENCES[name](at, position @ turn, heading, points, Decay())[0]
    np.testing.assert_allclose(turned, matrix, atol=1e-10)


@pytest.mark.parametrize("name", COHERENCES)
def test_coherence_is_one_at_zero_frequency_and_between_coincident_points(name: str) -> None:
    position = np.array([[0.0, 5.0, 20.0], [0.0, 5.0, 20.0], [0.0, -30.0, 60.0]])
    matrix = COHERENCES[name](np.array([0.0, 0.3]), position, 0.4, points_at(position), Decay())
    np.testing.assert_array_equal(matrix[0], 1.0)
    assert matrix[1, 0, 1] == 1.0
    assert matrix[1, 0, 2] < 0.1


def test_cross_spectrum_has_the_spectra_on_its_diagonal_and_the_coherence_off_it() -> None:
    def density(frequency: FloatArray) -> FloatArray:
        return np.stack([1.0 + frequency, 4.0 + frequency], axis=1)

    def coherence(frequency: FloatArray) -> FloatArray:
        return np.tile(np.array([[1.0, 0.5], [0.5, 1.0]]), (len(frequency), 1, 1))

    matrix = cross_spectrum(density, coherence)(np.array([0.0]))[0]
    np.testing.assert_allclose(matrix, [[1.0, 1.0], [1.0, 4.0]])


@given(seed=st.integers(0, 1000), heading=st.floats(-np.pi, np.pi))
@settings(max_examples=40, deadline=None)
def test_loosened_coherence_stays_positive_semi_definite(seed: int, heading: float) -> None:
    generator = np.random.default_rng(seed)
    place = np.column_stack([generator.uniform(-50, 50, (3, 2)), generator.uniform(10, 60, 3)])
    position = place[[0, 0, 0, 1, 1, 2]]
    scale = np.array([1.0, 1.0, 2.0, 1.0, 3.0, 1.0])  # times 1 + f: the third and the fifth differ from their twins

    def density(frequency: FloatArray) -> FloatArray:
        return np.asarray(1.0 / (1.0 + frequency[:, None] * scale))

    def coherence(frequency: FloatArray) -> FloatArray:
        return davenport(frequency, position, heading, points_at(position), Decay())

    factor = loosened(density, coherence, 0.5)
    assert (factor[0, 1], factor[0, 2], factor[3, 4]) == (1.0, 0.99, 0.99)
    for matrix in factor * coherence(np.array([0.0, 0.05, 0.5])):
        assert np.linalg.eigvalsh(matrix)[0] > -1e-12


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"lateral coherence coefficient of the wind is -1.0"):
        Decay(lateral=-1.0)
    with pytest.raises(ScenarioError, match="wind coherence 'davenprt' is not known; did you mean 'davenport'"):
        coherence_by_name("davenprt")
