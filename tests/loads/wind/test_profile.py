import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.profile import (
    PROFILES,
    Profile,
    friction_velocity,
    iso_speed,
    logarithmic_speed,
    mean_speed,
    power_law_speed,
)


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_passes_through_the_speed_at_10_m_and_grows_with_height(name: str) -> None:
    speed = mean_speed(np.array([5.0, 10.0, 20.0, 100.0]), Profile(name=name, speed_10=25.0))
    assert speed[1] == pytest.approx(25.0)
    assert np.all(np.diff(speed) > 0.0)


def test_logarithmic_profile_has_the_shear_of_the_friction_velocity() -> None:
    # dU/dz = u* / (kappa z): a decade of height adds u* ln(10) / 0.4.
    added = logarithmic_speed(100.0, 25.0, 0.005) - logarithmic_speed(10.0, 25.0, 0.005)
    assert added == pytest.approx(friction_velocity(25.0, 0.005) * np.log(10.0) / 0.4)


def test_power_law_of_two_heights() -> None:
    ratio = power_law_speed(np.array([20.0, 40.0]), 30.0, 0.12)
    assert ratio[1] / ratio[0] == pytest.approx(2.0**0.12)
    api = mean_speed(np.array([20.0, 40.0]), Profile(name="api", speed_10=30.0))
    assert api[1] / api[0] == pytest.approx(2.0**0.125)


def test_iso_profile_is_that_of_the_standard_in_feet() -> None:
    # API RP 2A, 21st edition, gives the same profile as U0 (1 + C ln(z / 32.8)), C = 0.0573 sqrt(1 + 0.0457 U0) with
    # feet and feet per second; its constants are rounded to three digits.
    foot = 0.3048
    speed, height = 30.0 / foot, np.array([15.0, 50.0, 100.0]) / foot
    expected = speed * (1.0 + 0.0573 * np.sqrt(1.0 + 0.0457 * speed) * np.log(height / 32.8))
    np.testing.assert_allclose(iso_speed(height * foot, 30.0) / foot, expected, rtol=5e-4)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"mean wind speed at 10 m is -3.*must be finite and > 0"):
        friction_velocity(-3.0, 0.005)
    with pytest.raises(ScenarioError, match="mean wind speed at 10 m is nan"):
        friction_velocity(float("nan"), 0.005)
    with pytest.raises(ScenarioError, match=r"roughness length is 12.0 m; it must be below 10"):
        friction_velocity(20.0, 12.0)
    with pytest.raises(ScenarioError, match="height of a wind point"):
        logarithmic_speed(np.array([10.0, 0.0]), 20.0, 0.005)
    with pytest.raises(ScenarioError, match="above the roughness length"):
        logarithmic_speed(0.004, 20.0, 0.005)
    with pytest.raises(ScenarioError, match="above the zero of the ISO profile"):
        iso_speed(1e-4, 60.0)
    with pytest.raises(ScenarioError, match="exponent"):
        power_law_speed(20.0, 20.0, 0.0)
    with pytest.raises(ScenarioError, match="wind profile 'logaritmic' is not known; did you mean 'logarithmic'"):
        mean_speed(20.0, Profile(name="logaritmic", speed_10=20.0))
