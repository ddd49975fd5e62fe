import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.profile import friction_velocity, logarithmic_speed, power_law_speed


def test_both_profiles_pass_through_the_speed_at_10_m() -> None:
    assert logarithmic_speed(10.0, 25.0, 0.005) == pytest.approx(25.0)
    assert power_law_speed(10.0, 25.0, 0.12) == pytest.approx(25.0)


def test_logarithmic_profile_has_the_shear_of_the_friction_velocity() -> None:
    # dU/dz = u* / (kappa z): a decade of height adds u* ln(10) / 0.4.
    added = logarithmic_speed(100.0, 25.0, 0.005) - logarithmic_speed(10.0, 25.0, 0.005)
    assert added == pytest.approx(friction_velocity(25.0, 0.005) * np.log(10.0) / 0.4)


def test_power_law_of_two_heights() -> None:
    ratio = power_law_speed(np.array([20.0, 40.0]), 30.0, 0.12)
    assert ratio[1] / ratio[0] == pytest.approx(2.0**0.12)


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
    with pytest.raises(ScenarioError, match="exponent"):
        power_law_speed(20.0, 20.0, 0.0)
