"""The keys of `[platform]`: what they are by default, what follows from them, and what is refused."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tlpsim.scenarios.schema
from tlpsim.fmus.platform_fmu import TlpsimPlatform, platform_model
from tlpsim.fmus.tables import record_from_json
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wave_parameters import mean_force
from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.equilibrium import natural_periods
from tlpsim.loads.platform.motion import PlatformModel, restoring_force
from tlpsim.loads.platform.tendons import Tendons
from tlpsim.scenarios.parameters import parameter_values, standard_parameters
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import PONTOON_HEIGHT, Platform, PlatformTendons

FILES = Path(tlpsim.scenarios.schema.__file__).parent
WITHOUT_DATABASE = {"platform": {"hydrodynamics": "morison"}, "waves": {"drift": "none"}}


def scenario(**platform: Any) -> Scenario:
    return Scenario.from_dict(WITHOUT_DATABASE).with_(platform=platform)


def model(given: Scenario) -> PlatformModel:
    return platform_model(parameter_values(TlpsimPlatform, standard_parameters(given, "platform")))


def test_defaults_are_those_of_the_issc_tlp() -> None:
    platform, tendons = Platform(), PlatformTendons()
    assert {each.name: getattr(platform, each.name) for each in fields(issc_tlp.Hull)} == {
        each.name: each.default for each in fields(issc_tlp.Hull)
    }
    assert platform.drag_coefficient == issc_tlp.DRAG_COEFFICIENT
    assert tendons.axial_stiffness == issc_tlp.TOTAL_AXIAL_STIFFNESS
    assert tendons.drag_coefficient == issc_tlp.TENDON_DRAG_COEFFICIENT
    assert PONTOON_HEIGHT == issc_tlp.PONTOON_HEIGHT


def test_by_default_the_fmus_are_told_their_own_defaults() -> None:
    """Whatever `[platform]` gives the FMUs is what they have without it."""
    for name, component in (("wave", TlpsimWave), ("platform", TlpsimPlatform)):
        starts = {variable.name: variable.start for variable in component.table}
        told = standard_parameters(Scenario(), name)
        keys = {"hull", "drag_coefficient", "mass", "displaced_volume", "point[2].z", "hydrodynamics"}
        keys |= {key for key in told if key.startswith(("inertia.", "centre_of_"))}
        for key in keys & set(told):
            assert told[key] == starts[key], key
    tendons = record_from_json(Tendons, standard_parameters(Scenario(), "platform")["tendons"], "tendons")
    plain = issc_tlp.tendons(pretension=issc_tlp.balancing_pretension())
    for name in ("fairleads", "anchors", "axial_stiffness", "pretension", "unstretched_length"):
        np.testing.assert_array_equal(getattr(tendons, name), getattr(plain, name))
    for name in ("mass_per_length", "submerged_weight", "diameter"):
        assert not getattr(tendons, name).any()


def test_keys_take_units() -> None:
    platform = Scenario.from_dict(
        {
            "platform": {
                "mass": "37_700 t",
                "centre_of_gravity": "-400 cm",
                "roll_inertia": "8e7 t.m2",
                "yaw_inertia": "9e10 kg·m²",
                "draught": "0.036 km",
                "drag_coefficient": "120 %",
                "tendons": {"axial_stiffness": "176_000 MN", "diameter": "800 mm", "mass_per_length": "0.9 t/m"},
            }
        }
    ).platform
    assert (platform.mass, platform.centre_of_gravity, platform.draught) == pytest.approx((37.7e6, -4.0, 36.0))
    assert (platform.roll_inertia, platform.yaw_inertia, platform.drag_coefficient) == pytest.approx((8e10, 9e10, 1.2))
    tendons = platform.tendons
    assert (tendons.axial_stiffness, tendons.diameter, tendons.mass_per_length) == pytest.approx((1.76e11, 0.8, 900.0))


@pytest.mark.parametrize(
    ("platform", "words"),
    [
        ({"mass": 0}, ["platform.mass = 0", "greater than 0", "default is 40500000.0"]),
        ({"mass": "3 m"}, ["platform.mass", "'m' is not a unit of mass"]),
        ({"draught": 10.5}, ["platform.draught = 10.5", "greater than 10.5"]),
        ({"draught": 450}, ["site.water_depth", "draught of issc_tlp, 450 m"]),
        ({"drag_coefficient": -1}, ["platform.drag_coefficient = -1", "at least 0"]),
        ({"tendons": {"stiffness": 1}}, ["platform.tendons.stiffness", "did you mean 'axial_stiffness'"]),
        ({"tendons": {"axial_stiffness": "3 m"}}, ["platform.tendons.axial_stiffness", "unit of force"]),
        (
            {"tendons": {"pretension": "165 MN"}},
            ["platform.tendons.pretension", "54.5e6 kg", "1.3729e+08 N", "platform.mass to 3.7675e+07 kg"],
        ),
    ],
)
def test_refusals(platform: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(ScenarioError) as caught:
        Scenario.from_dict({"platform": platform})
    for word in words:
        assert word in str(caught.value)


def test_a_platform_that_sinks_is_refused_with_the_largest_mass() -> None:
    with pytest.raises(ScenarioError, match=r"5\.5e\+07 kg sinks .* a mass of less than 5\.45e\+07 kg"):
        model(scenario(mass=55e6))


def test_a_pretension_within_a_thousandth_of_the_buoyancy_is_taken_as_it_is() -> None:
    # 37.7e6 kg and 165 MN leave 0.05 % of the buoyancy; the water plane and the tethers answer with a fraction of a mm.
    chosen = scenario(mass=37.7e6, tendons={"pretension": "165 MN"})
    assert model(chosen).tendons.pretension.sum() == pytest.approx(165e6, rel=1e-12)


@given(
    st.floats(20e6, 45e6),
    st.floats(28.0, 60.0),
    st.floats(-10.0, 10.0),
    st.floats(1e11, 1e12),
    st.floats(200.0, 1500.0),
)
def test_every_hull_rests_on_its_tethers(
    mass: float, draught: float, height: float, stiffness: float, depth: float
) -> None:
    chosen = scenario(mass=mass, draught=draught, centre_of_gravity=height, tendons={"axial_stiffness": stiffness})
    chosen = chosen.with_(site={"water_depth": depth})
    found = model(chosen)
    weight = 9.80665 * mass
    assert np.abs(restoring_force(found, np.zeros(6))).max() < 1e-9 * weight
    # Tethers hang straight down from the keel to the sea bed.
    np.testing.assert_allclose(found.tendons.fairleads[:, 2], -draught, rtol=1e-12)
    np.testing.assert_allclose(found.tendons.anchors[:, 2], -depth, rtol=1e-12)
    length = depth - draught
    lift = stiffness / (length / (1.0 + found.tendons.pretension.sum() / stiffness))
    surface = 1025.0 * 9.80665 * issc_tlp.WATERPLANE_AREA
    assert found.stiffness[2, 2] == pytest.approx(lift + surface, rel=1e-9)
    assert found.stiffness[0, 0] == pytest.approx(found.tendons.pretension.sum() / length, rel=1e-9)
    assert found.body.centre_of_gravity[2] == height


def test_a_softer_longer_tether_moves_slower() -> None:
    # Table I's: surge goes with the root of L (M + A) / T, heave with that of L (M + A) / EA.
    plain, other = (
        model(scenario()),
        model(scenario(mass=37.7e6, tendons={"axial_stiffness": 1.76e11}).with_(site={"water_depth": 521.7})),
    )
    surge, heave = (natural_periods(each)[[0, 2]] for each in (plain, other))
    ratio = np.array(heave) / np.array(surge)
    total = (np.array([other.mass[0, 0], other.mass[2, 2]]) / np.array([plain.mass[0, 0], plain.mass[2, 2]])) ** 0.5
    tension = other.tendons.pretension.sum() / plain.tendons.pretension.sum()
    expected = total * (486.7 / 415.0) ** 0.5 / np.array([tension, 1.76 / 3.37]) ** 0.5
    np.testing.assert_allclose(
        ratio, expected, rtol=0.01
    )  # surge turns a little with pitch, the water plane adds to EA/L


def test_the_hull_reaches_both_fmus_in_the_same_words() -> None:
    chosen = Scenario.from_dict({"platform": {"mass": 37.7e6, "draught": 40.0, "drag_coefficient": 0.0}})
    wave, platform = (standard_parameters(chosen, name) for name in ("wave", "platform"))
    assert wave["hull"] == platform["hull"]
    assert json.loads(wave["hull"])["mass"] == platform["mass"] == 37.7e6
    assert platform["point[2].z"] == -40.0
    assert platform["displaced_volume"] == pytest.approx(
        issc_tlp.DISPLACED_VOLUME + 4.0 * np.pi * 8.435**2 * 5.0, rel=1e-12
    )
    assert wave["drag_coefficient"] == 0.0


def test_drag_goes_with_its_coefficient_and_with_the_length_of_the_columns() -> None:
    def drag(**platform: Any) -> np.ndarray:
        chosen = scenario(**platform).with_(
            waves={"significant_height": 0.0}, current={"speed": 1.0, "heading_deg": 0.0}
        )
        return mean_force(parameter_values(TlpsimWave, standard_parameters(chosen, "wave")))

    assert not drag(drag_coefficient=0.0).any()
    np.testing.assert_allclose(drag(drag_coefficient=1.2), 1.5 * drag(), rtol=1e-12, atol=1e-6)
    # Four columns of 10 m more, two pontoons across the flow as before.
    longer = 0.5 * 1025.0 * 0.8 * 2.0 * 8.435 * 4.0 * 10.0
    assert drag(draught=45.0)[0] - drag()[0] == pytest.approx(longer, rel=1e-9)


def test_parameters_of_the_component_win(tmp_path: Path) -> None:
    chosen = scenario(mass=37.7e6).with_(
        simulation={"duration": 2.0, "start": "rest"}, components={"platform": {"parameters": {"mass": 39e6}}}
    )
    results = run_scenario(chosen, tmp_path / "r.h5")
    # Of 39e6 kg in place of 37.7e6 the platform hangs lower, by the weight over the tethers' stiffness.
    assert results.signal("platform.acceleration.heave")[0] < 0.0


def test_co_simulation_of_another_platform_at_rest(tmp_path: Path) -> None:
    chosen = scenario(mass=37.7e6, draught=40.0, centre_of_gravity=-4.0, tendons={"axial_stiffness": 1.76e11}).with_(
        simulation={"duration": 10.0},
        site={"water_depth": 521.7},
        wind={"speed": 0.0},
        waves={"significant_height": 0.0},
        current={"speed": 0.0},
    )
    results = run_scenario(chosen, tmp_path / "r.h5")
    for degree in ("surge", "heave", "pitch"):
        assert np.abs(results.signal(f"platform.position.{degree}")).max() < 1e-9
    pull = sum(results.signal(f"platform.tendon_tension[{i + 1}]")[-1] for i in range(12))
    buoyancy = 1025.0 * 9.80665 * (issc_tlp.DISPLACED_VOLUME + issc_tlp.WATERPLANE_AREA * 5.0)
    assert pull == pytest.approx(buoyancy - 37.7e6 * 9.80665, rel=1e-9)


def test_tethers_with_a_tube_have_its_weight_in_water() -> None:
    tendons = model(scenario(tendons={"diameter": 1.0, "mass_per_length": 1000.0, "drag_coefficient": 0.7})).tendons
    np.testing.assert_allclose(tendons.submerged_weight, (1000.0 - 1025.0 * np.pi / 4.0) * 9.80665, rtol=1e-12)
    np.testing.assert_array_equal(tendons.drag_coefficient, np.full(12, 0.7))
    np.testing.assert_array_equal(tendons.added_mass_coefficient, np.ones(12))


@pytest.mark.parametrize("name", ["table_i", "table_i_issc_hull"])
def test_the_scenarios_of_table_i(name: str) -> None:
    """Whatever the fitted numbers are: a platform at rest, and segments that stand where their comment says."""
    chosen = Scenario.load(FILES / f"{name}.toml").with_(platform={"hydrodynamics": "morison"}, waves={"drift": "none"})
    found = model(chosen)
    assert np.abs(restoring_force(found, np.zeros(6))).max() < 1e-9 * 9.80665 * found.body.mass
    wind = chosen.wind
    assert wind.segments is not None
    assert sum(each.area for each in wind.segments) == 3000.0
    place = np.array([each.position for each in wind.segments])
    heading = np.radians(wind.heading_deg)
    # All stand in one plane across the wind, evenly apart in it, at two heights 20 m apart; to its right.
    np.testing.assert_allclose(place[:, :2] @ [np.cos(heading), np.sin(heading)], 0.0, atol=2e-3)
    across = (place[:, :2] @ [-np.sin(heading), np.cos(heading)]).reshape(2, 3)
    np.testing.assert_allclose(np.ptp(np.diff(across)), 0.0, atol=5e-3)
    assert across.mean() < 0.0
    np.testing.assert_allclose(np.diff(place[:, 2].reshape(2, 3), axis=0), 20.0)
