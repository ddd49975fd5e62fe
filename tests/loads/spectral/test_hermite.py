"""Hermite expansion of drag against closed forms, quadrature about the kink, its own identities and Monte Carlo."""

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray
from scipy import special
from scipy.spatial.transform import Rotation

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.hermite import Expansion, expand, expand_scalar, splash

FloatArray = NDArray[np.float64]

UNIT = np.polynomial.legendre.leggauss(16)
SPREADS = 10.0  # from the mean, beyond which the density is left out


def coefficients(expansion: Expansion, element: int = 0) -> list[FloatArray]:
    fields = (expansion.mean, expansion.linear, expansion.quadratic, expansion.cubic)
    return [field[element] for field in fields]


def one(mean: FloatArray, covariance: FloatArray) -> list[FloatArray]:
    return coefficients(expand(mean[None], covariance[None]))


def deviations(ours: list[FloatArray], theirs: list[FloatArray], mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Greatest deviation of each degree, relative to the greatest coefficient or to the scale of the velocity."""
    scale = np.sqrt(np.sum(mean**2) + np.max(variance))
    return np.array(
        [
            np.abs(a - b).max() / max(np.abs(b).max(), scale ** (2 - degree))
            for degree, (a, b) in enumerate(zip(ours, theirs, strict=True))
        ]
    )


def symmetric(vector: FloatArray, deltas: int, vectors: int) -> FloatArray:
    """Sum of all different products of Kronecker deltas and vectors: (1, 1) is d_ij u_k + d_ik u_j + d_jk u_i."""
    rank = 2 * deltas + vectors
    whole = np.ones(())
    for _ in range(deltas):
        whole = np.multiply.outer(whole, np.eye(len(vector)))
    for _ in range(vectors):
        whole = np.multiply.outer(whole, vector)
    alike = 2**deltas * special.factorial(deltas) * special.factorial(vectors)
    return np.asarray(sum(whole.transpose(order) for order in permutations(range(rank))) / alike)


def isotropic(mean: FloatArray, variance: float) -> list[FloatArray]:
    """Coefficients from E|V|^3 = (2 s^2)^(3/2) Gamma((d+3)/2) / Gamma(d/2) M(-3/2, d/2, -|U|^2/(2 s^2))."""
    d = len(mean)
    p = []  # derivatives of E|V|^3 / 3 to |U|^2
    for k in range(5):
        ratio = special.poch(-1.5, k) / special.poch(d / 2, k) * (-0.5 / variance) ** k
        p.append(ratio * special.hyp1f1(k - 1.5, k + d / 2, -np.sum(mean**2) / (2 * variance)))
    p = np.array(p) * (2 * variance) ** 1.5 * special.gamma((d + 3) / 2) / special.gamma(d / 2) / 3
    second = 2 * p[1] * symmetric(mean, 1, 0) + 4 * p[2] * symmetric(mean, 0, 2)
    third = 4 * p[2] * symmetric(mean, 1, 1) + 8 * p[3] * symmetric(mean, 0, 3)
    fourth = 4 * p[2] * symmetric(mean, 2, 0) + 8 * p[3] * symmetric(mean, 1, 2) + 16 * p[4] * symmetric(mean, 0, 4)
    return [2 * p[1] * mean, second, third / 2, fourth / 6]


def panels(lowest: float, highest: float, centres: list[float], least: float) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on panels that halve toward each centre down to a width."""
    edges = {lowest, highest}
    for centre in centres:
        width = highest - lowest
        while width > least:
            edges |= {edge for edge in (centre - width, centre + width) if lowest < edge < highest}
            width *= 0.5
        if lowest < centre < highest:
            edges.add(centre)
    ends = sorted(edges)
    parts = [(0.5 * (b - a), 0.5 * (a + b)) for a, b in pairwise(ends)]
    return (
        np.concatenate([middle + half * UNIT[0] for half, middle in parts]),
        np.concatenate([half * UNIT[1] for half, _ in parts]),
    )


def circle(toward: float, least: float) -> tuple[FloatArray, FloatArray]:
    """Angles of a whole turn and weights, dense about a direction and about the second axis."""
    second = [angle for angle in np.pi * np.arange(-3.5, 4.0) if abs(angle - toward) < 1.5 * np.pi]
    return panels(toward - np.pi, toward + np.pi, [toward, *second], least)


def directions(peak: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (n, q) and weights, dense where the length of spread * vector is short, and toward the peak."""
    if len(peak) == 1:
        return np.array([[1.0], [-1.0]]), np.ones(2)
    far = max(np.linalg.norm(peak), 1.0)
    least = min(spread[-1] / spread[0], 1 / far) / 4
    if len(peak) == 2:
        angle, weight = circle(float(np.arctan2(peak[1], peak[0])), least)
        return np.column_stack([np.cos(angle), np.sin(angle)]), weight
    toward = float(np.arctan2(np.hypot(peak[1], peak[2]), peak[0]))
    polar, polar_weight = panels(0.0, np.pi, [np.pi / 2, toward], least)
    around, weight = circle(float(np.arctan2(peak[2], peak[1])), least)
    polar, around = (each.ravel() for each in np.meshgrid(polar, around, indexing="ij"))
    vectors = np.column_stack([np.cos(polar), np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)])
    return vectors, np.outer(polar_weight, weight).ravel() * np.sin(polar)


def about_the_kink(mean: FloatArray, variance: FloatArray) -> list[FloatArray]:
    """Coefficients by quadrature in polar coordinates about V = 0, of variances in principal axes, greatest first.

    C1 = E[|V| (I + e e)] and so on with e = V / |V|. A variance of zero leaves its direction out. The cubic
    coefficients of one fluctuating direction through V = 0 lack the delta function.
    """
    moves = variance > 0.0
    spread = np.sqrt(variance[moves])
    peak, q = mean[moves] / spread, int(moves.sum())
    unit, unit_weight = directions(peak, spread)
    offset = float(np.linalg.norm(mean[~moves]))
    along = unit @ peak
    off_axis = np.maximum(np.sum((peak - along[:, None] * unit) ** 2, axis=1), 0.0)
    keep = (along > -SPREADS) & (off_axis < SPREADS**2)
    unit, unit_weight, along, off_axis = unit[keep], unit_weight[keep], along[keep], off_axis[keep]
    start, stop = np.maximum(along - SPREADS, 0.0), along + SPREADS
    least = min(offset / spread[0], 1.0) / (4 * SPREADS) if offset > 0 else 0.2
    node, node_weight = panels(0.0, 1.0, [0.0, 0.5], least)
    radius = start[:, None] + (stop - start)[:, None] * node
    density = np.exp(-0.5 * ((radius - along[:, None]) ** 2 + off_axis[:, None])) / (2 * np.pi) ** (q / 2)
    weight = (stop - start)[:, None] * node_weight * density * radius ** (q - 1) * unit_weight[:, None]
    velocity = np.zeros((*radius.shape, len(mean))) if offset > 0 else np.zeros((len(unit), 1, len(mean)))
    velocity[..., moves] = unit[:, None, :] * spread * (radius[..., None] if offset > 0 else 1.0)
    velocity[..., ~moves] = mean[~moves]
    length = np.linalg.norm(velocity, axis=2)
    e = (velocity / length[..., None]).reshape(-1, len(mean))

    def moment(power: int, rank: int) -> FloatArray:
        factor = (
            weight * length**power
            if offset > 0
            else (weight * radius**power).sum(axis=1, keepdims=True) * length**power
        )
        total = factor.ravel()
        letters = "ijkl"[:rank]
        operands = ",".join(f"n{letter}" for letter in letters)
        return np.einsum(f"n{',' * bool(rank)}{operands}->{letters}", total, *[e] * rank)

    eye = np.eye(len(mean))
    second, fourth = moment(-1, 2), moment(-1, 4)
    pairs = np.einsum("ij,kl->ijkl", eye, eye)
    mixed = np.einsum("ij,kl->ijkl", eye, second)
    cubic = 3 * fourth + moment(-1, 0) * (pairs + pairs.transpose(0, 2, 1, 3) + pairs.transpose(0, 3, 2, 1))
    for order in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 2, 3, 1), (2, 0, 1, 3), (2, 0, 3, 1), (2, 3, 0, 1)):
        cubic = cubic - mixed.transpose(order)
    first = np.einsum("ij,k->ijk", eye, moment(0, 1))
    quadratic = first + first.transpose(0, 2, 1) + first.transpose(2, 1, 0) - moment(0, 3)
    return [moment(2, 1), moment(1, 0) * eye + moment(1, 2), quadratic / 2, cubic / 6]


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("speed", [0.0, 1e-3, 0.4, 1.0, 3.0, 8.0])
def test_isotropic_coefficients_are_those_of_the_confluent_hypergeometric_function(
    dimension: int, speed: float
) -> None:
    mean = speed * np.array([0.6, -0.8, 0.5])[:dimension]
    for variance in (0.25, 1.0, 4.0):
        errors = deviations(one(mean, variance * np.eye(dimension)), isotropic(mean, variance), mean, variance)
        assert errors.max() < 1e-11


@pytest.mark.parametrize("ratio", [0.0, 0.1, 1.0, 5.0, 30.0])
def test_mean_speed_is_that_of_rice(ratio: float) -> None:
    # The trace of C1 is (d + 1) E|V|.
    q = ratio**2 / 4
    rice = 1.7 * np.sqrt(np.pi / 2) * ((1 + 2 * q) * special.i0e(q) + 2 * q * special.i1e(q))
    _, linear, _, _ = one(1.7 * np.array([0.0, ratio]), 1.7**2 * np.eye(2))
    assert np.trace(linear) / 3 == pytest.approx(rice, rel=1e-12)


@pytest.mark.parametrize(
    "variance", [[1, 1, 1], [1, 0.5, 0.2], [1, 1e-4, 1e-8], [4, 1e-12, 0], [4, 0, 0], [1, 1, 0], [1, 0.3], [1, 1e-9]]
)
def test_mean_speed_without_current_is_carlsons_integral(variance: list[float]) -> None:
    # E|V| = sqrt(8 / pi) R_G(variances), the mean of |L e| over the sphere
    carlson = np.sqrt(8 / np.pi) * special.elliprg(*[*variance, 0.0][:3])
    mean, linear, quadratic, _ = one(np.zeros(len(variance)), np.diag(variance))
    assert np.trace(linear) / (len(variance) + 1) == pytest.approx(carlson, rel=1e-12)
    assert not mean.any()
    assert not quadratic.any()


@pytest.mark.parametrize("speed", [0.0, 1e-6, -0.5, 2.0, 40.0, -1e3])
@pytest.mark.parametrize("spread", [0.0, 1e-3, 1.0])
def test_one_dimension_is_the_closed_form(speed: float, spread: float) -> None:
    closed = expand_scalar(speed, spread)
    expected = [np.reshape(field, [1] * rank) for rank, field in enumerate((closed.mean, closed.linear), 1)]
    expected += [np.reshape(closed.quadratic, [1] * 3), np.reshape(closed.cubic, [1] * 4)]
    ours = one(np.array([speed]), np.array([[spread**2]]))
    assert deviations(ours, expected, np.array([speed]), np.array([spread**2 + 1e-300])).max() < 1e-11


@pytest.mark.parametrize(
    ("ratio", "shares"), [(0.0, [0.849, 0.0, 0.142]), (0.5, [0.829, 0.076, 0.085]), (2.0, [0.898, 0.101, 0.0004])]
)
def test_shares_of_the_variance(ratio: float, shares: list[float]) -> None:
    # Orthogonality: terms leave c1^2 s^2 + 2 c2^2 s^4 + 6 c3^2 s^6 of E V^4 - c0^2; for U = 0, c1 s is sqrt(8 / pi).
    spread = 1.3
    each = expand_scalar(ratio * spread, spread)
    total = spread**4 * (ratio**4 + 6 * ratio**2 + 3) - each.mean**2
    parts = np.array([each.linear**2, 2 * each.quadratic**2 * spread**2, 6 * each.cubic**2 * spread**4]) * spread**2
    assert parts / total == pytest.approx(np.array(shares), abs=6e-4)


STATES: dict[str, tuple[list[float], list[float]]] = {  # mean, variances in principal axes, greatest first
    "mild": ([0.7, -0.4], [1.0, 0.5]),
    "anisotropic": ([0.3, 0.02], [1.0, 1e-4]),
    "nearly singular": ([0.8, 2e-6], [1.0, 1e-12]),
    "nearly singular, no mean": ([0.0, 0.0], [1.0, 1e-12]),
    "nearly singular, cross current": ([0.2, 0.05], [1.0, 1e-12]),
    "long-crested, cross current": ([0.5, 0.3], [1.0, 0.0]),
    "long-crested, little cross current": ([-0.5, 1e-4], [4.0, 0.0]),
    "long-crested, hardly any cross current": ([-0.5, 1e-9], [4.0, 0.0]),
    "fast current": ([800.0, 600.0], [1.0, 0.3]),
    "fast current across, nearly singular": ([0.5, 9.0], [100.0, 1e-2]),
    "10 spreads away": ([10.0, 0.0], [1.0, 1.0]),
    "three dimensions": ([0.5, -0.3, 0.2], [1.0, 0.6, 0.3]),
    "three dimensions, anisotropic": ([0.2, 0.1, -0.02], [1.0, 0.2, 0.05]),
    "plane off the kink": ([0.4, 0.3, 0.2], [1.0, 0.2, 0.0]),
    "plane near the kink": ([0.4, 0.3, 1e-3], [1.0, 0.2, 0.0]),
    "plane through the kink": ([0.4, 0.3, 0.0], [1.0, 0.2, 0.0]),
    "line off the kink": ([0.4, 0.1, 0.2], [1.0, 0.0, 0.0]),
}


@pytest.mark.parametrize("state", STATES)
def test_coefficients_are_those_of_quadrature_about_the_kink(state: str) -> None:
    mean, variance = (np.array(each) for each in STATES[state])
    errors = deviations(one(mean, np.diag(variance)), about_the_kink(mean, variance), mean, variance)
    assert errors.max() < 1e-10


def test_elements_do_not_depend_on_each_other() -> None:
    pairs = [(mean, variance) for mean, variance in STATES.values() if len(mean) == 2]
    means, variances = (np.array(each) for each in zip(*pairs, strict=True))
    together = expand(means, np.array([np.diag(each) for each in variances]))
    for i, (mean, variance) in enumerate(zip(means, variances, strict=True)):
        alone = one(mean, np.diag(variance))
        assert deviations(coefficients(together, i), alone, mean, variance).max() < 1e-12


def test_long_crested_waves_without_cross_current_are_the_univariate_case() -> None:
    closed = expand_scalar(0.6, 0.9)
    mean, linear, quadratic, cubic = one(np.array([0.6, 0.0]), np.diag([0.81, 0.0]))
    assert mean == pytest.approx(np.array([closed.mean, 0.0]), rel=1e-12)
    assert linear == pytest.approx(np.diag([closed.linear, 0.5 * closed.linear]), rel=1e-12)  # E|V| is half of it
    assert quadratic[0, 0, 0] == pytest.approx(closed.quadratic, rel=1e-12)
    assert quadratic[1, 0, 1] == pytest.approx(0.5 * closed.quadratic, rel=1e-12)
    assert cubic[0, 0, 0, 0] == pytest.approx(closed.cubic, rel=1e-10)
    assert cubic[1, 0, 0, 1] == pytest.approx(closed.cubic / 2, rel=1e-10)  # |V|'' / 6 = 2 delta / 6
    assert np.all(np.isfinite(cubic))


@pytest.mark.parametrize("speed", [[3.0, -4.0], [0.0, 2.0], [0.0, 0.0]])
def test_current_alone_leaves_the_derivatives_of_drag(speed: list[float]) -> None:
    mean = np.array(speed)
    ours = one(mean, np.zeros((2, 2)))
    length = np.linalg.norm(mean)
    if length == 0.0:
        assert not any(each.any() for each in ours)
        return
    e = mean / length
    third = symmetric(e, 1, 1) - symmetric(e, 0, 3)
    fourth = symmetric(e, 2, 0) - symmetric(e, 1, 2) + 3 * symmetric(e, 0, 4)
    expected = [length * mean, length * (np.eye(2) + np.outer(e, e)), third / 2, fourth / 6 / length]
    assert deviations(ours, expected, mean, np.zeros(2)).max() < 1e-12


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_each_coefficient_is_the_derivative_of_the_one_before(dimension: int) -> None:
    # c0' = C1, C1' = 2 C2, C2' = 3 C3; the error of the difference is h^8 / 630 times a ninth derivative.
    mean = np.array([0.5, -0.3, 0.8])[:dimension]
    covariance = np.array([[1.0, 0.4, 0.1], [0.4, 0.6, -0.2], [0.1, -0.2, 0.8]])[:dimension, :dimension]
    h = 0.05
    here = one(mean, covariance)
    for i in range(dimension):
        steps = mean + h * np.arange(-4, 5)[:, None] * np.eye(dimension)[i]
        around = expand(steps, np.tile(covariance, (9, 1, 1)))
        formula = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / h
        for degree, field in enumerate((around.mean, around.linear, around.quadratic)):
            slope = np.einsum("s,s...->...", formula, field)
            assert slope / (degree + 1) == pytest.approx(here[degree + 1][..., i], abs=2e-10)


vectors = hnp.arrays(np.float64, 3, elements=st.floats(-3.0, 3.0))


@given(mean=vectors, factor=hnp.arrays(np.float64, (3, 3), elements=st.floats(-2.0, 2.0)), turn=vectors)
@settings(max_examples=60, deadline=None)
def test_a_turn_of_the_axes_turns_the_tensors(mean: FloatArray, factor: FloatArray, turn: FloatArray) -> None:
    turned = Rotation.from_rotvec(turn).as_matrix()
    covariance = factor @ factor.T + 1e-3 * np.eye(3)
    expected = []
    for each in one(mean, covariance):
        for _ in range(each.ndim):
            each = np.tensordot(each, turned, axes=(0, 1))
        expected.append(each)
    ours = one(turned @ mean, turned @ covariance @ turned.T)
    assert deviations(ours, expected, mean, np.array(np.trace(covariance) / 3)).max() < 1e-10


@given(mean=vectors, spread=vectors, factor=st.floats(1e-6, 1e6))
@settings(max_examples=60, deadline=None)
def test_a_change_of_unit_scales_the_coefficients(mean: FloatArray, spread: FloatArray, factor: float) -> None:
    mean, spread = mean + 0.1, np.abs(spread) + 1e-3  # clear of zero, where the cubic coefficient has no bound
    expected = [each * factor ** (2 - degree) for degree, each in enumerate(one(mean, np.diag(spread**2)))]
    ours = one(factor * mean, factor**2 * np.diag(spread**2))
    assert deviations(ours, expected, factor * mean, (factor * spread) ** 2).max() < 1e-11


MEAN = np.array([0.4, -0.2])
JOINT = np.array([[1.0, 0.3, 0.5], [0.3, 0.5, -0.2], [0.5, -0.2, 0.7]])  # covariance of two velocities and elevation


def sampled_products(count: int, seed: int) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Expected product, sampled product and standard error, by Monte Carlo."""
    white = np.random.default_rng(seed).standard_normal((count, 3))
    return products_with_polynomials(MEAN, white, np.full(count, 1 / count))


def products_with_polynomials(
    mean: FloatArray, white: FloatArray, weight: FloatArray
) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Expectation of drag, and of splash, times polynomials of the process: by the expansion, and by points.

    Points are of independent standard normal variables, shape (n, 3), with weights of sum one. The third entry is the
    standard error where they are drawn at random.
    """
    count = len(white)
    covariance, cross, variance = JOINT[:2, :2], JOINT[:2, 2], JOINT[2, 2]
    expansion = expand(mean[None], covariance[None])
    c0, c1, c2, c3 = coefficients(expansion)
    zone = splash(expansion, cross[None])
    process = white @ np.linalg.cholesky(JOINT).T
    v, elevation = process[:, :2], process[:, 2]
    force = np.linalg.norm(mean + v, axis=1)[:, None] * (mean + v)
    both = np.einsum("jm,kn->jkmn", covariance, covariance)
    both = both + both.transpose(0, 1, 3, 2)  # E[(v_j v_k - S_jk) (v_m v_n - S_mn)]
    pairs = np.einsum("nj,nk->njk", v, v) - covariance
    # He3 along one direction a, which takes a spread of one: its product with the force is 6 C3 (S a)^3.
    a = np.array([0.6, 0.5])
    a /= np.sqrt(a @ covariance @ a)
    along = v @ a
    mixed = np.einsum("m,jn->jmn", cross, covariance)
    mixed = mixed + mixed.transpose(0, 2, 1)  # E[(e v_j - r_j) (v_m v_n - S_mn)]
    own = variance * covariance + np.outer(cross, cross)  # E[(e v_j - r_j) (e v_m - r_m)]
    other = np.einsum("j,km->jkm", cross, covariance)  # half of E[(v_j v_k - S_jk) (e v_m - r_m)], symmetrised in j, k
    wet = elevation[:, None] * force
    products = elevation[:, None] * v - cross
    cases = [
        (force, np.ones((count, 1)), c0[:, None]),
        (force, v, c1 @ covariance),
        (force, pairs.reshape(count, 4), np.einsum("ijk,jkmn->imn", c2, both).reshape(2, 4)),
        (force, (along**3 - 3 * along)[:, None], 6 * np.einsum("ijkl,j,k,l->i", c3, *[covariance @ a] * 3)[:, None]),
        (wet, np.ones((count, 1)), zone.mean[0][:, None]),
        (wet, elevation[:, None], (zone.elevation[0] * variance + zone.velocity[0] @ cross)[:, None]),
        (wet, v, np.outer(zone.elevation[0], cross) + zone.velocity[0] @ covariance),
        (
            wet,
            pairs.reshape(count, 4),
            (
                np.einsum("ij,jmn->imn", zone.product[0], mixed) + np.einsum("ijk,jkmn->imn", zone.quadratic[0], both)
            ).reshape(2, 4),
        ),
        (wet, products, zone.product[0] @ own + 2 * np.einsum("ijk,jkm->im", zone.quadratic[0], other)),
    ]
    results = []
    for values, polynomial, expected in cases:
        sampled = values.T @ (weight[:, None] * polynomial)
        square = (values**2).T @ (weight[:, None] * polynomial**2)
        results.append((expected, sampled, np.sqrt((square - sampled**2) / count)))
    return results


def test_products_with_polynomials_are_those_of_monte_carlo() -> None:
    for expected, sampled, error in sampled_products(1_000_000, 20):
        assert np.all(np.abs(sampled - expected) < 4 * error)
        assert np.all(error < 0.03)


def test_products_with_polynomials_are_those_of_quadrature_far_from_the_kink() -> None:
    # Where the mean is twelve spreads away the kink does not count, and Gauss-Hermite quadrature converges.
    node, weight = np.polynomial.hermite_e.hermegauss(24)
    white = np.stack(np.meshgrid(node, node, node, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() / (2 * np.pi) ** 1.5
    for expected, integrated, _ in products_with_polynomials(np.array([9.0, -6.0]), white, weight):
        assert integrated == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_elevation_alone_multiplies_the_mean_drag() -> None:
    expansion = expand([[0.5, 0.1]], [np.diag([1.0, 0.2])])
    dry = splash(expansion, [[0.0, 0.0]])
    assert dry.elevation == pytest.approx(expansion.mean)
    assert not any(each.any() for each in (dry.mean, dry.velocity, dry.quadratic))


def test_no_elements_make_an_empty_expansion() -> None:
    assert expand(np.zeros((0, 2)), np.zeros((0, 2, 2))).cubic.shape == (0, 2, 2, 2, 2)


def test_rounding_of_a_singular_covariance_is_no_error() -> None:
    mean = np.array([0.3, 0.4])
    singular = np.array([[1.0, 0.5], [0.5, 0.25]])
    for rounding in (-1e-13, 1e-13):
        ours = one(mean, singular + rounding * np.diag([1.0, -1.0]))
        assert deviations(ours, one(mean, singular), mean, np.array(1.25)).max() < 1e-10


@pytest.mark.parametrize(
    ("mean", "covariance", "words"),
    [
        ([[0.0, 0.0]], [[[1.0, 0.0], [0.0, -1e-6]]], "element 0 has the eigenvalue -1e-06"),
        ([[0.0, 0.0]] * 2, [np.eye(2), [[1.0, 0.2], [0.1, 1.0]]], "element 1 .* unsymmetric by 0.1"),
        ([[0.0, np.nan]], [np.eye(2)], "element 0 .* finite"),
        ([[0.0, 0.0]], [[[np.inf, 0.0], [0.0, 1.0]]], "element 0 .* finite"),
        ([0.0, 0.0], np.eye(2), r"shape \(2,\)"),
        ([[0.0] * 4], [np.eye(4)], "d = 1, 2 or 3"),
        ([[0.0, 0.0]], [np.eye(3)], r"\(1, 3, 3\)"),
    ],
)
def test_bad_input_is_refused(mean: object, covariance: object, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        expand(np.array(mean), np.array(covariance))


def test_bad_input_of_the_closed_form_and_of_splash_is_refused() -> None:
    with pytest.raises(ScenarioError, match="standard deviation -1"):
        expand_scalar(0.0, -1.0)
    with pytest.raises(ScenarioError, match="finite"):
        expand_scalar(np.inf, 1.0)
    expansion = expand([[0.5, 0.1]], [np.eye(2)])
    for cross in ([0.1, 0.2], [[0.1, np.nan]]):
        with pytest.raises(ScenarioError, match="velocity and elevation"):
            splash(expansion, cross)
