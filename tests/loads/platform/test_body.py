"""Body: mass matrix, frames and hydrostatics against point masses, scipy and wall-sided stability."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import (
    Body,
    angular_velocity,
    generalized_force,
    hydrostatic_energy,
    hydrostatic_load,
    mass_matrix,
    rotation_matrix,
)

ANGLES = st.lists(st.floats(-1.2, 1.2), min_size=3, max_size=3).map(np.array)
POSES = st.tuples(st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3), ANGLES).map(np.concatenate)


def box(length: float = 60.0, breadth: float = 20.0, draught: float = 5.0, gravity_height: float = 1.0) -> Body:
    """Homogeneously wall-sided barge that floats on its own."""
    volume = length * breadth * draught
    mass = 1025.0 * volume
    return Body(
        mass=mass,
        centre_of_gravity=np.array([0.0, 0.0, gravity_height]),
        inertia=np.diag([mass * 30.0, mass * 300.0, mass * 300.0]),
        added_mass=np.zeros((6, 6)),
        displaced_volume=volume,
        centre_of_buoyancy=np.array([0.0, 0.0, -0.5 * draught]),
        waterplane_area=length * breadth,
        waterplane_moments=np.array([length * breadth**3, breadth * length**3]) / 12.0,
    )


def test_mass_matrix_is_that_of_point_masses() -> None:
    generator = np.random.default_rng(3)
    masses, points = generator.uniform(1.0, 2.0, 20), generator.normal(size=(20, 3))
    expected = np.zeros((6, 6))
    for mass, point in zip(masses, points, strict=True):
        motion = np.hstack((np.eye(3), np.cross(np.eye(3), point).T))  # velocity for unit rates
        expected += mass * motion.T @ motion
    total = masses.sum()
    centre = masses @ points / total
    arms = points - centre
    inertia = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(masses, arms, strict=True))
    body = replace(box(), mass=total, centre_of_gravity=centre, inertia=inertia)
    np.testing.assert_allclose(mass_matrix(body), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@given(ANGLES)
def test_rotation_is_yaw_pitch_roll(angles: np.ndarray) -> None:
    expected = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()
    np.testing.assert_allclose(rotation_matrix(angles), expected, atol=1e-14)


@given(POSES, st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9).map(np.array))
def test_generalized_force_has_the_power_of_the_load(pose: np.ndarray, values: np.ndarray) -> None:
    moment, rates = values[:3], values[3:6]
    turn = rotation_matrix(pose[3:])
    spin = rotation_matrix(pose[3:] + 1e-30j * rates).imag / 1e-30 @ turn.T  # the cross matrix of omega
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    general = generalized_force(np.concatenate((values[6:], moment)), pose)
    np.testing.assert_array_equal(general[:3], values[6:])
    assert general[3:] @ rates == pytest.approx(moment @ omega, abs=1e-13)


@given(POSES)
def test_hydrostatic_load_is_the_gradient_of_its_energy(pose: np.ndarray) -> None:
    body = replace(box(), centre_of_gravity=np.array([0.4, -0.3, 1.0]))
    gradient = [hydrostatic_energy(body, pose + 1e-30j * unit).imag / 1e-30 for unit in np.eye(6)]
    force = generalized_force(hydrostatic_load(body, pose), pose)
    np.testing.assert_allclose(-force, gradient, rtol=0, atol=1e-12 * body.mass * body.gravity * 100.0)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_righting_moment_of_a_wall_sided_barge(yaw: float) -> None:
    body, heel = box(), 0.2
    metacentric_radius = body.waterplane_moments[0] / body.displaced_volume
    metacentric_height = metacentric_radius + body.centre_of_buoyancy[2] - body.centre_of_gravity[2]
    # Wall-sided formula: GZ = sin(heel) (GM + BM tan²(heel)/2).
    lever = np.sin(heel) * (metacentric_height + 0.5 * metacentric_radius * np.tan(heel) ** 2)
    load = hydrostatic_load(body, np.array([3.0, -2.0, 0.0, heel, 0.0, yaw]))
    righting = -(load[3] * np.cos(yaw) + load[4] * np.sin(yaw))
    assert righting == pytest.approx(body.mass * body.gravity * lever, rel=1e-12)
    assert load[2] == pytest.approx(0.0, abs=1e-9 * body.mass * body.gravity)


@pytest.mark.parametrize("pose", [(3.0, -2.0, -5.0, 0.03, -0.02, np.pi / 6.0), (0.0, 0.0, -12.0, 0.0, 0.05, 2.5)])
def test_pressure_on_four_columns_at_a_large_setdown_and_yaw(pose: tuple[float, ...]) -> None:
    """Weight of the water displaced, filament by filament of columns as the ISSC TLP's, pontoons apart."""
    radius, spacing, draught = 8.435, 86.25, 35.0
    radii, weights = np.polynomial.legendre.leggauss(8)
    radii, weights = 0.5 * radius * (radii + 1.0), 0.5 * radius * weights
    angles = 2.0 * np.pi * np.arange(16) / 16.0
    disc = np.stack([np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))], axis=-1).reshape(-1, 2)
    area = np.repeat(weights * radii, 16) * 2.0 * np.pi / 16.0
    centres = 0.5 * spacing * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    x, y = (centres[:, None] + disc).reshape(-1, 2).T
    filaments = np.tile(area, 4)
    turn = Rotation.from_euler("ZYX", pose[:2:-1]).as_matrix()
    top = -(pose[2] + turn[2, 0] * x + turn[2, 1] * y) / turn[2, 2]  # where a filament leaves the water
    wet = filaments * (top + draught)
    centroids = np.column_stack((x, y, 0.5 * (top - draught))) @ turn.T
    weight = 1025.0 * 9.80665 * wet
    pull = 1e8 * 9.80665
    gravity_arm = turn @ [0.0, 0.0, 3.0]
    moment = np.cross(centroids, np.column_stack((0.0 * weight, 0.0 * weight, weight))).sum(axis=0)
    moment -= np.cross(gravity_arm, [0.0, 0.0, pull])
    columns = 4.0 * np.pi * radius**2
    about = np.pi * radius**4 + columns * (0.5 * spacing) ** 2
    body = replace(
        issc_tlp.body(),
        mass=1e8,
        displaced_volume=columns * draught,
        centre_of_buoyancy=np.array([0.0, 0.0, -0.5 * draught]),
        waterplane_moments=np.array([about, about]),
    )
    load = hydrostatic_load(body, np.array(pose))
    # The quadrature is exact for the polynomials it meets.
    np.testing.assert_allclose(load[2], weight.sum() - pull, rtol=1e-10)
    np.testing.assert_allclose(load[3:5], moment[:2], rtol=1e-9, atol=1e-10 * pull)
    np.testing.assert_array_equal(load[[0, 1, 5]], 0.0)


@given(POSES, st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array))
def test_angular_velocity_is_that_of_the_rotation(pose: np.ndarray, rates: np.ndarray) -> None:
    turn = rotation_matrix(pose[3:])
    spin = rotation_matrix(pose[3:] + 1e-30j * rates[3:]).imag / 1e-30 @ turn.T  # the cross matrix of omega
    np.testing.assert_allclose(angular_velocity(pose, rates), [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-13)


def test_heave_changes_buoyancy_by_the_waterplane() -> None:
    body = box()
    load = hydrostatic_load(body, np.array([0.0, 0.0, -0.25, 0.0, 0.0, 0.0]))
    assert load[2] == pytest.approx(1025.0 * 9.80665 * 60.0 * 20.0 * 0.25, rel=1e-12)


def test_arrays_are_read_only_copies() -> None:
    centre = np.array([0.0, 0.0, 1.0])
    body = replace(box(), centre_of_gravity=centre)
    centre[2] = 5.0
    assert body.centre_of_gravity[2] == 1.0
    with pytest.raises(ValueError):
        body.centre_of_gravity[2] = 2.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": -1.0}, "mass is -1.0, expected a finite number > 0"),
        ({"mass": float("nan")}, "mass is nan"),
        ({"water_density": 0.0}, "water_density is 0.0"),
        ({"displaced_volume": -2.0}, "displaced_volume is -2.0, expected a finite number >= 0"),
        ({"waterplane_moments": np.array([-1.0, 1.0])}, "waterplane_moments"),
        ({"centre_of_gravity": np.zeros(2)}, r"centre_of_gravity has shape \(2,\), expected \(3,\)"),
        ({"inertia": np.diag([1.0, np.inf, 1.0])}, "inertia holds inf"),
        ({"inertia": np.diag([1.0, -1.0, 1.0])}, "inertia is not positive definite"),
        ({"added_mass": np.triu(np.ones((6, 6)))}, "added_mass is not symmetric"),
        ({"added_mass": -1e9 * np.eye(6)}, "mass matrix with added mass is not positive definite"),
    ],
)
def test_bad_bodies_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        replace(issc_tlp.body(), **changes)  # type: ignore[arg-type]
