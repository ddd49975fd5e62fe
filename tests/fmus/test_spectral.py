"""Statistics of wind and waves from the parameters of their FMUs, against the models that the FMUs make of them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tlpsim.fmus.spectral import spectral_waves, spectral_wind
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wave_parameters import mean_force, wave_model
from tlpsim.fmus.wind_fmu import TlpsimWind, wind_model
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.excitation import mean_current_force
from tlpsim.loads.spectral.problem import gusts_on_grid
from tlpsim.loads.spectral.products import no_products
from tlpsim.loads.spectral.second_order import SLOW_DRIFT, SecondOrder, drift_matrix, means
from tlpsim.loads.spectral.wave_grid import wave_grid


def of(component: Any, **changes: Any) -> Callable[[str], Any]:
    defaults = {variable.name: variable.start for variable in component.table}
    unknown = set(changes) - set(defaults)
    assert not unknown
    return (defaults | changes).__getitem__


def wave(**changes: Any) -> Callable[[str], Any]:
    return of(TlpsimWave, **changes)


def wind(**changes: Any) -> Callable[[str], Any]:
    return of(TlpsimWind, **changes)


def test_waves_have_the_transfer_functions_of_the_model() -> None:
    parameter = wave(heading=0.4, significant_height=6.0)
    found, model = spectral_waves(parameter), wave_model(parameter)
    assert found.excitation is not None
    np.testing.assert_array_equal(found.excitation(model.sea), model.excitation_transfer)
    grid = wave_grid(found, 1e-3)
    assert grid.step * np.sum(grid.root**2) == pytest.approx(6.0**2 / 16.0, rel=0.01)
    assert (found.splash, found.stretching, found.displaced_position) == (True, "vertical", True)
    assert not found.sharp_band
    assert spectral_waves(wave(generator="harmonic")).sharp_band


def test_mean_drift_and_damping_are_those_at_the_start_of_a_run() -> None:
    # At the displaced position a part of the drift is in the first-order loads.
    parameter = wave(heading=0.4, significant_height=6.0, displaced_position=False)
    found = spectral_waves(parameter)
    assert found.drift is not None
    assert found.drift_damping is not None
    grid = wave_grid(found, 5e-4)
    parts = SecondOrder(products={"tethers": no_products(len(grid.root))}, drift=drift_matrix(found.drift, grid))
    expected = mean_force(parameter)
    # Vertical drift is in neither where the database has that of the horizontal plane alone.
    np.testing.assert_allclose(means(parts, grid)[SLOW_DRIFT], expected, atol=1e-3 * np.abs(expected).max())
    model = wave_model(parameter)
    moving = np.array([0.3, -0.2, 0.0, 0.0, 0.0, 0.0])
    force = model.evaluate(5.0, np.zeros(6), moving).drift_damping
    np.testing.assert_allclose(-found.drift_damping @ moving, force, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "drift", "damping"),
    [
        ({}, True, True),
        ({"drift_damping": False}, True, False),
        ({"drift": "none"}, False, False),
        ({"hydrodynamics": "morison"}, False, False),
        ({"significant_height": 0.0}, False, False),
    ],
    ids=str,
)  # fmt: skip
def test_drift_is_there_where_the_fmu_has_it(changes: dict[str, Any], drift: bool, damping: bool) -> None:
    found = spectral_waves(wave(**changes))
    assert (found.drift is not None) == drift
    # In the FMU a matrix that is not asked for is none as well.
    assert (found.drift_damping is not None and bool(np.any(found.drift_damping))) == damping


def test_calm_water_keeps_the_current() -> None:
    parameter = wave(significant_height=0.0, current_speed=0.9, current_heading=1.2)
    found = spectral_waves(parameter)
    assert found.excitation is None
    assert found.current is not None
    np.testing.assert_allclose(mean_current_force(found.members, current=found.current), mean_force(parameter))


def test_wind_has_the_spectra_and_the_band_of_the_model() -> None:
    parameter = wind(heading=0.6, mean_speed=25.0, sampling_step=0.5, air_density=1.1, decomposition="linear")
    found, model = spectral_wind(parameter), wind_model(parameter)
    assert found.highest_frequency == 1.0
    np.testing.assert_allclose(found.speed, model.field.speed, rtol=1e-12)
    speeds = gusts_on_grid(found, np.linspace(0.0, 1.0, 4001))
    # The digital filter keeps the variance in the band of its samples, to its certificate.
    np.testing.assert_allclose(speeds.variance, model.field.sampled_variance, rtol=0.03)
    assert (found.heading, found.air_density, found.decomposition) == (0.6, 1.1, "linear")
    np.testing.assert_allclose(found.segments.position, model.segments.position)


def test_still_air_has_no_gusts() -> None:
    found = spectral_wind(wind(mean_speed=0.0))
    speeds = gusts_on_grid(found, np.linspace(0.0, 0.4, 51))
    assert not found.speed.any()
    assert not speeds.variance.any()
    assert speeds.speeds.function.shape == (51, len(found.speed), 0)


def test_a_database_of_other_water_is_refused() -> None:
    with pytest.raises(ScenarioError):
        spectral_waves(wave(frequency_max=0.9))
