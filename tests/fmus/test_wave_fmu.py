"""The wave FMU's parameters, tried on the component as a plain Python object; test_fmus.py tries it through FMI."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.fmus.tables import record_to_json
from tlpsim.fmus.wave_fmu import TlpsimWave, mean_force, wave_model
from tlpsim.loads.bem.database import write
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.diffraction import excitation_transfer
from tlpsim.loads.hydro.excitation import WaveForces
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import WaveComponents
from tlpsim.loads.waves.spectra import pierson_moskowitz

DEFAULTS: dict[str, Any] = {variable.name: variable.start for variable in TlpsimWave.table}


def model(**changes: Any) -> Any:
    return wave_model((DEFAULTS | changes).__getitem__)


def component(folder: Path, **changes: Any) -> TlpsimWave:
    one = TlpsimWave(instance_name="wave", resources=str(folder))
    for name, value in changes.items():
        reference = one.references[name.replace("__", ".")]
        if one.table[reference].kind == "Real":
            one.set_real([reference], [value])
        else:
            one.set_integer([reference], [value])
    one.setup_experiment(0.0, None, None)
    one.enter_initialization_mode()
    one.exit_initialization_mode()
    return one


def test_filters_make_the_sea_unless_components_are_asked_for() -> None:
    assert isinstance(model().sea, ArmaSea)
    assert isinstance(model(generator="harmonic").sea, WaveComponents)
    with pytest.raises(ScenarioError, match="parameter generator is 'fft'; it must be one of arma, harmonic"):
        model(generator="fft")


def test_both_generators_have_forces_of_one_size() -> None:
    times = np.arange(0.0, 3000.0, 1.0)
    deviation = []
    for generator in ("arma", "harmonic"):
        loads = model(generator=generator, heading=0.4)
        record = np.array([loads.evaluate(time, np.zeros(6), np.zeros(6)).diffraction for time in times])
        deviation.append(record.std(axis=0))
    # 3000 s hold some 300 independent values: a standard deviation is known to 4 %; three of them, twice.
    np.testing.assert_allclose(deviation[0], deviation[1], rtol=0.17)


def test_table_takes_the_place_of_the_spectrum() -> None:
    frequency = np.linspace(0.03, 0.5, 95)
    density = pierson_moskowitz(frequency, 5.0, 10.0)
    table = json.dumps({"frequency": frequency.tolist(), "density": density.tolist()})
    sea = model(spectrum_table=table, peak_period=20.0).sea
    assert sea.state.peak_frequency == pytest.approx(0.1, abs=0.003)
    assert 4.0 * sea.samples(0, 20_000)[:, 0].std() == pytest.approx(5.0, rel=0.05)
    with pytest.raises(ScenarioError, match="spectrum_table"):
        model(spectrum_table="[1, 2]")


def test_calm_water_needs_no_spectrum() -> None:
    loads = model(significant_height=0.0, current_speed=0.5)
    forces = loads.evaluate(3.0, np.zeros(6), np.zeros(6))
    assert forces.elevation == 0.0
    assert forces.viscous[0] > 0.0


def test_orders_and_sampling_step_reach_the_filter() -> None:
    sea = model(**{"orders.autoregressive": 10, "orders.moving_average": 9, "sampling_step": 1.0}).sea
    assert sea.model.orders == (10, 9)
    assert sea.model.step == 1.0


def test_state_of_a_short_crested_sea_is_restored_exactly(tmp_path: Path) -> None:
    one, other = (component(tmp_path, directions=3, seed=5) for _ in range(2))
    outputs = [i for i, variable in enumerate(one.table) if variable.causality == "output"]
    for k in range(1500):
        one.do_step(0.5 * k, 0.5)
    state = one._fmu_state_from_bytes(one._fmu_state_to_bytes(one._get_fmu_state()))
    later = []
    for k in range(1500, 1700):
        one.do_step(0.5 * k, 0.5)
        later.append(one.get_real(outputs))
    other._set_fmu_state(state)
    for k in range(1500, 1700):
        other.do_step(0.5 * k, 0.5)
        assert other.get_real(outputs) == later[k - 1500]


def test_first_order_force_is_that_of_the_database(tmp_path: Path) -> None:
    path = tmp_path / "issc.h5"
    write(issc_database(), path)
    built_in, from_file = model(), model(hydrodynamics=str(path))
    np.testing.assert_array_equal(built_in.excitation_transfer, from_file.excitation_transfer)
    exact = excitation_transfer(issc_database(), built_in.sea.angular_frequency, built_in.sea.heading, 450.0)
    np.testing.assert_array_equal(built_in.excitation_transfer, exact)
    members = inertia_transfer(issc_members(), built_in.sea)
    np.testing.assert_array_equal(model(hydrodynamics="morison").excitation_transfer, members)


def test_a_database_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nowhere\.h5"):
        model(hydrodynamics="nowhere.h5")
    with pytest.raises(ScenarioError, match="members gives a hull of its own, but parameter hydrodynamics is empty"):
        model(members=record_to_json(issc_members()))
    path = tmp_path / "issc.h5"
    write(issc_database(), path)
    assert model(members=record_to_json(issc_members()), hydrodynamics=str(path)).strips.drag.any()
    with pytest.raises(ScenarioError, match=r"issc\.h5 is for a water depth of 450 m, the site has 60 m"):
        model(hydrodynamics=str(path), water_depth=60.0)
    with pytest.raises(
        ScenarioError, match=r"issc\.h5 covers .* to 0\.3867 Hz .* but the waves have .* to 0\.79\d* Hz"
    ):
        model(hydrodynamics=str(path), peak_period=2.5, frequency_max=0.8, sampling_step=0.25)
    assert model(significant_height=0.0, hydrodynamics="nowhere.h5").evaluate(0.0, np.zeros(6), np.zeros(6)) is not None


def test_parts_can_be_switched_off_and_add_up() -> None:
    """Drift and splash zone do nothing where they are switched off, and change neither the sea nor other parts."""
    rest = np.zeros(6)

    def forces(**changes: Any) -> WaveForces:
        return model(**{"current_speed": 0.8, **changes}).evaluate(7.0, rest, rest)  # type: ignore[no-any-return]

    everything = forces()
    assert np.any(everything.drift != 0.0)
    plain = forces(drift="none", splash=False)
    np.testing.assert_array_equal(plain.drift, 0.0)
    np.testing.assert_allclose(plain.diffraction, everything.diffraction, rtol=1e-9, atol=1e-3)
    assert abs(plain.viscous[0] - everything.viscous[0]) > 1e-3 * abs(plain.viscous[0])
    profile = '{"depth": [0, 100], "speed": [0.8, 0.8], "heading": [0.0, 0.0]}'
    same = forces(current_speed=0.0, current_profile=profile)
    np.testing.assert_allclose(same.viscous, everything.viscous, rtol=1e-9, atol=1e-6 * np.abs(same.viscous).max())
    with pytest.raises(ScenarioError, match="beside a current_profile"):
        forces(current_profile=profile)
    with pytest.raises(ScenarioError, match="newman_geometric"):
        forces(drift="full")


def test_mean_force_is_the_mean_of_drift_and_current() -> None:
    """Mean of Newman's filters over a long record, without the current's drag at rest."""
    storm = DEFAULTS | {"heading": 0.4, "generator": "harmonic"}
    expected = mean_force(storm.__getitem__)
    loads, rest = wave_model(storm.__getitem__), np.zeros(6)
    sampled = np.mean([loads.evaluate(10.0 * k, rest, rest).drift for k in range(4000)], axis=0)
    # 40 000 s hold some 800 groups of waves: 4 % of the mean is one standard error.
    np.testing.assert_allclose(sampled[:2], expected[:2], rtol=0.12)
    current = mean_force((DEFAULTS | {"significant_height": 0.0, "current_speed": 0.5}).__getitem__)
    both = mean_force((storm | {"current_speed": 0.5}).__getitem__)
    np.testing.assert_allclose(both, expected + current, rtol=1e-12, atol=1e-3)
