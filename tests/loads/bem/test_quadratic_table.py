"""The quadratic part at pairs of frequencies, against single pairs, the far field, and hulls without symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads.bem.control_surface import control_surface
from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.bem.mesh import whole
from tlpsim.loads.bem.quadratic import quadratic_part
from tlpsim.loads.bem.quadratic_table import quadratic_table
from tlpsim.loads.bem.quadratic_transfer import mean_drift_of, of_one_heading
from tlpsim.loads.bem.response import response_amplitudes
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import SurfaceFields, hull_surface, surface_fields
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.rigid_body import mass_matrix

MESH = box(2.0, 1.0, 0.5, 0.25)
COUPLED = np.diag([1e3, 2e3, 1e4, 3e3, 5e3, 1e3])
COUPLED[0, 5] = COUPLED[5, 0] = 200.0  # moorings without the hull's symmetry
PROBLEM = Problem(
    mesh=MESH,
    omega=np.array([1.5, 1.8, 2.4]),
    heading=np.array([0.3, 1.1]),
    depth=3.0,
    mass=mass_matrix(1025.0, [0.0, 0.0, -0.1], np.diag([3e2, 3e2, 4e2])),
    stiffness=COUPLED,
)
FOUND = quadratic_table(PROBLEM, pairs=True)
SIZE = np.max(np.abs(FOUND.transfer), axis=(0, 1, 2, 3))


def test_a_quarter_of_the_control_surface_is_the_whole() -> None:
    """The same hull as one without planes of symmetry, whose control surface is taken whole."""
    assert MESH.planes == ("x", "y")
    other = quadratic_table(replace(PROBLEM, mesh=whole(MESH)), pairs=True)
    np.testing.assert_allclose(other.transfer / SIZE, FOUND.transfer / SIZE, atol=1e-10)


def _field(omega: float) -> SurfaceFields:
    body = discretize(MESH, 3.0)
    solution = solve(body, omega, PROBLEM.heading, PROBLEM.density, PROBLEM.gravity)
    motion = response_amplitudes(solution, PROBLEM.mass, COUPLED)  # type: ignore[arg-type]
    hull = hull_surface(body)
    return surface_fields(body, solution, motion, hull, control_surface(hull, 3.0, 1.07))


def test_a_pair_of_frequencies_by_itself() -> None:
    expected = quadratic_part(_field(1.5), _field(2.4))
    # Another control surface: what its quadrature leaves, and the gradient of the field that it takes, 1 %.
    np.testing.assert_allclose(FOUND.transfer[:, :, 0, 2] / SIZE, expected / SIZE, atol=0.01)
    np.testing.assert_allclose(FOUND.transfer[:, :, 2, 0], np.swapaxes(FOUND.transfer[:, :, 0, 2], 0, 1).conj())
    assert np.max(np.abs(expected.imag)) > 0.1 * np.max(np.abs(expected))


def test_the_diagonal_is_the_mean_drift_of_the_database() -> None:
    """Moving and fixed, on one mesh and extrapolated."""
    pair = {"mesh": box(2.0, 1.0, 0.5, 0.2), "coarse": box(2.0, 1.0, 0.5, 0.4)}
    for problem in (PROBLEM, replace(PROBLEM, mass=None, stiffness=None), replace(PROBLEM, **pair)):
        told: list[tuple[int, int]] = []
        found = quadratic_table(problem, progress=lambda *done, told=told: told.append(done))  # type: ignore[misc]
        assert told == [(1, 3), (2, 3), (3, 3)]
        assert found.transfer.shape == (2, 3, 3, 6)
        drift = compute(problem).mean_drift
        size = np.max(np.abs(drift), axis=(0, 1))
        # Far field against a control surface that is made for the shortest wave.
        np.testing.assert_allclose(mean_drift_of(found)[..., [0, 1, 5]] / size, drift / size, atol=3e-3)
        body = "fixed" if problem.mass is None else "moving"
        assert f"potential of second order is left out; {body} body" in found.contents
        assert (found.depth, found.density, found.gravity) == (3.0, problem.density, problem.gravity)


def test_one_heading_is_a_part_of_pairs() -> None:
    alone = quadratic_table(replace(PROBLEM, heading=PROBLEM.heading[1:]))
    expected = of_one_heading(FOUND)[1:]
    np.testing.assert_allclose(alone.transfer / SIZE, expected / SIZE, atol=1e-10)


def test_pressure_is_another_form() -> None:
    other = quadratic_table(PROBLEM, form="pressure", pairs=True)
    assert "form 'pressure'" in other.contents
    expected = quadratic_part(_field(1.5), _field(2.4), "pressure")
    np.testing.assert_allclose(other.transfer[:, :, 0, 2], expected, rtol=1e-6, atol=1e-8 * np.max(SIZE))


def test_what_cannot_be_computed_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"are \[1\.\] rad/s; at least 2"):
        quadratic_table(replace(PROBLEM, omega=np.array([1.0])))
    with pytest.raises(ScenarioError, match="'far'; one of"):
        quadratic_table(PROBLEM, form="far")
