import numpy as np
import pytest

from tlpsim.loads.bem.hulls import hemisphere
from tlpsim.loads.bem.influence import quadrature as quadrature_points
from tlpsim.loads.bem.mesh import Mesh, Panels, panels, whole
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


def arrays(geometry: Panels) -> tuple[np.ndarray, ...]:
    moments = second_moments(geometry.corners, geometry.centre)
    return (geometry.corners, geometry.normal, geometry.centre, geometry.area, geometry.size, moments)


def collocation(geometry: Panels) -> tuple[np.ndarray, ...]:
    count = len(geometry.area)
    return (np.arange(count), geometry.centre[:, None], np.ones((count, 1)), np.zeros((count, 6)))


def test_closed_surface_is_seen_under_its_full_angle() -> None:
    """A half sphere and its image close: Ω sums to -4π inside, 0 outside and -2π on a flat panel of it."""
    geometry = panels(whole(hemisphere(1.0, 6, 5)))
    points = np.array([[0.1, 0.2, -0.3], [0.0, 0.5, 0.4], [2.0, 0.0, -0.1]])
    data = arrays(geometry)
    total = np.zeros(len(points))
    for row, (x, y, z) in enumerate(points):
        for sign in (1.0, -1.0):
            total[row] += sum(
                panel_integrals(x, y, sign * z, *(array[j] for array in data))[1] for j in range(len(geometry.area))
            )
    # Quadrilaterals of the latitude-longitude grid are plane, so that flattening opens no gap.
    np.testing.assert_allclose(total, [-4 * np.pi, -4 * np.pi, 0.0], atol=1e-6)
    own = sum(influence(*collocation(geometry), 1.0, 1.0, sign, 0.0, *data)[1].sum(axis=1) for sign in (1.0, -1.0))
    # Multipoles of panels that are four diagonals apart leave out fourth moments, some 1e-5 of each.
    np.testing.assert_allclose(own, -2 * np.pi, atol=1e-4)


def test_a_disc_attracts_its_centre_by_2_pi_radius() -> None:
    """∫ 1/r over a disc, from its centre; a regular polygon of many sides for it."""
    sides = 400
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    vertices = np.stack([np.zeros((sides, 3)), ring[:-1], ring[1:], ring[1:]], axis=1)
    data = arrays(panels(Mesh(name="disc", vertices=vertices)))
    single, double = np.sum(
        [panel_integrals(0.0, 0.0, 0.0, *(array[j] for array in data)) for j in range(sides)], axis=0
    )
    assert single == pytest.approx(2 * np.pi, rel=1e-4)
    assert double == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_means_over_both_panels(sign: float) -> None:
    """Galerkin's matrix against the closed form seen from 6 x 6 points of every field panel."""
    geometry = panels(hemisphere(1.0, 6, 5))
    rule, fine = quadrature_points(geometry, 2), quadrature_points(geometry, 6)
    data = arrays(geometry)
    spread = data[-1] / geometry.area[:, None]
    shares = rule.weights / geometry.area[:, None]
    found = influence(np.arange(len(shares)), rule.places, shares, spread, -1.0, 1.0, sign, 0.0, *data)
    # The field panels mirrored in x, so that all pairs are apart or touch along the plane of symmetry only.
    exact = np.zeros((2, len(geometry.area), len(geometry.area)))
    for i, j in np.ndindex(exact.shape[1:]):
        for place, weight in zip(fine.places[i], fine.weights[i] / geometry.area[i], strict=True):
            value = panel_integrals(-place[0], place[1], sign * place[2], *(array[j] for array in data))
            exact[:, i, j] += weight * np.array(value)
    scale = geometry.area[None, :] / np.linalg.norm(
        geometry.centre[:, None] * np.array([-1.0, 1.0, sign]) - geometry.centre[None], axis=2
    )
    error = np.abs(found - exact) / scale
    # Neighbours by 2 x 2 points: a logarithm's derivative, 3 %; the moments leave out the fourth power, 1e-4.
    assert np.median(error[0]) < 1e-4
    assert error[0].max() < 4e-2


def test_the_mean_single_layer_is_symmetric() -> None:
    """∫∫ 1/r over two panels does not care which is the source."""
    geometry = panels(hemisphere(1.0, 6, 5))
    rule = quadrature_points(geometry, 2)
    data = arrays(geometry)
    places = (
        np.arange(len(data[3])),
        rule.places,
        rule.weights / geometry.area[:, None],
        data[-1] / geometry.area[:, None],
    )
    single, _ = influence(*places, 1.0, 1.0, 1.0, 0.0, *data)
    total = single * geometry.area[:, None]
    # Exact by moments; 2 x 2 points of one panel against the closed form of the other for the near ones.
    np.testing.assert_allclose(total, total.T, rtol=3e-2)
