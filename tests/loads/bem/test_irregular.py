"""Irregular frequencies: the bound against closed forms, and against the equations that fail there."""

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import Proportions, box, cylinder, hemisphere, lid, patch, wall
from tlpsim.loads.bem.irregular import FIRST_ZERO, irregular_warning, lowest_irregular_frequency
from tlpsim.loads.bem.mesh import Mesh, merged, translated, whole
from tlpsim.loads.bem.semisubmersible import SemisubmersibleHull, semisubmersible
from tlpsim.loads.bem.solver import solve, wave_matrices
from tlpsim.loads.errors import ScenarioError

EVEN = Proportions(column_row=1.0, pontoon_girth=1.0, pontoon_length=1.5)
SEMI = SemisubmersibleHull(
    pontoon_length=6.0,
    pontoon_width=2.4,
    pontoon_height=0.8,
    pontoon_spacing=4.0,
    column_radius=1.0,
    column_positions=(1.5,),
    draft=1.4,
)


def bound(mesh: Mesh) -> float:
    """Bound of K for unit gravity."""
    return lowest_irregular_frequency(mesh, 1.0) ** 2


def upright(k: float, draft: float) -> float:
    return k / np.tanh(k * draft)


@pytest.mark.parametrize(("radius", "draft"), [(1.0, 0.5), (2.0, 5.0)])
def test_cylinder_reaches_the_bound(radius: float, draft: float) -> None:
    # The mesh has the area and the draught of the cylinder: exact to rounding.
    mesh = cylinder(radius, draft, 6, 4, 3)
    assert bound(mesh) == pytest.approx(upright(FIRST_ZERO / radius, draft), rel=1e-9)
    assert bound(whole(mesh)) == pytest.approx(bound(mesh), rel=1e-9)
    assert lowest_irregular_frequency(mesh, 9.8) == pytest.approx(np.sqrt(9.8 * bound(mesh)), rel=1e-12)


@pytest.mark.parametrize(("length", "beam", "least"), [(2.0, 2.0, 0.95), (2.0, 1.6, 0.94), (4.0, 2.0, 0.85)])
def test_box_lies_above_the_bound(length: float, beam: float, least: float) -> None:
    draft = 1.0
    exact = upright(np.pi * np.hypot(1.0 / length, 1.0 / beam), draft)
    # In k the circle of the same area is at 0.960 of the square and at 0.858 of the rectangle of 2 : 1.
    assert least * exact < bound(box(length, beam, draft, 0.5)) < exact


def test_hemisphere_lies_above_the_bound() -> None:
    """Its first irregular frequency in heave is K a = 2.56 (Hulme 1982)."""
    assert 0.93 * 2.56 < bound(hemisphere(1.0, 10, 6)) < 2.56


def least_of_the_functional(k: float, straight: float, k1: float, draft: float) -> float:
    """Least ∫ (g'² + λ g²) dz with g(0) = 1, g(-draft) = 0, by linear finite elements."""
    z = np.concatenate([np.linspace(0.0, straight, 800), np.linspace(straight, draft, 800)[1:]])
    step = np.diff(z)
    square = np.where(z[1:] <= straight + 1e-12, k**2, k1**2)
    diagonal = np.zeros(len(z))
    diagonal[:-1] += 1.0 / step + square * step / 3.0
    diagonal[1:] += 1.0 / step + square * step / 3.0
    beside = -1.0 / step + square * step / 6.0
    inner = solveh_banded(
        np.stack([np.concatenate([[0.0], beside[1:-1]]), diagonal[1:-1]]), np.eye(len(z) - 2, 1)[:, 0] * -beside[0]
    )
    return float(diagonal[0] + beside[0] * inner[0])


def test_a_hull_that_widens_has_the_least_of_the_functional() -> None:
    straight = SEMI.draft - SEMI.pontoon_height
    widest = SEMI.pontoon_length * SEMI.pontoon_width  # a pontoon with its columns is a body
    k1 = FIRST_ZERO * np.sqrt(np.pi / widest)
    # Linear elements: (k step)² / 12, 1e-6.
    assert bound(semisubmersible(SEMI, 0.5, EVEN)) == pytest.approx(
        least_of_the_functional(FIRST_ZERO, straight, k1, SEMI.draft), rel=1e-5
    )


def conditions(mesh: Mesh, numbers: np.ndarray) -> np.ndarray:
    """Largest condition number of the equations without a lid, of the two classes of half a body."""
    half = Mesh(name=mesh.name, vertices=whole(mesh).vertices[: 2 * len(mesh.vertices)], planes=("y",))
    body = discretize(half)
    result = []
    with threadpool_limits(1, user_api="blas"):  # small matrices: more threads only wait for each other
        for number in numbers:
            double = wave_matrices(body, np.sqrt(number), 1.0)[1]
            result.append(max(np.linalg.cond(matrix.T + 2.0 * np.pi * np.eye(len(matrix))) for matrix in double))
    return np.array(result)


@pytest.mark.parametrize(
    ("mesh", "above"),
    [
        # The ratio of the first irregular K to the bound by the closed forms; none for the semisubmersible.
        (cylinder(1.0, 0.5, 6, 5, 4), 1.0),
        (hemisphere(1.0, 10, 6), 2.56 / 2.4432),
        (box(2.0, 2.0, 1.0, 0.25), 2.2743 / 2.1921),
        (semisubmersible(SEMI, 0.7, EVEN), None),
    ],
    ids=["cylinder", "hemisphere", "box", "semisubmersible"],
)
def test_the_equations_first_fail_at_or_above_the_bound(mesh: Mesh, above: float | None) -> None:
    ratio = np.linspace(0.85, 1.15, 31)
    condition = conditions(mesh, bound(mesh) * ratio)
    first = ratio[np.argmax(condition)]
    assert np.max(condition) > 3.0 * np.median(condition)
    # The meshes of 50 to 100 panels a quadrant move the irregular frequencies by 1 %, and the scan has steps of 1 %.
    assert first > 0.98
    if above is not None:
        assert first == pytest.approx(above, abs=0.02)
    assert np.max(condition[ratio < 0.95]) < 0.3 * np.max(condition)


def test_without_a_lid_heave_goes_astray_above_the_bound_only() -> None:
    mesh = cylinder(1.0, 0.5, 6, 5, 4)
    bare, covered = discretize(mesh), discretize(mesh, lid=lid(mesh, 3))

    def error(number: float) -> float:
        first, second = (solve(b, np.sqrt(number), [0.0], 1.0, 1.0).added_mass[2, 2] for b in (bare, covered))
        return abs(first / second - 1.0)

    near = [error(number) for number in bound(mesh) * np.linspace(0.985, 1.015, 7)]
    assert max(near) > 10.0 * error(0.8 * bound(mesh))
    assert error(0.8 * bound(mesh)) < 0.02


def test_the_largest_of_several_bodies_counts() -> None:
    small, large = cylinder(1.0, 2.0, 6, 4, 3), cylinder(1.5, 1.0, 6, 4, 3)
    pair = merged("pair", [translated(small, (-10.0, 0.0, 0.0)), translated(large, (10.0, 0.0, 0.0))])
    assert bound(pair) == pytest.approx(min(bound(small), bound(large)), rel=1e-9)


def test_the_draught_of_another_body_does_not_count() -> None:
    shallow, deep = cylinder(1.0, 0.3, 6, 4, 3), cylinder(0.5, 9.0, 6, 4, 3)
    pair = merged("pair", [translated(shallow, (-10.0, 0.0, 0.0)), translated(deep, (10.0, 0.0, 0.0))])
    assert bound(pair) == pytest.approx(min(upright(FIRST_ZERO, 0.3), upright(2.0 * FIRST_ZERO, 9.0)), rel=1e-9)


def test_a_submerged_body_has_none() -> None:
    sphere = whole(hemisphere(1.0, 6, 4))
    top = Mesh(name="top", vertices=sphere.vertices[:, [0, 3, 2, 1]] * [1.0, 1.0, -1.0])
    ball = translated(merged("ball", [sphere, top]), (0.0, 0.0, -3.0))
    assert bound(ball) == np.inf
    assert irregular_warning(ball, [100.0]) is None


def test_the_water_of_a_moonpool_counts_as_body() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    heights = np.linspace(0.0, -1.0, 4)
    keel = np.concatenate([np.stack([0.5 * ring, ring]), np.full((2, 25, 1), -1.0)], axis=-1)
    bottom = patch(keel)[:, [0, 3, 2, 1]]
    tube = Mesh(name="tube", vertices=np.concatenate([wall(ring, heights), wall(0.5 * ring[::-1], heights), bottom]))
    area = 12.0 * np.sin(2.0 * np.pi / 24.0)
    assert bound(tube) == pytest.approx(upright(FIRST_ZERO * np.sqrt(np.pi / area), 1.0), rel=1e-9)


def test_the_warning_names_the_limit_and_the_remedy() -> None:
    mesh = cylinder(1.0, 0.5, 6, 4, 3)
    limit = lowest_irregular_frequency(mesh)
    assert irregular_warning(mesh, np.array([0.5, 0.99]) * limit) is None
    text = irregular_warning(mesh, np.array([0.5, 0.99, 1.01]) * limit)
    assert text is not None
    for part in ("cylinder", "1 of 3", f"{limit:.4g} rad/s", "hulls.lid"):
        assert part in text
    with pytest.raises(ScenarioError, match="gravity"):
        lowest_irregular_frequency(mesh, -1.0)
