from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads.bem.discretization import discretize, rigid_modes
from tlpsim.loads.bem.hulls import cylinder, hemisphere
from tlpsim.loads.bem.mesh import Mesh
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import displacement, hull_surface, surface_fields
from tlpsim.loads.errors import ScenarioError


@pytest.mark.parametrize("mesh", [hemisphere(1.0, 6, 6), cylinder(1.0, 0.7, 6, 4, 3)], ids=["hemisphere", "cylinder"])
def test_waterline_is_closed_and_horizontal_normals_point_out(mesh: Mesh) -> None:
    line = hull_surface(discretize(mesh)).waterline
    np.testing.assert_allclose(line.step.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(line.middle[:, 2], 0.0, atol=1e-12)
    # A polygon of 24 sides is 0.3 % shorter than the circle of its area.
    assert np.linalg.norm(line.step, axis=1).sum() == pytest.approx(2.0 * np.pi, rel=6e-3)
    # ∮ x n_x dl is the area of the water plane.
    assert np.sum(line.middle[:, 0] * line.normal[:, 0]) == pytest.approx(np.pi, rel=1e-6)
    # Both hulls are vertical at the waterline, though the hemisphere's first ring is not.
    assert np.max(np.abs(line.normal[:, 2])) < 0.02 * np.max(line.normal[:, 0])


def test_fields_of_a_moving_hull() -> None:
    body = discretize(hemisphere(1.0, 10, 7))
    solution = solve(body, 1.0, [0.4], 1.0, 1.0)
    motion = np.array([[0.5, 0.0, 1j, 0.1, 0.2j, 0.3]])
    found = surface_fields(body, solution, motion)
    modes = rigid_modes(hemisphere(1.0, 10, 7)).reshape(-1, 6)
    # The normal velocity is i ω times the motion's own; the displacement has the same normal component.
    across = np.einsum("phk,pk->ph", found.velocity, found.hull.normal)
    np.testing.assert_allclose(across, 1j * modes @ motion.T, atol=1e-12)
    np.testing.assert_allclose(
        np.einsum("phk,pk->ph", found.displacement, found.hull.normal), modes @ motion.T, atol=1e-12
    )
    np.testing.assert_allclose(
        displacement(motion, np.array([[1.0, 2.0, 3.0]]))[0, 0],
        motion[0, :3] + np.cross(motion[0, 3:], [1.0, 2.0, 3.0]),
    )


def test_waterline_potential_by_the_free_surface_condition() -> None:
    """A wave that the hull does not disturb has the potential exp(K z), known on the waterline."""
    body = discretize(cylinder(1.0, 1.0, 8, 6, 3))
    solution = solve(body, 1.0, [0.0], 1.0, 1.0)
    count = body.hull_count
    place = np.stack([body.panels.centre[:count] * [x, y, 1.0] for x, y in body.images])
    wave = 1j * np.exp(place[..., 2] - 1j * place[..., 0])[..., None]
    found = surface_fields(body, replace(solution, diffraction=wave), np.zeros((1, 6)))
    x = found.hull.waterline.middle[:, 0]
    # Offsets of half a panel of 0.1 m: the cube of K Δ, and the gradient's error times Δ.
    np.testing.assert_allclose(found.waterline_potential[:, 0], 1j * np.exp(-1j * x), atol=2e-3)


def test_other_modes_than_those_of_a_rigid_body_are_refused() -> None:
    mesh = hemisphere(1.0, 4, 3)
    body = discretize(mesh, modes=rigid_modes(mesh)[..., :3])
    with pytest.raises(ScenarioError, match="3 modes"):
        surface_fields(body, solve(body, 1.0), np.zeros((1, 3)))
