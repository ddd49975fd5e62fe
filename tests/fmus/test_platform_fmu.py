"""Hydrodynamics of the platform FMU, tried on the component as a plain Python object."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.fmus.platform_fmu import MEMORY, TlpsimPlatform, platform_model
from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import write
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.memory import NoMemory

DEFAULTS: dict[str, Any] = {variable.name: variable.start for variable in TlpsimPlatform.table}


def model(**changes: Any) -> Any:
    return platform_model((DEFAULTS | changes).__getitem__)


def component(folder: Path, **settings: str) -> TlpsimPlatform:
    one = TlpsimPlatform(instance_name="platform", resources=str(folder))
    for name, value in settings.items():
        one.set_string([one.references[name]], [value])
    for name, value in (("initial_position.surge", 5.0), ("initial_velocity.sway", 0.5)):
        one.set_real([one.references[name]], [value])
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
    assert np.diagonal(model().body.added_mass) == pytest.approx(limit, rel=0.005)
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
