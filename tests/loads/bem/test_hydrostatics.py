"""Hydrostatics against closed forms, against the waterline's polygon and against the pressure on a displaced hull."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.bem.hulls import box, cylinder, hemisphere, issc_hull, tlp
from tlpsim.loads.bem.hydrostatics import hydrostatics, weight_stiffness
from tlpsim.loads.bem.mesh import Mesh, translated, waterline_loops, whole
from tlpsim.loads.errors import ScenarioError

DENSITY, GRAVITY = 1025.0, 9.81


def test_box_and_hemisphere_have_their_closed_forms() -> None:
    length, beam, draft = 6.0, 4.0, 2.5
    still = hydrostatics(box(length, beam, draft, 0.7), DENSITY, GRAVITY)
    assert still.volume == pytest.approx(length * beam * draft)
    np.testing.assert_allclose(still.centre_of_buoyancy, [0.0, 0.0, -draft / 2.0], atol=1e-12)
    assert still.waterplane_area == pytest.approx(length * beam)
    moments = [length**3 * beam / 12.0, length * beam**3 / 12.0, 0.0]
    np.testing.assert_allclose(still.waterplane_second_moments, moments, atol=1e-12)
    height = beam**2 / 12.0 / draft - draft / 2.0  # of the metacentre over the water: BM + z_b
    assert still.stiffness[3, 3] == pytest.approx(DENSITY * GRAVITY * still.volume * height)
    # Volume and water plane of the panelled hemisphere are exact, its shape is not: 10 panels a quadrant give 0.3 %.
    ball = hydrostatics(hemisphere(2.0, 10, 10))
    assert ball.volume == pytest.approx(2.0 / 3.0 * np.pi * 8.0)
    assert ball.centre_of_buoyancy[2] == pytest.approx(-3.0 / 8.0 * 2.0, rel=4e-3)


@pytest.mark.parametrize(
    "mesh", [tlp(issc_hull(), 6.0), translated(cylinder(3.0, 5.0, 4, 4, 2), [2.0, -1.0, 0.0])], ids=lambda m: m.name
)
def test_water_plane_is_that_of_the_waterline(mesh: Mesh) -> None:
    """Green's theorem on the polygons of the waterline, which the integrals over the hull know nothing of."""
    still = hydrostatics(mesh)
    a, b = np.moveaxis(waterline_loops(whole(mesh))[:, ::-1, :2], 1, 0)  # anticlockwise around the body's inside
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    sign = np.sign(np.sum(twice))
    assert still.waterplane_area == pytest.approx(sign * np.sum(twice) / 2.0)
    first = sign * twice @ (a + b) / 6.0
    np.testing.assert_allclose(still.waterplane_first_moments, first, atol=1e-9 * still.waterplane_area)
    squares = sign * twice @ (a**2 + a * b + b**2) / 12.0
    np.testing.assert_allclose(still.waterplane_second_moments[:2], squares)
    product = 2.0 * (a[:, 0] * a[:, 1] + b[:, 0] * b[:, 1]) + a[:, 0] * b[:, 1] + b[:, 0] * a[:, 1]
    expected = sign * twice @ product / 24.0
    assert still.waterplane_second_moments[2] == pytest.approx(expected, abs=1e-9 * np.max(squares))


def rotation(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """To first order, which is all that a derivative asks for."""
    x, y, z = angles
    return np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]])


def buoyancy(mesh: Mesh, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force and moment about the moving reference point of the pressure -ρ g z on a displaced hull.

    The strip that leaves or enters the water has a height and a pressure of first order, and so a force of second.
    """
    corners = whole(mesh).vertices @ rotation(pose[3:]).T + pose[:3]
    total = np.zeros(6)
    for triangle in (corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]):
        vector = 0.5 * np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
        for start in range(3):  # midpoints of the sides integrate z x exactly
            middle = 0.5 * (triangle[:, start] + triangle[:, (start + 1) % 3])
            force = DENSITY * GRAVITY * middle[:, 2:] * vector / 3.0
            total += np.concatenate([force.sum(axis=0), np.cross(middle - pose[:3], force).sum(axis=0)])
    return total


@pytest.mark.parametrize(
    "mesh", [tlp(issc_hull(), 8.0), translated(box(6.0, 4.0, 2.5, 1.0), [1.5, -0.8, 0.0])], ids=lambda m: m.name
)
def test_stiffness_is_the_change_of_the_pressure_force(mesh: Mesh) -> None:
    stiffness = hydrostatics(mesh, DENSITY, GRAVITY).stiffness
    step = 1e-4
    columns = []
    for mode in range(6):
        pose = np.zeros(6)
        pose[mode] = step
        columns.append(-(buoyancy(mesh, pose) - buoyancy(mesh, -pose)) / (2.0 * step))
    # Second-order terms cancel in the central difference; rounding of the force over the step leaves 1e-9.
    np.testing.assert_allclose(np.stack(columns, axis=1), stiffness, atol=1e-7 * np.max(np.abs(stiffness)))


def test_weight_pulls_at_the_centre_of_gravity() -> None:
    mass, centre, step = 5.0e3, np.array([1.5, -0.8, 2.0]), 1e-5
    stiffness = weight_stiffness(mass, centre, GRAVITY)
    for mode in range(3, 6):
        angles = np.zeros(3)
        angles[mode - 3] = step
        moment = np.cross(rotation(angles) @ centre - centre, [0.0, 0.0, -mass * GRAVITY])
        np.testing.assert_allclose(-moment / step, stiffness[3:, mode], atol=1e-6 * mass)


def test_symmetric_hulls_have_exact_zeros() -> None:
    still = hydrostatics(tlp(issc_hull(), 8.0))
    assert np.all(still.waterplane_first_moments == 0.0)
    np.testing.assert_array_equal(still.stiffness, np.diag(np.diag(still.stiffness)))


def test_mesh_inside_out_is_refused() -> None:
    mesh = box(2.0, 1.0, 0.5, 0.5)
    with pytest.raises(ScenarioError, match="reverse"):
        hydrostatics(replace(mesh, vertices=mesh.vertices[:, ::-1]))
