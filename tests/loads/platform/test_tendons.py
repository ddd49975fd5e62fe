"""Tendons: exact elastic lines against closed forms, the gradient of their energy, and slackness."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import generalized_force
from tlpsim.loads.platform.tendons import Tendons, tendon_energy, tendon_loads

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
    load, tensions = tendon_loads(single(), np.zeros(6))
    # Rounding of 400 m times EA/l0 is some 1e-5 N.
    np.testing.assert_allclose(tensions, [1e7], rtol=1e-11)
    np.testing.assert_allclose(load, [0, 0, -1e7, 5e7, 1e8, 0], rtol=1e-11, atol=1e-6)


def test_single_line_at_an_offset() -> None:
    tendons = single()
    load, tensions = tendon_loads(tendons, np.array([30.0, 40.0, -1.0, 0.0, 0.0, 0.0]))
    length = np.sqrt(50.0**2 + 399.0**2)
    tension = 2e10 * (length / (400.0 / (1.0 + 1e7 / 2e10)) - 1.0)
    force = tension * np.array([-30.0, -40.0, -399.0]) / length
    np.testing.assert_allclose(tensions, [tension], rtol=1e-11)
    np.testing.assert_allclose(load, [*force, *np.cross([10.0, -5.0, -20.0], force)], rtol=1e-11)


def test_yaw_moves_every_fairlead_by_its_chord() -> None:
    tendons = issc_tlp.tendons()
    yaw = 0.2
    load, tensions = tendon_loads(tendons, np.array([0.0, 0.0, 0.0, 0.0, 0.0, yaw]))
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
    load, tensions = tendon_loads(tendons, pose)
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
    load, tensions = tendon_loads(tendons, pose)
    load_turned, tensions_turned = tendon_loads(turned, pose_turned)
    scale = 1.0 + 100.0 * tensions.sum()
    np.testing.assert_allclose(tensions_turned, tensions, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(load_turned[:3], rotation @ load[:3], rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(load_turned[3:], rotation @ load[3:], rtol=0, atol=1e-11 * scale)


def test_slack_tendon_carries_nothing() -> None:
    tendons = issc_tlp.tendons()
    stretch_at_rest = 415.0 - tendons.unstretched_length[0]
    pose = np.zeros(6)
    pose[2] = -1.01 * stretch_at_rest
    load, tensions = tendon_loads(tendons, pose)
    np.testing.assert_array_equal(tensions, 0.0)
    np.testing.assert_array_equal(load, 0.0)
    assert tendon_energy(tendons, pose) == 0.0
    pose[2] = -0.99 * stretch_at_rest
    np.testing.assert_allclose(tendon_loads(tendons, pose)[1], 0.01 * issc_tlp.TOTAL_PRETENSION / 12.0, rtol=1e-8)
    pose[4] = 0.02  # bow down: the columns at x > 0 go slack, the others do not
    assert np.all((tendon_loads(tendons, pose)[1] > 0.0) == (tendons.fairleads[:, 0] < 0.0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axial_stiffness": [0.0]}, "tendon 1 has axial_stiffness 0, expected > 0 N"),
        ({"pretension": [-5.0]}, "tendon 1 has pretension -5, expected >= 0 N"),
        ({"anchors": [[10.0, -5.0, -20.0]]}, "tendon 1 has length 0"),
        ({"anchors": np.zeros((2, 3))}, r"anchors has shape \(2, 3\), expected \(1, 3\)"),
        ({"pretension": [np.nan]}, "pretension holds nan"),
        ({"fairleads": np.zeros((1, 2))}, r"fairleads has shape \(1, 2\), expected \(n, 3\)"),
    ],
)
def test_bad_tendons_are_refused(changes: dict[str, object], message: str) -> None:
    good = single()
    values = {name: getattr(good, name) for name in ("fairleads", "anchors", "axial_stiffness", "pretension")}
    with pytest.raises(ScenarioError, match=message):
        Tendons(**(values | changes))
