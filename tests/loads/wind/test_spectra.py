import numpy as np
import pytest
from scipy.integrate import quad

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.spectra import (
    SPECTRA,
    WindPoints,
    api_variance,
    logarithmic_wind_points,
    spectrum_by_name,
)


@pytest.fixture
def points() -> WindPoints:
    return logarithmic_wind_points(np.array([15.0, 30.0, 60.0]), 25.0, 0.005)


@pytest.mark.parametrize("name", sorted(SPECTRA))
def test_variance_is_the_integral_of_the_spectrum(name: str, points: WindPoints) -> None:
    family = SPECTRA[name]
    for m in range(3):
        # Over the logarithm of frequency, as wide as the tails need: f S falls as f below and f^-2/3 above.
        area, _ = quad(
            lambda x, m=m: np.exp(x) * family.density(np.array([np.exp(x)]), points)[0, m],
            np.log(1e-9),
            np.log(1e9),
            limit=400,
            epsabs=0.0,
            epsrel=1e-9,
        )
        assert area == pytest.approx(family.variance(points)[m], rel=1e-6)


@pytest.mark.parametrize(("name", "over_friction_velocity"), [("kaimal", 6.00), ("harris", 6.68)])
def test_variance_over_squared_friction_velocity(name: str, over_friction_velocity: float, points: WindPoints) -> None:
    ratio = SPECTRA[name].variance(points) / points.friction_velocity**2
    np.testing.assert_allclose(ratio, over_friction_velocity, atol=0.005)


def test_api_turbulence_intensity_is_15_percent_at_20_m() -> None:
    points = logarithmic_wind_points(np.array([20.0]), 25.0, 0.005)
    assert np.sqrt(api_variance(points)[0]) / points.speed[0] == pytest.approx(0.15)


def test_spectra_are_finite_at_zero_and_fall_with_the_minus_five_thirds_power(points: WindPoints) -> None:
    for family in SPECTRA.values():
        assert np.all(np.isfinite(family.density(np.array([0.0]), points)))
        high = family.density(np.array([100.0, 200.0]), points)
        np.testing.assert_allclose(high[1] / high[0], 2.0 ** (-5 / 3), rtol=1e-3)


def test_unknown_name_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(ScenarioError, match="'Kaymal' is not known; did you mean 'kaimal'"):
        spectrum_by_name("Kaymal")
