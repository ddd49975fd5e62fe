import numpy as np

from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import box, hemisphere
from tlpsim.loads.bem.surface import hull_surface


def test_gradient_is_exact_for_quadratic_potentials_on_flat_faces() -> None:
    hull = hull_surface(discretize(box(4.0, 4.0, 3.0, 0.3)))
    x, y, z = hull.centre.T
    potential = 0.3 * x - y + 2.0 * z + x * y - 0.5 * x * x + z * z + 0.7 * y * z
    slope = np.stack([0.3 + y - x, -1.0 + x + 0.7 * z, 2.0 + 2.0 * z + 0.7 * y], axis=-1)
    slope -= np.sum(slope * hull.normal, axis=1)[:, None] * hull.normal
    found = np.stack([matrix @ potential for matrix in hull.gradient.matrices], axis=-1)
    # Every face has three panels or more each way, which determine all quadratic polynomials; beside edges others fit.
    free = hull.gradient.square == 1.0
    assert np.count_nonzero(free) > 50
    np.testing.assert_allclose(found[free], slope[free], atol=1e-9)


def test_flow_around_a_sharp_edge() -> None:
    """Potential ±r^(2/3) on both sides of a right-angled edge: velocity 2/3 r^(-1/3), infinite at the edge."""
    half, draft = 2.0, 3.0
    hull = hull_surface(discretize(box(2.0 * half, 24.0, draft, 0.5)))
    x, y, z = hull.centre.T
    near = (x > 0.0) & (np.abs(y) < 10.0)
    wall, floor = near & (hull.normal[:, 0] > 0.9), near & (hull.normal[:, 2] < -0.9)
    reach = np.where(wall[:, None, None], hull.places[..., 2:] + draft, half - hull.places[..., :1])[..., 0]
    # Means of r^(2/3) over panels of a width that is √3 times the span of their Gauss points.
    spread = 0.5 * np.sqrt(3.0) * np.ptp(reach, axis=1) * [[-1.0], [1.0]] + np.mean(reach, axis=1)
    low, high = np.where(near, np.maximum(spread, 0.0), [[1.0], [2.0]])
    potential = np.where(wall, 0.6, -0.6) * (high ** (5.0 / 3.0) - low ** (5.0 / 3.0)) / (high - low)
    distance = np.where(wall, z + draft, half - x)
    close = (wall | floor) & (distance < 0.8) & (np.abs(y) < 6.0)
    assert np.count_nonzero(close & wall) > 20
    assert np.count_nonzero(close & floor) > 20
    slopes = np.stack([matrix @ potential for matrix in hull.gradient.matrices], axis=-1)
    across = np.einsum("pk,pk->p", slopes, hull.gradient.across)
    wanted = 2.0 / 3.0 * distance[close] ** (-1.0 / 3.0) * np.where(wall, 1.0, -1.0)[close]
    np.testing.assert_allclose(across[close], wanted, rtol=0.03)
    # The square over the panels at the edge, of width w: 4/9 · 3 w^(1/3) / w, where its value at the centre gives half.
    first = close & (distance < 1.01 * np.min(distance[close & floor])) & floor
    width = 2.0 * distance[first]
    square = across[first] ** 2 * hull.gradient.square[first]
    np.testing.assert_allclose(square, 4.0 / 3.0 * width ** (-2.0 / 3.0), rtol=0.05)


def test_gradient_converges_on_a_curved_hull() -> None:
    errors = []
    for polar, around in ((8, 5), (16, 10)):
        hull = hull_surface(discretize(hemisphere(1.0, polar, around)))
        x, z = hull.centre[:, 0], hull.centre[:, 2]
        potential = np.exp(z) * np.cos(x)
        slope = np.stack([-np.exp(z) * np.sin(x), 0.0 * x, potential], axis=-1)
        slope -= np.sum(slope * hull.normal, axis=1)[:, None] * hull.normal
        found = np.stack([matrix @ potential for matrix in hull.gradient.matrices], axis=-1)
        errors.append(float(np.sqrt(np.mean((found - slope) ** 2))))
    # Second order in the panels' size: a quarter, or nearly.
    assert errors[1] < 0.35 * errors[0] < 0.02
