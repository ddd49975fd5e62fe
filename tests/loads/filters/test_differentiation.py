"""Central differences against polynomials, a harmonic that is really differentiated, and known errors."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.differentiation import (
    CENTRAL_DIFFERENCES,
    derivative_gain,
    differentiate,
    largest_step,
)

ORDERS = tuple(CENTRAL_DIFFERENCES)


@pytest.mark.parametrize("order", ORDERS)
@given(coefficients=st.lists(st.floats(-10.0, 10.0), min_size=7, max_size=7), step=st.floats(0.05, 2.0))
def test_polynomials_of_the_order_are_differentiated_exactly(
    order: int, coefficients: list[float], step: float
) -> None:
    polynomial = Polynomial(coefficients[: order + 1])
    times = step * np.arange(-order, order + 1)
    found = differentiate(polynomial(times), step, order)
    scale = np.abs(polynomial(times)).max() / step + 1.0
    np.testing.assert_allclose(found, polynomial.deriv()(times[order // 2 : -(order // 2)]), atol=1e-13 * scale)


@pytest.mark.parametrize("order", ORDERS)
def test_next_odd_degree_is_not(order: int) -> None:
    """Guards the table: it states the order, not a lower bound."""
    times = np.arange(-(order // 2), order // 2 + 1.0)
    assert abs(differentiate(times ** (order + 1), 1.0, order)[0]) >= 1.0


def test_antisymmetry() -> None:
    """No phase error: the weights are odd."""
    for weights in CENTRAL_DIFFERENCES.values():
        np.testing.assert_array_equal(weights, -weights[::-1])
        assert not weights.flags.writeable


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(("frequency", "step"), [(0.05, 0.5), (0.2, 0.1), (0.2, 1.0), (0.7, 0.5)])
def test_gain_against_a_harmonic(order: int, frequency: float, step: float) -> None:
    omega = 2 * np.pi * frequency
    times = step * np.arange(60)
    derivative = differentiate(np.sin(omega * times), step, order)
    exact = omega * np.cos(omega * times[order // 2 : -(order // 2)])
    np.testing.assert_allclose(derivative, float(derivative_gain(frequency, step, order)) * exact, atol=1e-12)


def test_second_order_gain_is_the_cardinal_sine() -> None:
    frequency = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(derivative_gain(frequency, 0.5), np.sinc(frequency), atol=1e-14)


# Known errors of the gain at 0.2 Hz, to two digits.
@pytest.mark.parametrize(
    ("order", "step", "error"),
    [(2, 0.1, 2.6e-3), (2, 0.5, 6.5e-2), (2, 1.0, 0.24), (4, 0.1, 8.3e-6), (6, 0.5, 4.1e-4)],
)
def test_documented_errors(order: int, step: float, error: float) -> None:
    assert 1.0 - derivative_gain(0.2, step, order) == pytest.approx(error, rel=0.03)


@pytest.mark.parametrize("order", ORDERS)
@given(frequency=st.floats(0.01, 5.0), error=st.floats(1e-6, 0.5))
def test_largest_step_is_where_the_error_is_reached(order: int, frequency: float, error: float) -> None:
    step = largest_step(frequency, error, order)
    # round-off of the gain over an error of 1e-6
    assert 1.0 - derivative_gain(frequency, step, order) == pytest.approx(error, rel=1e-8)
    assert 1.0 - derivative_gain(frequency, 0.9 * step, order) < error


def test_records_of_several_signals() -> None:
    samples = np.random.default_rng(1).normal(size=(20, 3, 2))
    found = differentiate(samples, 0.5, 4)
    assert found.shape == (16, 3, 2)
    np.testing.assert_allclose(found[:, 1, 0], differentiate(samples[:, 1, 0], 0.5, 4), rtol=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: differentiate(np.zeros(9), 0.1, 3), "order 3 is not one of 2, 4, 6"),
        (lambda: differentiate(np.zeros(9), 0.0), r"step of a central difference is 0\. s; it must be finite and > 0"),
        (lambda: differentiate(np.zeros(6), 0.1, 6), "6 samples; it needs 7 or more"),
        (lambda: differentiate(1.0, 0.1), "0 samples"),
        (lambda: derivative_gain(0.1, float("nan")), "step of a central difference is nan s"),
        (lambda: largest_step(0.0, 0.1), r"frequency of a central difference is 0\. Hz"),
        (lambda: largest_step(0.1, 1.0), "error of the gain is 1.0; it must be between 0 and 1"),
    ],
)
def test_refusals(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        call()
