import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special

from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.field_points import field, incident_field, panel_gradients
from tlpsim.loads.bem.hulls import cylinder, hemisphere
from tlpsim.loads.bem.mesh import panels
from tlpsim.loads.bem.rankine import panel_integrals, second_moments
from tlpsim.loads.bem.response import far_wave, total_potential
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.errors import ScenarioError

MOTION = np.array([[0.3j, 0.1, 0.9, 0.05, 0.1j, 0.02], [0.0, -0.4, 0.2j, 0.1, 0.0, 0.3]])
POINTS = np.array([[1.7, 0.4, -0.3], [0.0, 0.0, -1.3], [3.0, -2.0, -0.1], [-1.2, 0.9, -0.6]])
BODIES = {depth: discretize(hemisphere(1.0, 8, 5), depth) for depth in (np.inf, 1.5)}
SOLUTIONS = {depth: solve(body, 1.0, [0.0, 0.7], 1.0, 1.0) for depth, body in BODIES.items()}


@pytest.mark.parametrize("place", [(0.9, 0.8, -0.3), (3.0, -2.0, -4.0), (0.85, 0.2, -0.3)])
def test_gradients_of_a_panel_are_differences_of_its_integrals(place: tuple[float, float, float]) -> None:
    geometry = panels(hemisphere(1.0, 6, 4))
    moments = second_moments(geometry.corners, geometry.centre)
    j, step = 5, 1e-5

    def integrals(point: NDArray) -> NDArray:
        shape = (geometry.corners[j], geometry.normal[j], geometry.centre[j], geometry.area[j], geometry.size[j])
        return np.array(panel_integrals(*point, *shape, moments[j]))

    x = np.array(place)
    wanted = np.stack([(integrals(x + d) - integrals(x - d)) / (2 * step) for d in step * np.eye(3)])
    found = np.stack(panel_gradients(*x, geometry.corners[j], geometry.normal[j], integrals(x)[1]), axis=1)
    # Differences of numbers of size one over 2e-5, and the multipole of the far one: 1e-6 of its size.
    np.testing.assert_allclose(found, wanted, atol=2e-6 * np.max(np.abs(wanted)) + 1e-10)


@pytest.mark.parametrize("depth", [np.inf, 1.5])
def test_velocity_is_the_gradient_of_the_potential(depth: float) -> None:
    body, solution, step = BODIES[depth], SOLUTIONS[depth], 1e-3
    found = field(body, solution, MOTION, POINTS).velocity
    for axis in range(3):
        offset = step * np.eye(3)[axis]
        ahead, back = (field(body, solution, MOTION, POINTS + side * offset).potential for side in (1.0, -1.0))
        # The step's truncation, 1e-6, and that of the bottom's differences.
        np.testing.assert_allclose(found[..., axis], (ahead - back) / (2 * step), atol=1e-5)


@pytest.mark.parametrize("depth", [np.inf, 1.5])
def test_field_meets_the_free_surface_and_the_bottom(depth: float) -> None:
    body, solution = BODIES[depth], SOLUTIONS[depth]
    surface = field(body, solution, MOTION, POINTS * [1.0, 1.0, 0.0] + [3.0, 0.0, 0.0])
    # φ_z = K φ with K = 1. The Rankine part is exact, the wave part of panels 1 m off and 0.3 m wide by four points.
    np.testing.assert_allclose(surface.velocity[..., 2], surface.potential, atol=5e-4)
    if np.isfinite(depth):
        bottom = field(body, solution, MOTION, POINTS * [1.0, 1.0, 0.0] - [0.0, 0.0, depth])
        # One-sided differences there, with an error of half their step of 0.01 times the curvature.
        np.testing.assert_allclose(bottom.velocity[..., 2], 0.0, atol=5e-3)


@pytest.mark.parametrize("depth", [np.inf, 1.5])
def test_incident_wave_is_a_wave(depth: float) -> None:
    omega, headings, step = 1.0, np.array([0.3, 2.0]), 1e-4
    number = float(SOLUTIONS[depth].wavenumber)
    points = np.array([[0.4, 0.8, 0.0], [-1.0, 2.0, -0.7]])
    value, gradient = incident_field(points, number, omega, depth, headings, 1.0)
    elevation = -1j * omega * value[0]
    np.testing.assert_allclose(elevation, np.exp(-1j * number * (0.4 * np.cos(headings) + 0.8 * np.sin(headings))))
    for axis in range(3):
        offset = step * np.eye(3)[axis]
        ahead, back = (
            incident_field(points + side * offset, number, omega, depth, headings, 1.0)[0] for side in (1.0, -1.0)
        )
        np.testing.assert_allclose(gradient[..., axis], (ahead - back) / (2 * step), atol=1e-7)
    # A small body far away leaves the wave as it is, but for its water plane K² π a² = 0.8 % as a source, 6 m off.
    off = points + np.array([6.0, 0.0, 0.0])
    small = discretize(hemisphere(0.05, 4, 3), depth)
    seen = field(small, solve(small, omega, headings, 1.0, 1.0), np.zeros((2, 6)), off)
    alone, _ = incident_field(off, number, omega, depth, headings, 1.0)
    np.testing.assert_allclose(seen.potential, alone, atol=2e-3)
    np.testing.assert_allclose(seen.pressure, -1j * alone, atol=2e-3)


@pytest.mark.parametrize("depth", [np.inf, 1.5])
def test_far_off_the_field_is_the_far_wave(depth: float) -> None:
    body, solution = BODIES[depth], SOLUTIONS[depth]
    angles, radius = np.array([0.2, 1.9, 4.0]), 120.0
    points = radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=-1)
    potential, speed = total_potential(body, solution, MOTION)
    wave, _ = far_wave(body, solution, potential, speed, angles)
    alone, _ = incident_field(points, solution.wavenumber, 1.0, depth, solution.headings, 1.0)
    distance = solution.wavenumber * radius
    scattered = -1j * (field(body, solution, MOTION, points).potential - alone)
    # The next term of the far field is 1/(8 k R) of the first for a source, several times that for a dipole.
    wanted = wave * np.exp(-1j * distance) / np.sqrt(distance)
    np.testing.assert_allclose(scattered, wanted, atol=1.5e-2 * np.max(np.abs(wanted)))


def test_run_up_around_a_deep_cylinder() -> None:
    """MacCamy and Fuchs: a cylinder so deep that its bottom sees no wave."""
    mesh = cylinder(1.0, 5.0, 10, 20, 5)
    body = discretize(mesh)
    number = 1.0
    solution = solve(body, np.sqrt(number), [0.0], 1.0, 1.0)
    angles = np.linspace(0.0, np.pi, 7)
    radius = 1.1
    points = radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(7)], axis=-1)
    found = field(body, solution, np.zeros((1, 6)), points).elevation[:, 0]
    n = np.arange(25)[:, None]
    weight = np.where(n == 0, 1.0, 2.0) * (-1j) ** n
    ratio = special.jvp(n, number) / special.h2vp(n, number)
    series = weight * (special.jv(n, number * radius) - ratio * special.hankel2(n, number * radius))
    wanted = np.sum(series * np.cos(n * angles), axis=0)
    # Panels of a tenth of the wave length's 2 π, and what passes under the bottom, exp(-5) = 0.7 %.
    np.testing.assert_allclose(found, wanted, atol=1.5e-2)


def test_field_goes_on_to_the_hull() -> None:
    body, solution = BODIES[np.inf], SOLUTIONS[np.inf]
    geometry = body.panels
    potential, speed = total_potential(body, solution, MOTION)
    step = 0.25
    off = field(body, solution, MOTION, geometry.centre + step * geometry.normal)
    # Half a panel off the hull, by Taylor's formula with the known normal velocity and the field's own at the point.
    rate = np.einsum("phk,pk->ph", off.velocity, geometry.normal)
    reached = off.potential - 0.5 * step * (rate + speed[0])
    low = geometry.centre[:, 2] + step * geometry.normal[:, 2] < -0.1
    # Third derivatives times step³/12, and curvature of the hull within a panel (8 rings: 1 %).
    np.testing.assert_allclose(reached[low], potential[0][low], atol=2e-2)


def test_points_outside_the_water_are_refused() -> None:
    with pytest.raises(ScenarioError, match=r"z = 0\.5"):
        field(BODIES[1.5], SOLUTIONS[1.5], MOTION, [[2.0, 0.0, 0.5]])
    with pytest.raises(ScenarioError, match="shape"):
        field(BODIES[1.5], SOLUTIONS[1.5], MOTION, [2.0, 0.0])
    with pytest.raises(ScenarioError, match="motion"):
        field(BODIES[1.5], SOLUTIONS[1.5], MOTION[:1], POINTS)
