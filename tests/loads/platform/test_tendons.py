"""Tendons: elastic lines against closed forms, the gradient of their energy, slackness, weight, inertia and drag."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import angular_velocity, generalized_force
from tlpsim.loads.platform.tendons import (
    Tendons,
    current_along_lines,
    effective_mass,
    submerged_weight,
    tendon_drag,
    tendon_energy,
    tendon_loads,
    without_lost,
)
from tlpsim.loads.waves.current import Current, current_velocity, uniform_current

POSES = st.tuples(
    st.lists(st.floats(-30.0, 30.0), min_size=2, max_size=2),
    st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=1),
    st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
).map(np.concatenate)


def single(pretension: float = 1e7) -> Tendons:
    """One vertical tendon of 400 m, straight below a fairlead off the origin."""
    return Tendons(
        fairleads=np.array([[10.0, -5.0, -20.0]]),
        anchors=np.array([[10.0, -5.0, -420.0]]),
        axial_stiffness=np.array([2e10]),
        pretension=np.array([pretension]),
    )


def test_tension_at_zero_pose_is_the_pretension() -> None:
    load, tensions, _ = tendon_loads(single(), np.zeros(6))
    # Rounding of 400 m times EA/l0 is some 1e-5 N.
    np.testing.assert_allclose(tensions, [1e7], rtol=1e-11)
    np.testing.assert_allclose(load, [0, 0, -1e7, 5e7, 1e8, 0], rtol=1e-11, atol=1e-6)


def test_single_line_at_an_offset() -> None:
    tendons = single()
    load, tensions, _ = tendon_loads(tendons, np.array([30.0, 40.0, -1.0, 0.0, 0.0, 0.0]))
    length = np.sqrt(50.0**2 + 399.0**2)
    tension = 2e10 * (length / (400.0 / (1.0 + 1e7 / 2e10)) - 1.0)
    force = tension * np.array([-30.0, -40.0, -399.0]) / length
    np.testing.assert_allclose(tensions, [tension], rtol=1e-11)
    np.testing.assert_allclose(load, [*force, *np.cross([10.0, -5.0, -20.0], force)], rtol=1e-11)


def test_yaw_moves_every_fairlead_by_its_chord() -> None:
    tendons = issc_tlp.tendons()
    yaw = 0.2
    load, tensions, _ = tendon_loads(tendons, np.array([0.0, 0.0, 0.0, 0.0, 0.0, yaw]))
    radius = np.hypot(43.125, 43.125)
    length = np.hypot(415.0, 2.0 * radius * np.sin(0.5 * yaw))
    tension = (3.37e11 / 12.0) * (length / tendons.unstretched_length[0] - 1.0)
    np.testing.assert_allclose(tensions, tension, rtol=1e-11)
    # The horizontal force acts along the chord, on the lever radius cos(yaw/2).
    assert load[5] == pytest.approx(-12.0 * tension * radius**2 * np.sin(yaw) / length, rel=1e-11)
    np.testing.assert_allclose(load[[0, 1, 3, 4]], 0.0, atol=1e-4)


@given(POSES)
def test_load_is_the_gradient_of_the_energy(pose: np.ndarray) -> None:
    tendons = issc_tlp.tendons()
    gradient = np.array([tendon_energy(tendons, pose + 1e-30j * unit).imag / 1e-30 for unit in np.eye(6)])
    load, tensions, _ = tendon_loads(tendons, pose)
    scale = 1.0 + tensions.sum() * 100.0
    np.testing.assert_allclose(generalized_force(load, pose), -gradient, rtol=0, atol=1e-12 * scale)


@given(POSES, st.floats(-np.pi, np.pi))
def test_turning_the_whole_system_turns_the_force(pose: np.ndarray, turn: float) -> None:
    tendons = issc_tlp.tendons()
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = Tendons(
        fairleads=tendons.fairleads,
        anchors=tendons.anchors @ rotation.T,
        axial_stiffness=tendons.axial_stiffness,
        pretension=tendons.pretension,
    )
    # Anchors turned alone would be longer at zero pose: only lines of the same unstretched length compare.
    object.__setattr__(turned, "unstretched_length", tendons.unstretched_length)
    pose_turned = np.concatenate((rotation @ pose[:3], pose[3:5], [pose[5] + turn]))
    load, tensions, _ = tendon_loads(tendons, pose)
    load_turned, tensions_turned, _ = tendon_loads(turned, pose_turned)
    scale = 1.0 + 100.0 * tensions.sum()
    np.testing.assert_allclose(tensions_turned, tensions, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(load_turned[:3], rotation @ load[:3], rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(load_turned[3:], rotation @ load[3:], rtol=0, atol=1e-11 * scale)


def test_slack_tendon_carries_nothing() -> None:
    tendons = issc_tlp.tendons()
    stretch_at_rest = 415.0 - tendons.unstretched_length[0]
    pose = np.zeros(6)
    pose[2] = -1.01 * stretch_at_rest
    load, tensions, _ = tendon_loads(tendons, pose)
    np.testing.assert_array_equal(tensions, 0.0)
    np.testing.assert_array_equal(load, 0.0)
    assert tendon_energy(tendons, pose) == 0.0
    pose[2] = -0.99 * stretch_at_rest
    np.testing.assert_allclose(tendon_loads(tendons, pose)[1], 0.01 * issc_tlp.TOTAL_PRETENSION / 12.0, rtol=1e-8)
    pose[4] = 0.02  # bow down: the columns at x > 0 go slack, the others do not
    assert np.all((tendon_loads(tendons, pose)[1] > 0.0) == (tendons.fairleads[:, 0] < 0.0))


HEAVY = {"mass_per_length": 1050.0, "diameter": 1.0, "submerged_weight": 2500.0, "drag_coefficient": 1.2}


def heavy(**changes: float) -> Tendons:
    """The single tendon with mass, weight and drag."""
    values = {name: np.array([value]) for name, value in (HEAVY | {"added_mass_coefficient": 1.0} | changes).items()}
    return replace(single(), **values)


def test_submerged_weight_of_a_tube() -> None:
    # 0.5 m² of water and 0.07 m² of steel a metre.
    diameter = np.sqrt(2.0 / np.pi)
    expected = 9.80665 * (0.07 * 7850.0 - 0.5 * 1025.0)
    assert submerged_weight(0.07 * 7850.0, diameter) == pytest.approx(expected, rel=1e-12)


def test_tensions_of_a_heavy_tendon_at_rest() -> None:
    tendons = heavy()
    load, tensions, bottom = tendon_loads(tendons, np.zeros(6))
    np.testing.assert_allclose(tensions, [1e7], rtol=1e-11)
    np.testing.assert_allclose(bottom, [1e7 - 400.0 * 2500.0], rtol=1e-11)
    np.testing.assert_allclose(load[:3], [0.0, 0.0, -1e7], rtol=1e-11, atol=1e-6)
    # The stretch of an elastic line under its weight: the integral of the tension over EA.
    assert 400.0 - tendons.unstretched_length[0] == pytest.approx(
        tendons.unstretched_length[0] * (1e7 - 0.5e6) / 2e10, rel=1e-9
    )


def test_a_heavy_tendon_at_an_offset_against_the_elastic_catenary() -> None:
    tendons = heavy()
    pose = np.array([30.0, -10.0, -1.3, 0.0, 0.0, 0.0])
    load, tensions, bottom = tendon_loads(tendons, pose)
    span = pose[:3] + np.array([0.0, 0.0, 400.0])
    length, reach = tendons.unstretched_length[0], np.hypot(*span[:2])
    weight = 2500.0 * 400.0 / length

    def ends(force: np.ndarray) -> np.ndarray:
        """Where an elastic line from the anchor ends whose top is pulled by `force` (horizontal, vertical)."""
        across, up = force[0], force[1] - weight * length
        at_top, at_bottom = np.hypot(across, force[1]), np.hypot(across, up)
        horizontal = (
            across / weight * (np.arcsinh(force[1] / across) - np.arcsinh(up / across)) + across * length / 2e10
        )
        vertical = (at_top - at_bottom) / weight + 0.5 * (force[1] ** 2 - up**2) / (weight * 2e10)
        return np.array([horizontal - reach, vertical - span[2]])

    found = fsolve(ends, [np.hypot(*load[:2]), -load[2]], xtol=1e-13)
    # What the straight line leaves out: the sag's (w L sin/T)²/24 of the length, here 1.3 % of the elastic stretch.
    middle = np.hypot(found[0], found[1] - 0.5 * weight * length)
    sag = 2e10 * (weight * length * reach / np.hypot(reach, span[2]) / middle) ** 2 / 24.0
    assert 0.01 * middle < sag < 0.015 * middle
    steep = span[2] / np.hypot(reach, span[2])
    np.testing.assert_allclose(-load[2] + sag * steep, found[1], rtol=1e-4)
    np.testing.assert_allclose(np.hypot(*load[:2]) + sag * reach / np.hypot(reach, span[2]), found[0], rtol=2e-3)
    assert tensions[0] + sag == pytest.approx(np.hypot(*found), rel=1e-3)
    assert bottom[0] + sag == pytest.approx(np.hypot(found[0], found[1] - weight * length), rel=1e-3)
    # The half weight at either end is exact statics, whatever the stretch: moments about the anchor.
    moments = np.cross(span, -load[:3]) + np.cross(0.5 * span, [0.0, 0.0, -2500.0 * 400.0])
    np.testing.assert_allclose(moments, 0.0, atol=1e-9 * 400.0 * 1e7)


@given(POSES)
def test_load_of_heavy_tendons_is_the_gradient_of_their_energy(pose: np.ndarray) -> None:
    tendons = replace(issc_tlp.tendons(), submerged_weight=np.array([1500.0]))
    gradient = np.array([tendon_energy(tendons, pose + 1e-30j * unit).imag / 1e-30 for unit in np.eye(6)])
    load, tensions, _ = tendon_loads(tendons, pose)
    np.testing.assert_allclose(
        generalized_force(load, pose), -gradient, rtol=0, atol=1e-12 * (1e7 + tensions.sum() * 100.0)
    )


@pytest.mark.parametrize(("direction", "stiffness"), [(2, 2e10), (0, 1e7)])
def test_effective_mass_is_that_of_a_vibrating_rod_and_string(direction: int, stiffness: float) -> None:
    """Dynamic stiffness k (a cot a), a = omega L sqrt(m/k'), of a rod (k' = EA) and a taut string (k' = T)."""
    tendons = heavy()
    inertia = effective_mass(tendons, 1025.0)[0][direction, direction]
    added = 1025.0 * 0.25 * np.pi if direction == 0 else 0.0
    argument = 0.05
    omega = argument / 400.0 * np.sqrt(stiffness / (1050.0 + added))
    dynamic = stiffness / 400.0 * argument / np.tan(argument)
    # The next term of a cot a is a⁴/45, a fifteenth of a² of the inertia's.
    assert (stiffness / 400.0 - dynamic) / omega**2 == pytest.approx(inertia, rel=2.0 * argument**2 / 15.0)


def test_effective_mass_turns_with_the_lever() -> None:
    moved = effective_mass(heavy(), 1025.0)[0]
    motion = np.hstack((np.eye(3), np.cross(np.eye(3), [10.0, -5.0, -20.0]).T))
    np.testing.assert_allclose(moved, motion.T @ moved[:3, :3] @ motion, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(moved[:3, :3], np.diag(np.diag(moved)[:3]), atol=1e-6)


@given(POSES, st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array))
@settings(max_examples=20)
def test_drag_is_that_of_the_elements_of_the_line(pose: np.ndarray, rates: np.ndarray) -> None:
    tendons = heavy()
    velocity = rates * [1.0, 1.0, 1.0, 0.02, 0.02, 0.02]
    load = tendon_drag(tendons, pose, velocity, 1025.0)
    lever = Rotation.from_euler("ZYX", pose[:2:-1]).apply([10.0, -5.0, -20.0])
    top, anchor = pose[:3] + lever, np.array([10.0, -5.0, -420.0])
    speed = velocity[:3] + np.cross(angular_velocity(pose, velocity), lever)
    along = (top - anchor) / np.linalg.norm(top - anchor)
    across = speed - (speed @ along) * along
    share = (np.arange(400) + 0.5) / 400.0
    elements = -0.5 * 1025.0 * 1.2 * 1.0 * (share**2)[:, None] * np.linalg.norm(across) * across  # N/m, 1 m each
    # Moments about the anchor give what the top carries.
    carried = (share[:, None] * elements).sum(axis=0)
    np.testing.assert_allclose(load[:3], carried, rtol=1e-5, atol=1e-9)  # the midpoint rule's 1/(400² 3)
    np.testing.assert_allclose(load[3:], np.cross(lever, load[:3]), rtol=1e-9, atol=1e-6)
    assert load[:3] @ speed <= 0.0


@pytest.mark.parametrize("exponent", [0.0, 1.0 / 7.0])
def test_drag_in_a_current_is_that_of_the_elements_of_the_line(exponent: float) -> None:
    """A line that leans, with a fairlead that moves faster than the current near the top and slower below."""
    tendons = heavy()
    current = Current(
        depth=np.array([0.0, 450.0]),
        speed=np.array([1.1, 0.3]),
        heading=np.array([0.4, 1.2]),
        exponent=exponent,
        water_depth=450.0,
    )
    pose, velocity = np.array([25.0, -10.0, -1.0, 0.0, 0.0, 0.0]), np.array([0.9, 0.5, 0.1, 0.0, 0.0, 0.0])
    flow = current_along_lines(tendons, current)
    load = tendon_drag(tendons, pose, velocity, 1025.0, flow)
    top, anchor = pose[:3] + np.array([10.0, -5.0, -20.0]), np.array([10.0, -5.0, -420.0])
    along = (top - anchor) / np.linalg.norm(top - anchor)
    share = (np.arange(4000) + 0.5) / 4000.0
    water = current_velocity(current, -420.0 + 400.0 * share)
    relative = share[:, None] * velocity[:3] - water
    relative -= (relative @ along)[:, None] * along
    elements = -0.5 * 1025.0 * 1.2 * np.linalg.norm(relative, axis=1)[:, None] * relative * 400.0 / 4000.0
    carried = (share[:, None] * elements).sum(axis=0)
    # Six points of Gauss for a polynomial but for the table's and the power's bends.
    np.testing.assert_allclose(load[:3], carried, rtol=5e-3, atol=2e-3 * np.abs(carried).max())
    np.testing.assert_allclose(load[3:], np.cross(top - pose[:3], load[:3]), rtol=1e-9, atol=1e-6)


def test_half_of_the_drag_of_a_uniform_current_is_at_the_top() -> None:
    tendons = heavy()
    flow = current_along_lines(tendons, uniform_current(0.8, 0.3))
    load = tendon_drag(tendons, np.zeros(6), np.zeros(6), 1025.0, flow)
    whole = 0.5 * 1025.0 * 1.2 * 400.0 * 0.8**2
    np.testing.assert_allclose(load[:3], 0.5 * whole * np.array([np.cos(0.3), np.sin(0.3), 0.0]), rtol=1e-12, atol=1e-9)
    # Water at rest given as a current is eq. (7): Gauss's rule has it exactly.
    velocity = np.array([0.5, 0.2, 0.0, 0.0, 0.0, 0.0])
    still = tendon_drag(tendons, np.zeros(6), velocity, 1025.0, np.zeros_like(flow))
    np.testing.assert_allclose(still, tendon_drag(tendons, np.zeros(6), velocity, 1025.0), rtol=1e-12, atol=1e-9)


def test_the_remaining_tendons_are_as_they_were() -> None:
    whole = issc_tlp.tendons(tubes=issc_tlp.steel_tubes())
    kept = np.arange(12) % 5 != 1
    left = without_lost(whole, kept)
    for each in fields(whole):
        np.testing.assert_array_equal(getattr(left, each.name), getattr(whole, each.name)[kept])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axial_stiffness": [0.0]}, "tendon 1 has axial_stiffness 0, expected > 0 N"),
        ({"pretension": [-5.0]}, "tendon 1 has pretension -5, expected >= 0 N"),
        ({"anchors": [[10.0, -5.0, -20.0]]}, "tendon 1 has length 0"),
        ({"anchors": np.zeros((2, 3))}, r"anchors has shape \(2, 3\), expected \(1, 3\)"),
        ({"pretension": [np.nan]}, "pretension holds nan"),
        ({"mass_per_length": [-1.0]}, "tendon 1 has mass_per_length -1, expected >= 0"),
        ({"drag_coefficient": [-1.0]}, "tendon 1 has drag_coefficient -1, expected >= 0"),
        ({"diameter": np.ones(2)}, r"tendon diameter has shape \(2,\), expected \(1,\)"),
        (
            {"submerged_weight": [1e5]},
            r"pretension 1e\+07, expected at least half its submerged weight, up to 2e\+07 N",
        ),
        ({"fairleads": np.zeros((1, 2))}, r"fairleads has shape \(1, 2\), expected \(n, 3\)"),
    ],
)
def test_bad_tendons_are_refused(changes: dict[str, object], message: str) -> None:
    good = single()
    values = {name: getattr(good, name) for name in ("fairleads", "anchors", "axial_stiffness", "pretension")}
    with pytest.raises(ScenarioError, match=message):
        Tendons(**(values | changes))
