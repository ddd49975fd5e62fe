import numpy as np
import pytest

from tlpsim.loads.bem.hulls import hemisphere
from tlpsim.loads.bem.mesh import Mesh, panels, whole
from tlpsim.loads.bem.rankine import FAR, influence, panel_integrals, second_moments

QUAD = np.array([[0.0, 0.0, 0.0], [1.3, 0.1, 0.0], [1.1, 0.9, 0.0], [-0.2, 0.7, 0.0]])
TURN = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-0.3, 1.0, 2.0], [0.7, -1.0, 1.0]]))[0]
TURN *= np.sign(np.linalg.det(TURN))


def quadrature(point: np.ndarray, corners: np.ndarray, normal: np.ndarray, order: int) -> tuple[float, float]:
    """Gauss product rule on the bilinear map of the quadrilateral."""
    x, w = np.polynomial.legendre.leggauss(order)
    u, v = np.meshgrid(0.5 + 0.5 * x, 0.5 + 0.5 * x)
    weights = 0.25 * np.outer(w, w)
    a, b, c, d = corners
    place = (
        ((1 - u) * (1 - v))[..., None] * a
        + (u * (1 - v))[..., None] * b
        + (u * v)[..., None] * c
        + ((1 - u) * v)[..., None] * d
    )
    along_u = (1 - v)[..., None] * (b - a) + v[..., None] * (c - d)
    along_v = (1 - u)[..., None] * (d - a) + u[..., None] * (c - b)
    jacobian = np.linalg.norm(np.cross(along_u, along_v), axis=-1)
    away = point - place
    r = np.linalg.norm(away, axis=-1)
    return float(np.sum(weights * jacobian / r)), float(np.sum(weights * jacobian * (away @ normal) / r**3))


@pytest.mark.parametrize(
    "point", [(0.4, 0.3, 0.5), (2.0, -1.0, -0.7), (-0.9, 0.2, 0.6), (5.0, 4.0, 3.0), (9.0, 8.0, 7.0)]
)
def test_panel_integrals_equal_quadrature(point: tuple[float, float, float]) -> None:
    corners = QUAD @ TURN.T
    geometry = panels(Mesh(name="one", vertices=corners[None]))
    place = TURN @ np.array(point)
    moments = second_moments(geometry.corners, geometry.centre)
    found = panel_integrals(
        *place,
        geometry.corners[0],
        geometry.normal[0],
        geometry.centre[0],
        geometry.area[0],
        geometry.size[0],
        moments[0],
    )
    expected = quadrature(place, corners, geometry.normal[0], 60)
    # The last two points lie on either side of FAR diagonals; the multipole leaves out third moments, (1/FAR)³ times
    # a coefficient of about 1e-2.
    far = np.linalg.norm(place - geometry.centre[0]) > FAR * geometry.size[0]
    np.testing.assert_allclose(found, expected, rtol=2e-5 if far else 1e-9)


def test_closed_surface_is_seen_under_its_full_angle() -> None:
    """A half sphere and its image close: Ω sums to -4π inside and 0 outside."""
    half = whole(hemisphere(1.0, 6, 5))
    geometry = panels(half)
    moments = second_moments(geometry.corners, geometry.centre)
    points = np.array([[0.1, 0.2, -0.3], [0.0, 0.5, 0.4], [2.0, 0.0, -0.1]])
    arrays = (geometry.corners, geometry.normal, geometry.centre, geometry.area, geometry.size, moments)
    total = sum(
        influence(points, points[:, None], np.ones((3, 1)), 1.0, 1.0, sign, 0.0, *arrays)[1].sum(axis=1)
        for sign in (1.0, -1.0)
    )
    # Quadrilaterals of the latitude-longitude grid are plane, so that flattening opens no gap.
    np.testing.assert_allclose(total, [-4 * np.pi, -4 * np.pi, 0.0], atol=1e-6)


def test_a_disc_attracts_its_centre_by_2_pi_radius() -> None:
    """∫ 1/r over a regular polygon from its centre = Σ apothem · 2 asinh(tan(π/n)) · ... -> 2 π R for many sides."""
    sides = 400
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    zero = np.zeros((sides, 3))
    vertices = np.stack([zero, ring[:-1], ring[1:], ring[1:]], axis=1)
    g = panels(Mesh(name="disc", vertices=vertices))
    moments = second_moments(g.corners, g.centre)
    single, double = influence(
        np.zeros((1, 3)),
        np.zeros((1, 1, 3)),
        np.ones((1, 1)),
        1.0,
        1.0,
        1.0,
        0.0,
        g.corners,
        g.normal,
        g.centre,
        g.area,
        g.size,
        moments,
    )
    assert single.sum() == pytest.approx(2 * np.pi, rel=1e-4)
    assert double.sum() == 0.0
