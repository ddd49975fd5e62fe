import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special

from tlpsim.loads.bem.control_surface import control_surface
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import cylinder, hemisphere
from tlpsim.loads.bem.near_field import near_field_drift
from tlpsim.loads.bem.quadratic import newman, quadratic_part
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import SurfaceFields, hull_surface, surface_fields
from tlpsim.loads.errors import ScenarioError

HEADINGS = (0.0, 0.6)
MOTION = np.array([[0.3j, 0.1 - 0.2j, 0.5, 0.1j, 0.2, 0.1], [0.2, 0.1j, 0.6 - 0.1j, 0.05, 0.1j, -0.1]])
BODY = discretize(hemisphere(1.0, 12, 8))
HULL = hull_surface(BODY)
SURFACE = control_surface(HULL, np.inf, 4.0)


def _fields(omega: float) -> SurfaceFields:
    return surface_fields(BODY, solve(BODY, omega, HEADINGS, 1.0, 1.0), MOTION, HULL, SURFACE)


SLOW, FAST = _fields(0.9), _fields(1.1)


@pytest.mark.parametrize("form", ["pressure", "control"])
def test_exchange_of_the_waves_conjugates(form: str) -> None:
    there, back = quadratic_part(SLOW, FAST, form), quadratic_part(FAST, SLOW, form)
    np.testing.assert_allclose(there, np.swapaxes(back, 0, 1).conj(), atol=1e-12)
    assert np.max(np.abs(there.imag)) > 0.01


@pytest.mark.parametrize("form", ["pressure", "control"])
def test_diagonal_is_the_mean_drift(form: str) -> None:
    diagonal = quadratic_part(SLOW, SLOW, form)[[0, 1], [0, 1]]
    np.testing.assert_allclose(diagonal.imag, 0.0, atol=1e-12)
    solution = solve(BODY, 0.9, HEADINGS, 1.0, 1.0)
    # Another control surface, made for the one wave: the quadrature of the water plane differs.
    np.testing.assert_allclose(diagonal.real, near_field_drift(BODY, solution, MOTION, form), atol=2e-3)


def test_forms_agree_for_two_frequencies() -> None:
    pressure, control = (quadratic_part(SLOW, FAST, form) for form in ("pressure", "control"))
    # Pressure on 384 panels, which takes the square of velocities of 0.2 m panels: 2 % of the largest component.
    for axes in ([0, 1, 2], [3, 4, 5]):
        np.testing.assert_allclose(
            pressure[..., axes], control[..., axes], atol=0.03 * np.max(np.abs(control[..., axes]))
        )


def _cylinder_waves(number: float, angles: NDArray) -> tuple[NDArray, NDArray]:
    """φ and its derivative around a fixed deep cylinder of radius 1 at z = 0 (MacCamy and Fuchs), g = 1."""
    n = np.arange(25)[:, None]
    weight = np.where(n == 0, 1.0, 2.0) * (-1j) ** n * 1j / np.sqrt(number)
    ratio = special.jvp(n, number) / special.h2vp(n, number)
    radial = weight * (special.jv(n, number) - ratio * special.hankel2(n, number))
    return np.sum(radial * np.cos(n * angles), axis=0), np.sum(-radial * n * np.sin(n * angles), axis=0)


@pytest.mark.parametrize("form", ["pressure", "control"])
def test_deep_cylinder_against_closed_form(form: str) -> None:
    """Both integrals of products over a deep cylinder, with ∫ exp((k + k') z) dz = 1 / (k + k')."""
    first, second = 0.8, 1.25
    body = discretize(cylinder(1.0, 5.0, 8, 16, 4))
    hull = hull_surface(body)
    surface = control_surface(hull, np.inf, 2.0 * np.pi / second) if form == "control" else None
    waves = [
        surface_fields(body, solve(body, np.sqrt(k), [0.0], 1.0, 1.0), np.zeros((1, 6)), hull, surface)
        for k in (first, second)
    ]
    found = quadratic_part(waves[0], waves[1], form)[0, 0, 0]
    angles = 2.0 * np.pi * np.arange(96) / 96
    (one, one_slope), (two, two_slope) = (_cylinder_waves(k, angles) for k in (first, second))
    raised = -0.5 * np.sqrt(first * second) * one * two.conj()
    flow = 0.5 * (one_slope * two_slope.conj() + first * second * one * two.conj()) / (first + second)
    wanted = np.sum(0.5 * (raised + flow) * np.cos(angles)) * 2.0 * np.pi / 96
    # The bottom at 5 radii, exp(-4), and panels of 0.2 by 0.3 m.
    assert abs(found - wanted) < 0.03 * abs(wanted)


def test_newman_keeps_the_diagonal_and_its_bounds() -> None:
    drift = np.array([1.0, 4.0, -9.0, 0.0])
    arithmetic, geometric = newman(drift), newman(drift, "geometric")
    for matrix in (arithmetic, geometric):
        np.testing.assert_allclose(np.diag(matrix), drift)
        np.testing.assert_allclose(matrix, matrix.T)
    assert arithmetic[0, 1] == 2.5
    assert geometric[0, 1] == 2.0
    assert geometric[0, 2] == 0.0
    assert newman(np.array([-4.0, -9.0]), "geometric")[0, 1] == -6.0
    assert newman(np.ones((3, 2, 6))).shape == (3, 3, 2, 6)


def test_newman_is_good_for_close_frequencies() -> None:
    near = _fields(0.92)
    exact = quadratic_part(SLOW, near)[0, 0, 0]
    drift = np.array([quadratic_part(wave, wave)[0, 0, 0].real for wave in (SLOW, near)])
    # The modulus differs from the mean at the second order of the difference, of 2 %.
    assert abs(exact) == pytest.approx(newman(drift)[0, 1], rel=0.02)


def test_fields_that_do_not_fit_are_refused() -> None:
    other = discretize(hemisphere(1.0, 4, 3))
    stranger = surface_fields(other, solve(other, 0.9, HEADINGS, 1.0, 1.0), MOTION)
    with pytest.raises(ScenarioError, match="differ in hull"):
        quadratic_part(SLOW, stranger, "pressure")
    with pytest.raises(ScenarioError, match="no control surface"):
        quadratic_part(stranger, stranger)
    with pytest.raises(ScenarioError, match="form"):
        quadratic_part(SLOW, FAST, "far")
    with pytest.raises(ScenarioError, match="mean"):
        newman(np.ones(3), "harmonic")
