"""Hydrodynamics of the platform FMU, tried on the component as a plain Python object."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.fmus.platform_fmu import MEMORY, TlpsimPlatform, platform_model
from tlpsim.fmus.tables import record_to_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import write
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.memory import NoMemory

DEFAULTS: dict[str, Any] = {variable.name: variable.start for variable in TlpsimPlatform.table}

TENDONLESS = '{"fairleads": [], "anchors": [], "axial_stiffness": [], "pretension": []}'
MOVING = {"initial_position.surge": 5.0, "initial_velocity.sway": 0.5}
TUBES = record_to_json(issc_tlp.tendons(tubes=issc_tlp.steel_tubes() | {"submerged_weight": np.array([800.0])}))


def model(**changes: Any) -> Any:
    return platform_model((DEFAULTS | changes).__getitem__)


def component(folder: Path, numbers: dict[str, float] = MOVING, **settings: str) -> TlpsimPlatform:
    one = TlpsimPlatform(instance_name="platform", resources=str(folder))
    for name, value in settings.items():
        one.set_string([one.references[name]], [value])
    for name, number in numbers.items():
        one.set_real([one.references[name]], [number])
    one.setup_experiment(0.0, None, None)
    one.enter_initialization_mode()
    one.exit_initialization_mode()
    return one


def test_added_mass_with_memory_is_that_of_infinite_frequency(tmp_path: Path) -> None:
    path = tmp_path / "issc.h5"
    write(issc_database(), path)
    from_file = model(hydrodynamics=str(path))
    np.testing.assert_array_equal(from_file.body.added_mass, model().body.added_mass)
    limit = np.diagonal(issc_database().added_mass_infinite)
    # Two ways to the limit: Ogilvie's relation from the damping, and the panels at that frequency.
    assert np.diagonal(model().body.added_mass) == pytest.approx(limit, rel=0.01)
    without = model(hydrodynamics=str(path), radiation="none")
    np.testing.assert_allclose(without.body.added_mass, issc_database().added_mass[0], rtol=0.01, atol=1e5)
    assert isinstance(without.memory, NoMemory)


@pytest.mark.parametrize("changes", [{"hydrodynamics": "morison"}, {"radiation": "none"}])
def test_constant_added_mass_is_that_of_long_waves(changes: dict[str, str]) -> None:
    plain = model(**changes)
    np.testing.assert_array_equal(plain.body.added_mass, issc_tlp.ADDED_MASS)
    assert isinstance(plain.memory, NoMemory)
    lighter = model(water_density=1000.0, **changes)
    np.testing.assert_allclose(lighter.body.added_mass, issc_tlp.ADDED_MASS / 1.025)


def test_a_hull_of_more_draught_has_more_added_mass_and_lower_fairleads() -> None:
    deep = model(hydrodynamics="morison", hull='{"draught": 45.0}')
    # Ten metres of four circles.
    more = 1025.0 * 4.0 * np.pi * 8.435**2 * 10.0
    assert deep.body.added_mass[0, 0] - issc_tlp.ADDED_MASS[0, 0] == pytest.approx(more, rel=1e-9)
    np.testing.assert_array_equal(deep.tendons.fairleads[:, 2], np.full(12, -45.0))


def test_a_given_added_mass_stands_alone() -> None:
    given = model(added_mass=str((2.0 * issc_tlp.ADDED_MASS).tolist()))
    np.testing.assert_allclose(given.body.added_mass, 2.0 * issc_tlp.ADDED_MASS)
    assert isinstance(given.memory, NoMemory)


@pytest.mark.parametrize("kind", [name for name, make in MEMORY.items() if make is not None])
def test_memory_goes_with_the_state(tmp_path: Path, kind: str) -> None:
    one, other = component(tmp_path, radiation=kind), component(tmp_path, radiation=kind)
    outputs = [i for i, variable in enumerate(one.table) if variable.causality == "output"]
    for k in range(300):
        one.do_step(0.1 * k, 0.1)
    state = one._fmu_state_from_bytes(one._fmu_state_to_bytes(one._get_fmu_state()))
    later = []
    for k in range(300, 600):
        one.do_step(0.1 * k, 0.1)
        later.append(one.get_real(outputs))
    other._set_fmu_state(state)
    for k in range(300, 600):
        other.do_step(0.1 * k, 0.1)
        assert other.get_real(outputs) == later[k - 300]
    assert np.ptp(np.array(later)[:, 0]) > 0.1


def get(one: TlpsimPlatform, name: str) -> float:
    return float(one.get_real([one.references[name]])[0])


def put(one: TlpsimPlatform, name: str, value: float) -> None:
    one.set_real([one.references[name]], [value])


def tensions(one: TlpsimPlatform, kind: str = "tendon_tension") -> list[float]:
    return one.get_real([one.references[f"{kind}[{i + 1}]"] for i in range(12)])


def test_a_tether_is_lost_by_its_input(tmp_path: Path) -> None:
    """Outputs of the step whose input says so are those without the tether; the motion up to there is untouched."""
    one, other = (component(tmp_path, radiation="none") for _ in range(2))
    for k in range(20):
        one.do_step(0.1 * k, 0.1)
        other.do_step(0.1 * k, 0.1)
    put(one, "tendon_intact[4]", 0.0)
    one.do_step(2.0, 0.1)
    other.do_step(2.0, 0.1)
    places = [one.references[f"{name}.heave"] for name in ("position", "velocity")]
    assert one.get_real(places) == other.get_real(places)
    assert tensions(one)[3] == 0.0 < tensions(other)[3]
    assert get(one, "acceleration.heave") - get(other, "acceleration.heave") == pytest.approx(
        tensions(other)[3] / one.model.mass[2, 2], rel=0.02
    )
    for k in range(21, 60):
        one.do_step(0.1 * k, 0.1)
        assert np.all(np.isfinite(one.values))
        assert tensions(one)[3] == 0.0
    assert max(tensions(one)[4:6]) > tensions(one)[10]
    put(one, "tendon_intact[4]", 1.0)
    one.do_step(6.0, 0.1)
    assert tensions(one)[3] == pytest.approx(tensions(one)[4], rel=1e-9)


def test_a_tether_lost_from_the_start_and_in_the_state(tmp_path: Path) -> None:
    one = component(tmp_path, MOVING | {"tendon_intact[1]": 0.0}, tendons=TUBES)
    assert tensions(one)[0] == 0.0
    for k in range(30):
        put(one, "elevation", 0.1 * k)
        put(one, "tendon_intact[9]", float(k < 20))
        one.do_step(0.1 * k, 0.1)
    state = one._fmu_state_from_bytes(one._fmu_state_to_bytes(one._get_fmu_state()))
    other = component(tmp_path)
    other._set_fmu_state(state)
    outputs = [i for i, variable in enumerate(one.table) if variable.causality == "output"]
    for k in range(30, 60):
        for each in (one, other):
            put(each, "tendon_intact[9]", float(k > 45))
            each.do_step(0.1 * k, 0.1)
        assert one.get_real(outputs) == other.get_real(outputs)
    assert tensions(other)[0] == 0.0 < tensions(other)[8]


def test_points_and_airgap(tmp_path: Path) -> None:
    one = component(tmp_path, MOVING | {"point[2].x": -10.0, "initial_position.yaw": 0.5, "elevation": 3.0})
    assert get(one, "airgap") == pytest.approx(issc_tlp.DECK_HEIGHT - 3.0)
    fairlead = [43.125 * np.sin(0.5) * sign for sign in (-1.0, 1.0)]
    expected = [5.0 - 10.0 * np.cos(0.5) + fairlead[0], -10.0 * np.sin(0.5) + 43.125 * np.cos(0.5), -35.0]
    assert one.get_real([one.references[f"point_position[2].{axis}"] for axis in "xyz"]) == pytest.approx(expected)
    put(one, "elevation", -2.0)
    put(one, "wave_force.heave", -1e8)
    one.do_step(0.0, 0.1)
    assert get(one, "airgap") == pytest.approx(issc_tlp.DECK_HEIGHT + get(one, "position.heave") + 2.0, abs=1e-3)
    # At point 1, on the axis of yaw: heave is the same, surge has the pitch's lever; centripetal parts are some 1e-3.
    lever = get(one, "acceleration.surge") + issc_tlp.DECK_HEIGHT * (
        np.cos(get(one, "position.yaw")) * get(one, "acceleration.pitch")
        + np.sin(get(one, "position.yaw")) * get(one, "acceleration.roll")
    )
    assert get(one, "point_acceleration[1].z") == pytest.approx(get(one, "acceleration.heave"), rel=0.01)
    assert get(one, "point_acceleration[1].x") == pytest.approx(lever, rel=0.01)


def test_bottom_tension_is_less_by_the_submerged_weight(tmp_path: Path) -> None:
    one = component(tmp_path, {}, tendons=TUBES)
    np.testing.assert_allclose(np.subtract(tensions(one), tensions(one, "tendon_bottom_tension")), 415.0 * 800.0)
    plain = component(tmp_path, {})
    assert tensions(plain) == tensions(plain, "tendon_bottom_tension")
    assert model(tendons=TUBES).mass[2, 2] - model().mass[2, 2] == pytest.approx(12 * 415.0 * 1049.78 / 3.0, rel=1e-5)


def test_tethers_go_down_to_the_sea_bed() -> None:
    assert model(water_depth=800.0, hydrodynamics="morison").tendons.anchors[:, 2] == pytest.approx(-800.0)
    with pytest.raises(ScenarioError, match=r"tendon 1 has its anchor at z = -450 m, below the sea bed at -400 m"):
        model(water_depth=400.0, hydrodynamics="morison", tendons=TUBES)


def test_a_platform_that_capsizes_is_refused() -> None:
    free = {"tendons": TENDONLESS, "mass": 54.5e6, "hydrodynamics": "morison"}
    ratios = dict.fromkeys((f"damping_ratio.{name}" for name in ("heave", "roll", "pitch")), 0.0)
    model(**free, **ratios)  # afloat without tethers, metacentric height 6 m
    with pytest.raises(ScenarioError, match=r"unstable in (roll|pitch) at zero position.*lower the centre_of_gravity"):
        model(**free, **ratios, **{"centre_of_gravity.z": 15.0})
    model(**free, **ratios, **{"centre_of_gravity.z": 15.0, "free.roll": False, "free.pitch": False})


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="parameter radiation 'convolutoin' is not known; did you mean 'conv"):
        model(radiation="convolutoin")
    with pytest.raises(ScenarioError, match=r"nowhere\.h5"):
        model(hydrodynamics="nowhere.h5")
    path = tmp_path / "issc.h5"
    write(issc_database(), path)
    with pytest.raises(ScenarioError, match=r"issc\.h5 is for a density of 1025 kg/m³, the site has 1000 kg/m³"):
        model(hydrodynamics=str(path), water_density=1000.0)
    cut = np.arange(len(issc_database().omega)) < 2
    source = issc_database()
    few = replace(
        source,
        omega=source.omega[cut],
        added_mass=source.added_mass[cut],
        radiation_damping=source.radiation_damping[cut],
        excitation_force=source.excitation_force[:, cut],
        froude_krylov_force=source.froude_krylov_force[:, cut],
        mean_drift=source.mean_drift[:, cut],
    )
    write(few, path)
    with pytest.raises(ScenarioError, match="2 frequencies; radiation memory needs 8 or more"):
        model(hydrodynamics=str(path))
