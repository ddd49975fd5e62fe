"""The wave FMU's parameters, tried on the component as a plain Python object; test_fmus.py tries it through FMI."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.fmus.tables import record_to_json
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wave_parameters import mean_force, wave_model
from tlpsim.loads.bem.database import HydrodynamicDatabase, write
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, write_quadratic_transfer
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.diffraction import excitation_transfer
from tlpsim.loads.hydro.drift import wave_drift_damping
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
        elif one.table[reference].kind == "String":
            one.set_string([reference], [value])
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


def test_the_hull_gives_members_their_length_and_one_drag_coefficient() -> None:
    options = {"hydrodynamics": "morison", "significant_height": 0.0, "current_speed": 1.0}
    force = [
        model(**options, **other).evaluate(0.0, np.zeros(6), np.zeros(6)).viscous[0]
        for other in ({}, {"drag_coefficient": 1.6}, {"hull": '{"draught": 45.0}'})
    ]
    assert force[1] == pytest.approx(2.0 * force[0], rel=1e-12)
    # Four columns of 10 m more.
    assert force[2] - force[0] == pytest.approx(0.5 * 1025.0 * 0.8 * 2.0 * 8.435 * 40.0, rel=1e-9)
    with pytest.raises(ScenarioError, match="parameter hull has depth; give an object with draught, mass"):
        model(**options, hull='{"depth": 45.0}')
    with pytest.raises(ScenarioError, match=r"draught of the hull is 5 m, expected more than the 10\.5 m"):
        model(**options, hull='{"draught": 5.0}')
    with pytest.raises(ScenarioError, match="parameter hull: could not convert"):
        model(**options, hull='{"centre_of_gravity": "low"}')


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


def test_drift_damping_is_that_of_the_sea_and_can_be_switched_off(tmp_path: Path) -> None:
    rest, moving = np.zeros(6), np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    loads = model(heading=0.4)
    damping = wave_drift_damping(issc_database(), loads.sea.state)
    assert damping[0, 0] > 1e4
    np.testing.assert_allclose(loads.evaluate(3.0, rest, moving).drift_damping, -0.1 * damping[:, 0], rtol=1e-12)
    for off in ({"drift_damping": False}, {"drift": "none"}, {"hydrodynamics": "morison"}):
        assert not np.any(model(**off).evaluate(3.0, rest, moving).drift_damping)
    # Waves that ride on a current drive the platform at rest as if it went against it.
    riding = {"heading": 0.4, "current_speed": 0.5, "current_heading": 0.2, "doppler": True}
    speed = 0.5 * np.array([np.cos(0.2), np.sin(0.2)])
    np.testing.assert_allclose(model(**riding).evaluate(3.0, rest, rest).drift_damping, damping[:, :2] @ speed)
    forces = [mean_force((DEFAULTS | riding | {"drift_damping": on}).__getitem__) for on in (True, False)]
    np.testing.assert_allclose(forces[0] - forces[1], damping[:, :2] @ speed, rtol=1e-6, atol=1e-3)
    one_heading = dataclasses.replace(issc_database(), **_of_heading(issc_database(), 0))
    write(one_heading, tmp_path / "one.h5")
    with pytest.raises(ScenarioError, match=r"at least 2 rising headings, .* or switch it off, drift_damping = false"):
        model(hydrodynamics=str(tmp_path / "one.h5"))
    assert model(hydrodynamics=str(tmp_path / "one.h5"), drift_damping=False).sea is not None


def _of_heading(database: HydrodynamicDatabase, k: int) -> dict[str, Any]:
    """Fields of a database with one heading that no symmetry completes."""
    fields = {name: getattr(database, name)[k : k + 1].copy() for name in ("excitation_force", "mean_drift")}
    for values in fields.values():
        values[..., 1] = 1e-3 * values[..., 0]
    return {"heading": database.heading[k : k + 1], **fields}


def test_mean_force_is_the_mean_of_drift_and_current() -> None:
    """Mean of Newman's filters over a long record, whole beside waves at the origin, without the current's drag."""
    storm = DEFAULTS | {"heading": 0.4, "generator": "harmonic", "displaced_position": False}
    expected = mean_force(storm.__getitem__)
    loads, rest = wave_model(storm.__getitem__), np.zeros(6)
    sampled = np.mean([loads.evaluate(10.0 * k, rest, rest).drift for k in range(4000)], axis=0)
    # 40 000 s hold some 800 groups of waves: 4 % of the mean is one standard error.
    np.testing.assert_allclose(sampled[:2], expected[:2], rtol=0.12)
    current = mean_force((DEFAULTS | {"significant_height": 0.0, "current_speed": 0.5}).__getitem__)
    both = mean_force((storm | {"current_speed": 0.5}).__getitem__)
    np.testing.assert_allclose(both, expected + current, rtol=1e-12, atol=1e-3)


@pytest.mark.parametrize("drift", ["newman", "newman_geometric", "qtf"])
def test_the_displaced_position_does_not_bring_drift_again(drift: str, tmp_path: Path) -> None:
    """Moving as in the database, a realization has the mean of the whole drift wherever the waves are taken."""
    database = issc_database()
    assert database.response_amplitude is not None
    storm: dict[str, Any] = {"drift": drift, "generator": "harmonic", "components": 60, "heading": np.radians(22.5)}
    storm["significant_height"] = 1.0  # for little of the fourth order, a tenth of the yaw of 7 m
    if drift == "qtf":
        write_quadratic_transfer(newman_table(database, 6), tmp_path / "newman.h5")
        storm["quadratic_transfer"] = str(tmp_path / "newman.h5")
    displaced, plain = (model(**storm, displaced_position=on) for on in (True, False))
    motions = dataclasses.replace(database, excitation_force=database.response_amplitude)
    response = excitation_transfer(motions, plain.sea.angular_frequency, plain.sea.heading, 450.0)
    forces, position, rest = [], np.zeros(6), np.zeros(6)
    for time in 3.13 * np.arange(20000):
        position[:2] = (response[:2] @ plain.sea.amplitudes(time)).real
        one, other = displaced.evaluate(time, position, rest), plain.evaluate(time, rest, rest)
        forces.append([one.diffraction - other.diffraction, one.drift, other.drift])
    added, left, whole = np.mean(forces, axis=0)[:, [0, 1, 5]]
    assert abs(added[2]) > 0.3 * abs(whole[2])  # of yaw much is that of the displaced position
    # Differences of the components average out over some 60 000 s.
    np.testing.assert_allclose(added + left, whole, rtol=0.01)


def newman_table(database: HydrodynamicDatabase, k: int) -> QuadraticTransfer:
    """Newman's approximation of a database's heading k."""
    mean = np.zeros((len(database.omega), 6))
    mean[:, [0, 1, 5]] = database.mean_drift[k]
    transfer = 0.5 * (mean[None, :, None] + mean[None, None])
    return QuadraticTransfer(
        omega=database.omega, heading=database.heading[k : k + 1], transfer=transfer.astype(np.complex128)
    )


QTF_OMEGA = np.linspace(0.1, 2.4, 47)


def surge_and_yaw(first: NDArray, second: NDArray) -> NDArray:
    """A transfer function (..., 6) in N/m² and N·m/m², not one of products of first order."""
    gap = first - second
    result = np.zeros((*np.broadcast(first, second).shape, 6), dtype=np.complex128)
    result[..., 0] = 1e5 * first * second * np.exp(-0.5 * (gap / 0.3) ** 2 + 2j * gap)
    result[..., 5] = 1e6 * np.exp(-0.5 * (gap / 0.5) ** 2)
    return result


@pytest.fixture(scope="module")
def qtf(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Parameters of the FMU for `surge_and_yaw` in a file, of the heading 0.3 rad."""
    path = tmp_path_factory.mktemp("qtf") / "hull.h5"
    table = QuadraticTransfer(
        omega=QTF_OMEGA,
        heading=np.array([0.3]),
        transfer=surge_and_yaw(QTF_OMEGA[:, None], QTF_OMEGA)[None],
        depth=450.0,
        density=1025.0,
        gravity=9.80665,
    )
    write_quadratic_transfer(table, path)
    return {"drift": "qtf", "quadratic_transfer": str(path), "heading": 0.3}


def test_drift_is_the_double_sum_of_the_transfer_function(qtf: dict[str, Any]) -> None:
    """By cosines of phase differences, at a displaced position; the morison hull has no other drift."""
    loads = model(**qtf, generator="harmonic", components=80, hydrodynamics="morison")
    sea = loads.sea
    transfer = surge_and_yaw(sea.angular_frequency[:, None], sea.angular_frequency)
    product = sea.amplitude[:, None] * sea.amplitude
    found, exact = [], []
    for time in np.arange(0.0, 1000.0, 5.0):
        position = np.array([8.0 * np.sin(0.01 * time), -4.0, 0.0, 0.0, 0.0, 0.0])
        along = position[0] * np.cos(0.3) + position[1] * np.sin(0.3)
        phase = sea.angular_frequency * time + sea.phase - sea.wavenumber * along
        apart = phase[:, None] - phase
        parts = transfer.real * np.cos(apart)[..., None] - transfer.imag * np.sin(apart)[..., None]
        exact.append(np.sum(product[..., None] * parts, axis=(0, 1)))
        found.append(loads.evaluate(time, position, np.zeros(6)).drift)
    error = np.sqrt(np.mean((np.array(found) - exact) ** 2, axis=0))[[0, 5]]
    # What the filters leave out is at most half a percent of the spread of all such seas.
    assert np.all(error < 0.01 * np.std(exact, axis=0)[[0, 5]])
    assert not np.any(np.array(found)[:, 1:5])


def test_mean_of_the_transfer_function_is_that_of_its_diagonal(qtf: dict[str, Any]) -> None:
    loads, rest = model(**qtf, displaced_position=False), np.zeros(6)
    frequency = np.linspace(1e-3, 0.35, 5000)
    omega = 2.0 * np.pi * frequency
    diagonal = surge_and_yaw(omega, omega).real.T
    expected = 2.0 * np.trapezoid(loads.sea.state.density(frequency) * diagonal, frequency)
    force = mean_force((DEFAULTS | qtf).__getitem__)
    np.testing.assert_allclose(force[[0, 5]], expected[[0, 5]], rtol=5e-3)  # the tail at the end of the band fades
    sampled = np.mean([loads.evaluate(10.0 * k, rest, rest).drift for k in range(4000)], axis=0)
    np.testing.assert_allclose(sampled[[0, 5]], expected[[0, 5]], rtol=0.12)  # as for Newman's above
    both = mean_force((DEFAULTS | qtf | {"current_speed": 0.5}).__getitem__)
    current = mean_force((DEFAULTS | {"significant_height": 0.0, "current_speed": 0.5}).__getitem__)
    np.testing.assert_allclose(both, force + current, rtol=1e-12, atol=1e-3)


def test_newmans_approximation_as_a_transfer_function_is_newmans(tmp_path: Path) -> None:
    write_quadratic_transfer(newman_table(issc_database(), 0), tmp_path / "newman.h5")
    change = {"drift": "qtf", "quadratic_transfer": str(tmp_path / "newman.h5")}
    newman, other = (model(**each, displaced_position=False) for each in ({}, change))
    rest = np.zeros(6)
    forces = np.array([[each.evaluate(3.0 * k, rest, rest).drift for k in range(300)] for each in (newman, other)])
    np.testing.assert_allclose(forces[1], forces[0], atol=0.005 * forces[0].std(axis=0).max())
    means = [mean_force((DEFAULTS | each).__getitem__) for each in ({}, change)]
    np.testing.assert_allclose(means[1], means[0], rtol=1e-9, atol=1e-6 * np.abs(means[0]).max())


def test_state_with_a_transfer_function_is_restored_exactly(qtf: dict[str, Any], tmp_path: Path) -> None:
    one, other = (component(tmp_path, **qtf) for _ in range(2))
    outputs = [i for i, variable in enumerate(one.table) if variable.causality == "output"]
    for k in range(200):
        one.do_step(0.5 * k, 0.5)
    other._set_fmu_state(one._fmu_state_from_bytes(one._fmu_state_to_bytes(one._get_fmu_state())))
    for k in range(200, 300):
        for each in (one, other):
            each.do_step(0.5 * k, 0.5)
        assert other.get_real(outputs) == one.get_real(outputs)


def test_wamits_transfer_function_is_taken_in_the_water_of_the_site(tmp_path: Path) -> None:
    periods = 2.0 * np.pi / QTF_OMEGA
    path = tmp_path / "hull.12d"
    rows = [f"{a:.9E} {b:.9E} 0.0 0.0 1 2.0 0.0 2.0 0.0" for a in periods for b in periods if a >= b]
    path.write_text("\n".join(rows))
    change = {"drift": "qtf", "quadratic_transfer": str(path), "hydrodynamics": "morison"}
    loads = model(**change, water_density=1000.0, generator="harmonic", components=100)
    envelope = np.abs(np.sum(loads.sea.amplitudes(9.0)))  # T is the same for all waves, 2 ρ g L
    found = loads.evaluate(9.0, np.zeros(6), np.zeros(6)).drift[0]
    assert found == pytest.approx(2.0 * 1000.0 * 9.80665 * envelope**2, rel=0.02)


def test_a_transfer_function_that_does_not_fit_is_refused(qtf: dict[str, Any]) -> None:
    for changes, message in (
        ({"quadratic_transfer": ""}, "drift is 'qtf', and quadratic_transfer is empty; give the path"),
        ({"drift": "newman"}, r"quadratic_transfer is '.*hull\.h5' beside drift 'newman'; take 'qtf', or leave out"),
        ({"quadratic_transfer": "nowhere.h5"}, r"nowhere\.h5: not a quadratic transfer function"),
        ({"quadratic_transfer": "hull.csv"}, r"hull\.csv: .*\.h5 file, or \.10d"),
        ({"water_density": 1000.0}, r"function .*hull\.h5 is for a density of 1025 kg/m³, the site has 1000 kg/m³"),
        ({"gravity": 9.6}, r"function .*hull\.h5 is for a gravity of 9\.80665 m/s², the site has 9\.6"),
        ({"water_depth": 50.0}, r"function .*hull\.h5 is for a water depth of 450 m, the site has 50 m"),
        ({"heading": 0.5}, r"quadratic transfer function has headings 17\.19°.* not the 28\.65° of the waves"),
        ({"frequency_max": 0.5, "peak_period": 5.0}, r"hull\.h5 covers .* 0\.382 Hz .* to 0\.\d* Hz .*compute it for"),
    ):
        with pytest.raises(ScenarioError, match=message):
            model(**({"hydrodynamics": "morison"} | qtf | changes))
    assert not np.any(model(**qtf, significant_height=0.0).evaluate(1.0, np.zeros(6), np.zeros(6)).drift)
