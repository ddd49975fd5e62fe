import numpy as np
import pytest

from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import box, hemisphere
from tlpsim.loads.bem.mesh import translated
from tlpsim.loads.bem.response import energy_balance, far_field_damping, mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.errors import ScenarioError

MESH = box(2.0, 1.0, 0.5, 0.2)
STILL = np.zeros((1, 6))


@pytest.mark.parametrize("depth", [np.inf, 1.5])
def test_damping_is_the_energy_of_the_far_waves(depth: float) -> None:
    body = discretize(hemisphere(1.0, 14, 9), depth)
    solution = solve(body, 1.0, [0.0], 1.0, 1.0)
    far = far_field_damping(body, solution)
    np.testing.assert_allclose(far[[0, 2], [0, 2]], solution.radiation_damping[[0, 2], [0, 2]], rtol=5e-3)


@pytest.mark.parametrize("depth", [np.inf, 1.0])
def test_a_fixed_body_scatters_what_it_takes(depth: float) -> None:
    body = discretize(MESH, depth)
    solution = solve(body, 1.5, [0.0, 0.7], 1.0, 1.0)
    np.testing.assert_allclose(energy_balance(body, solution), 1.0, rtol=1e-2)


def test_drift_of_short_waves_on_a_wall_is_full_reflection() -> None:
    """A short wave on a wide box: ρ g / 2 per metre of beam, less what its ends let by."""
    wide = box(1.0, 40.0, 3.0, 0.6)
    body = discretize(wide)
    solution = solve(body, np.sqrt(2.0), [0.0], 1.0, 1.0)
    surge = mean_drift(body, solution, STILL)[0, 0] / (0.5 * 40.0)
    assert surge == pytest.approx(1.0, abs=0.06)


def test_drift_moment_turns_with_the_origin() -> None:
    heading = [0.4]
    here = discretize(MESH)
    there = discretize(translated(MESH, (1.0, 2.0, 0.0)))
    first, second = (mean_drift(b, solve(b, 1.2, heading, 1.0, 1.0), STILL)[0] for b in (here, there))
    np.testing.assert_allclose(second[:2], first[:2], rtol=1e-8)
    assert second[2] == pytest.approx(first[2] + 1.0 * first[1] - 2.0 * first[0], rel=1e-8)


def test_a_free_body_of_the_waters_mass_follows_long_waves() -> None:
    mass = np.diag([1.0, 1.0, 1.0, 0.3, 0.5, 0.5])
    stiffness = np.diag([0.0, 0.0, 2.0, 0.3, 0.9, 0.0])
    body = discretize(MESH)
    solution = solve(body, 0.1, [0.0], 1.0, 1.0)
    motion = response_amplitudes(solution, mass, stiffness)[0]
    # η = exp(iωt - ikx): the water moves forwards under a crest, so that surge is -i η.
    assert motion[2] == pytest.approx(1.0, abs=0.03)
    assert motion[0] == pytest.approx(-1.0j, abs=0.03)
    assert motion[1] == pytest.approx(0.0, abs=1e-9)


def test_a_mode_of_infinite_stiffness_is_held() -> None:
    body = discretize(MESH)
    solution = solve(body, 1.0, [0.3], 1.0, 1.0)
    stiffness = np.diag([0.0, 0.0, np.inf, np.inf, np.inf, 0.0])
    motion = response_amplitudes(solution, np.eye(6), stiffness)
    assert np.all(motion[:, 2:5] == 0.0)
    assert np.all(motion[:, [0, 1, 5]] != 0.0)
    with pytest.raises(ScenarioError, match="stiffness"):
        response_amplitudes(solution, np.eye(6), np.eye(3))
