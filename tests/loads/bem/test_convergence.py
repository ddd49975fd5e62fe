import numpy as np
import pytest

from tlpsim.loads.bem.convergence import limit, observed_limit, resolved_share
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hemisphere import hemisphere_coefficients
from tlpsim.loads.bem.hulls import hemisphere
from tlpsim.loads.bem.solver import solve


@pytest.mark.parametrize("order", [4.0 / 3.0, 1.5, 5.0 / 3.0, 2.0])
def test_limit_of_two_meshes_lies_within_its_error(order: float) -> None:
    """f = 3 + 0.2 h^p for the orders between edges and smooth surfaces."""
    fine, coarse = (3.0 + 0.2 * h**order for h in (0.5, 1.0))
    found = limit([fine, 1j * fine], [coarse, 1j * coarse])
    assert np.all(np.abs(found.value - np.array([3.0, 3.0j])) <= found.error * (1 + 1e-12))
    if order == 5.0 / 3.0:
        assert found.value[0] == pytest.approx(3.0, abs=1e-12)


def test_observed_order_and_limit() -> None:
    exact = np.array([1.0, -2.0])
    values = [exact + 0.3 * h**1.7 for h in (1.0, 0.5, 0.25)]
    (value, error), order = observed_limit(*values)
    np.testing.assert_allclose(order, 1.7, atol=1e-9)
    np.testing.assert_allclose(value, exact, atol=1e-12)
    # Roache: three times the last correction, since the order is not the formal one.
    np.testing.assert_allclose(error, 3.0 * np.abs(exact - values[2]), rtol=1e-6)


def test_values_that_do_not_converge_keep_the_last_step_as_error() -> None:
    (value, error), order = observed_limit(1.0, 2.0, 1.5)
    assert (value, error) == (1.5, 0.5)
    assert np.isnan(order)


def test_hemisphere_extrapolated_from_384_panels() -> None:
    """Added mass of heave and surge at Ka = 1 against the multipoles, inside the bar, and nearer than the fine mesh."""
    solutions = [solve(discretize(hemisphere(1.0, *count)), 1.0, [0.0], 1.0, 1.0) for count in ((12, 8), (6, 4))]
    fine, coarse = (s.added_mass[[0, 2], [0, 2]] / (2.0 / 3.0 * np.pi) for s in solutions)
    exact = np.array([hemisphere_coefficients(order, 1.0)[0] for order in (1, 0)])
    found = limit(fine, coarse)
    assert np.all(np.abs(found.value - exact) <= found.error)
    assert np.all(np.abs(found.value - exact) < 0.7 * np.abs(fine - exact))


def test_short_waves_are_not_extrapolated() -> None:
    """Panels of a quarter of the radius at the waterline: diagonals of about 0.4 take part up to k = 2.5 or so."""
    coarse = hemisphere(1.0, 6, 6)
    share = resolved_share(coarse, [0.1, 1.0, 4.0, 40.0])
    np.testing.assert_allclose(share[[0, 1, 3]], [1.0, 1.0, 0.0], atol=1e-12)
    assert 0.0 < share[2] < 1.0
    found = limit(np.full(4, 2.0), np.full(4, 3.0), share)
    assert found.value[0] < found.value[2] < found.value[3] == 2.0
    assert found.error[3] > found.error[0]
