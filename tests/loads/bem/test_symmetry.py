"""Fourfold symmetry: found where it is, and without effect on the numbers."""

import numpy as np
import pytest

from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import box, hemisphere, issc_hull, lid, tlp
from tlpsim.loads.bem.mesh import whole
from tlpsim.loads.bem.solver import added_mass_limit, solve
from tlpsim.loads.bem.symmetry import components_of, system_matrices, system_vectors

TLP = tlp(issc_hull(), 9.0)
LID = lid(TLP, 1)


def test_fold_is_found_on_square_platforms_only() -> None:
    assert discretize(TLP, lid=LID).fold.halved
    assert discretize(hemisphere(1.0, 4, 4)).fold.halved
    assert not discretize(hemisphere(1.0, 4, 3)).fold.halved  # a panel in the plane x = y would be its own mirror
    assert not discretize(box(4.0, 3.0, 1.0, 0.5)).fold.halved
    assert not discretize(whole(TLP)).fold.halved


@pytest.mark.parametrize("depth", [np.inf, 60.0])
def test_fourfold_symmetry_gives_what_the_whole_mesh_gives(depth: float) -> None:
    folded, full = discretize(TLP, depth, LID), discretize(whole(TLP), depth, whole(LID))
    first, second = (solve(body, 0.7, [0.3, 2.0], 1.0, 9.81) for body in (folded, full))
    for name in ("added_mass", "radiation_damping", "excitation_force", "haskind_force"):
        value, exact = getattr(first, name), getattr(second, name)
        # Gauss points of the lid's triangles depend on which of their vertices is written twice.
        np.testing.assert_allclose(value, exact, atol=2e-5 * np.max(np.abs(exact)))
    infinite, exact = (added_mass_limit(body, -1.0, 1.0) for body in (folded, full))
    np.testing.assert_allclose(infinite, exact, atol=3e-6 * np.max(exact))


def test_systems_of_a_fold_do_what_the_matrices_do() -> None:
    """Products of the reduced systems, put together again, are the products of the four classes."""
    fold = discretize(TLP).fold
    generator = np.random.default_rng(5)
    count = len(fold.mirror)
    here, there = fold.fields, fold.mirror[fold.fields]
    stored = generator.standard_normal((4, count, len(here)))
    complete = np.empty((4, count, count))
    complete[:, :, here] = stored
    complete[:, :, there] = stored[[0, 2, 1, 3]][:, fold.mirror]
    columns = generator.standard_normal((4, count, 3))
    products = [
        matrix.T @ vector
        for matrix, vector in zip(system_matrices(stored, fold), system_vectors(columns, fold), strict=True)
    ]
    expected = np.einsum("cji,cjk->cik", complete, columns)
    np.testing.assert_allclose(components_of(products, fold), expected, atol=1e-11)
