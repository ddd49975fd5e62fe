"""Current profiles against closed forms."""

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import Members
from tlpsim.loads.waves.current import Current, current_velocity, power_law_current, uniform_current
from tlpsim.loads.waves.field import calm_water

DEPTH = 80.0
COLUMN = Members(
    start=np.array([[5.0, 0.0, -60.0]]),
    end=np.array([[5.0, 0.0, 0.0]]),
    across=np.array([[1.0, 0.0, 0.0]]),
    width=np.full((1, 2), 3.0),
    area=np.full(1, 7.0),
    drag_coefficient=np.full((1, 2), 0.9),
    added_mass_coefficient=np.zeros((1, 2)),
    end_pressure=np.zeros((1, 2)),
    end_added_mass_coefficient=np.zeros((1, 2)),
)


def test_table_is_linear_between_its_rows_and_constant_beyond() -> None:
    current = Current(depth=[10.0, 30.0], speed=[1.0, 0.5], heading=[0.0, 0.5 * np.pi])
    found = current_velocity(current, np.array([5.0, 0.0, -10.0, -20.0, -30.0, -70.0]))
    expected = [[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.5, 0.25], [0.0, 0.5], [0.0, 0.5]]
    np.testing.assert_allclose(found[:, :2], expected, atol=1e-15)
    np.testing.assert_array_equal(found[:, 2], 0.0)


def test_power_law_from_the_bottom_to_the_surface() -> None:
    current = power_law_current(1.2, 0.3, DEPTH)
    found = current_velocity(current, np.array([3.0, 0.0, -40.0, -DEPTH]))
    speed = 1.2 * np.array([1.0, 1.0, 0.5 ** (1.0 / 7.0), 0.0])
    np.testing.assert_allclose(found[:, 0], speed * np.cos(0.3), rtol=1e-14)
    np.testing.assert_allclose(found[:, 1], speed * np.sin(0.3), rtol=1e-14)


@pytest.mark.parametrize("exponent", [1.0 / 7.0, 1.0])
def test_mean_force_of_the_power_law_in_closed_form(exponent: float) -> None:
    # int (1 + z/d)^2n dz and its first moment, over the column; at strips of 0.5 m the midpoint rule leaves 3e-5.
    current = power_law_current(1.2, 0.0, DEPTH, exponent)
    force = mean_current_force(COLUMN, current=current, water_density=1025.0, strip_length=0.5)
    n, low = 2.0 * exponent, 1.0 - 60.0 / DEPTH
    integral = DEPTH * (1.0 - low ** (n + 1.0)) / (n + 1.0)
    moment = DEPTH**2 * ((1.0 - low ** (n + 2.0)) / (n + 2.0) - (1.0 - low ** (n + 1.0)) / (n + 1.0))
    factor = 0.5 * 1025.0 * 0.9 * 3.0 * 1.2**2
    assert force[0] == pytest.approx(factor * integral, rel=1e-4)
    assert force[4] == pytest.approx(factor * moment, rel=1e-4)
    assert force[5] == pytest.approx(0.0, abs=1e-9)


def test_forces_in_time_take_the_same_current() -> None:
    current = Current(depth=[0.0, 20.0, 60.0], speed=[1.0, 0.6, 0.1], heading=[0.2, 0.9, 2.5])
    calm = WaveLoads(sea=calm_water(water_depth=450.0), members=issc_members(), current=current)
    expected = mean_current_force(issc_members(), current=current)
    found = calm.evaluate(7.0, np.zeros(6), np.zeros(6)).viscous
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_one_row_is_the_uniform_current() -> None:
    expected = mean_current_force(issc_members(), current_speed=0.8, current_heading=1.1)
    found = mean_current_force(issc_members(), current=uniform_current(0.8, 1.1))
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13 * np.abs(expected).max())


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"current speed is -1.0 m/s; .* the heading gives the direction"):
        uniform_current(-1.0)
    with pytest.raises(ScenarioError, match="heading has shape"):
        uniform_current(1.0, np.nan)
    with pytest.raises(ScenarioError, match=r"depths are \[10.0, 5.0\] m; they must ascend"):
        Current(depth=[10.0, 5.0], speed=[1.0, 1.0], heading=[0.0, 0.0])
    with pytest.raises(ScenarioError, match="they must be equally long"):
        Current(depth=[0.0, 5.0], speed=[1.0], heading=[0.0, 0.0])
    with pytest.raises(ScenarioError, match="exponent is -1"):
        power_law_current(1.0, 0.0, DEPTH, -1.0)
    with pytest.raises(ScenarioError, match="water depth of a current by the power law is inf"):
        power_law_current(1.0, 0.0, np.inf)
    with pytest.raises(ScenarioError, match="below the sea bed of its power law"):
        current_velocity(power_law_current(1.0, 0.0, DEPTH), np.array([-81.0]))
    with pytest.raises(ScenarioError, match="beside a current profile; give one of them"):
        mean_current_force(COLUMN, current_speed=0.5, current=uniform_current(1.0))
