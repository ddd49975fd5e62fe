"""The ISSC TLP: what its figures add up to, against figures published or quoted apart from those put in."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.equilibrium import natural_periods, single_periods
from tlpsim.loads.platform.motion import PlatformModel, initial_state, restoring_force
from tlpsim.loads.platform.tendons import submerged_weight

MODEL = issc_tlp.platform()


def test_tension_and_weight_equal_buoyancy_at_rest() -> None:
    state = initial_state(MODEL, np.zeros(6), np.zeros(6), np.zeros(6))
    body = MODEL.body
    buoyancy = body.water_density * body.gravity * body.displaced_volume
    assert state.tensions.sum() + body.mass * body.gravity == pytest.approx(buoyancy, rel=1e-9)
    np.testing.assert_allclose(restoring_force(MODEL, np.zeros(6)) / buoyancy, 0.0, atol=1e-12)


def test_derived_volume_is_that_of_the_panelled_hull() -> None:
    # 53 066.4 m³ in WAMIT's mesh; the volume derived from quoted masses is 0.2 % more.
    assert MODEL.body.displaced_volume == pytest.approx(53066.4, rel=3e-3)


def test_inertia_has_the_published_radii_of_gyration() -> None:
    # Published radii, quoted inertias; these belong to the displaced mass.
    published = 54.5e6 * np.array([38.876, 38.876, 42.420]) ** 2
    np.testing.assert_allclose(np.diag(MODEL.body.inertia), published, rtol=0.005)


def test_tether_stiffness_is_the_quoted_one() -> None:
    heave = issc_tlp.TOTAL_AXIAL_STIFFNESS / MODEL.tendons.unstretched_length[0]
    assert heave == pytest.approx(0.813e9, rel=2e-3)
    # Quoted 1.501e12 N·m/rad for the tethers alone: 0.5 % under stiffness times squared column distance.
    assert heave * (0.5 * issc_tlp.COLUMN_SPACING) ** 2 == pytest.approx(1.501e12, rel=0.01)
    np.testing.assert_allclose(np.linalg.norm(MODEL.tendons.anchors - MODEL.tendons.fairleads, axis=1), 415.0)


def test_natural_periods() -> None:
    single, coupled = single_periods(MODEL), natural_periods(MODEL)
    np.testing.assert_allclose(single, [103.6, 103.6, 1.82, 1.92, 1.92, 82.7], rtol=0.02)
    # Added mass couples pitch with surge, which shortens the pitch mode by 3 %.
    np.testing.assert_allclose(coupled, [103.6, 103.6, 1.83, 1.864, 1.864, 82.7], rtol=2e-3)


def test_added_mass_is_near_the_published_one() -> None:
    # OrcaWave at 15 s, 1 t/m³; the table's frequency is 0.1 rad/s, and they differ by a few per cent.
    added = MODEL.body.added_mass / 1.025
    expected = {
        (0, 0): 49364.7e3,
        (2, 2): 28135.9e3,
        (0, 4): -9.8904e8,
        (4, 4): 5.82609e10,
        (5, 5): 1.173413e11,
    }
    for entry, value in expected.items():
        assert added[entry] == pytest.approx(value, rel=0.05)


def test_twelve_tendons_stand_three_at_each_column() -> None:
    plan = MODEL.tendons.fairleads[:, :2].reshape(4, 3, 2)
    np.testing.assert_array_equal(plan, np.repeat(issc_tlp.COLUMN_CENTRES[:, None], 3, axis=1))
    assert np.array_equal(np.sign(plan[:, 0]), [[1, 1], [-1, 1], [-1, -1], [1, -1]])


def test_damping_only_in_the_tether_modes() -> None:
    critical = 2.0 * np.sqrt(np.diag(MODEL.mass) * np.diag(MODEL.stiffness))
    np.testing.assert_allclose(np.diag(MODEL.linear_damping) / critical, [0, 0, 0.02, 0.02, 0.02, 0], atol=1e-15)
    with pytest.raises(ScenarioError, match="damping ratio in yaw"):
        issc_tlp.platform([0, 0, 0, 0, 0, -1.0])


def test_steel_tubes_float_in_water_and_lengthen_the_periods() -> None:
    tubes = issc_tlp.steel_tubes()
    mass, diameter = float(tubes["mass_per_length"][0]), float(tubes["diameter"][0])
    # EA = 3.37e11/12 N over 210 GPa is 0.1337 m² of steel.
    assert mass == pytest.approx(0.13373 * 7850.0, rel=1e-4)
    assert submerged_weight(mass, diameter) == pytest.approx(0.0, abs=1e-9)
    heavy = replace(MODEL, tendons=issc_tlp.tendons(tubes=tubes))
    ratio = (single_periods(heavy) / single_periods(MODEL)) ** 2 - 1.0
    third = 12.0 * mass * 415.0 / 3.0
    expected = [
        2.0 * third / MODEL.mass[0, 0],
        third / MODEL.mass[2, 2],
        2.0 * third * 2.0 * 43.125**2 / MODEL.mass[5, 5],
    ]
    np.testing.assert_allclose(ratio[[0, 2, 5]], expected, rtol=1e-6)


@pytest.mark.parametrize("water_density", [1000.0, 1030.0])
def test_pretension_balances_in_other_water(water_density: float) -> None:
    pretension = issc_tlp.balancing_pretension(water_density, 9.81)
    model = PlatformModel(body=issc_tlp.body(water_density, 9.81), tendons=issc_tlp.tendons(800.0, pretension))
    buoyancy = water_density * 9.81 * issc_tlp.DISPLACED_VOLUME
    assert np.abs(restoring_force(model, np.zeros(6))).max() < 1e-9 * buoyancy
    assert model.tendons.anchors[:, 2] == pytest.approx(-800.0)


def test_water_too_light_or_too_shallow_is_refused() -> None:
    with pytest.raises(ScenarioError, match="sinks in water of 700"):
        issc_tlp.balancing_pretension(700.0)
    with pytest.raises(ScenarioError, match="water depth is 30 m"):
        issc_tlp.tendons(30.0)


def test_a_hull_of_other_draught_grows_by_its_columns() -> None:
    deeper = issc_tlp.Hull(draught=45.0)
    found, plain = issc_tlp.body(hull=deeper), issc_tlp.body()
    columns, height = 4.0 * math.pi * 8.435**2, 10.0
    assert found.displaced_volume - plain.displaced_volume == pytest.approx(columns * height, rel=1e-12)
    # The hull as it was goes down by 10 m, and the cylinders above it have their centroid at -5 m.
    volume = columns * 35.0 + 4.0 * (86.25 - 2.0 * 8.435) * 7.5 * 10.5
    centre = (volume * (plain.centre_of_buoyancy[2] - 10.0) + columns * 10.0 * -5.0) / (volume + columns * 10.0)
    assert found.centre_of_buoyancy[2] == pytest.approx(centre, rel=1e-12)
    assert found.waterplane_area == plain.waterplane_area
    pretension = issc_tlp.balancing_pretension(hull=deeper)
    model = PlatformModel(body=found, tendons=issc_tlp.tendons(pretension=pretension, draught=45.0))
    assert np.abs(restoring_force(model, np.zeros(6))).max() < 1e-9 * 9.80665 * found.mass


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass": 0.0}, "mass of the hull"),
        ({"yaw_inertia": -1.0}, "inertia of the hull"),
        ({"draught": 10.5}, r"draught of the hull is 10\.5 m"),
        ({"draught": math.nan}, "draught of the hull is nan"),
        ({"centre_of_gravity": math.inf}, "centre of gravity of the hull"),
    ],
)
def test_a_hull_out_of_range_is_refused(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        issc_tlp.Hull(**changes)
