"""Cumulants of quadratic forms against closed forms, eigenvalue sums and simulation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.cumulants import QuadraticForm, beside, cumulants, from_waves


def random_form(seed: int, count: int, linear: float = 1.0) -> QuadraticForm:
    generator = np.random.default_rng(seed)
    matrix = generator.standard_normal((count, count))
    return QuadraticForm(linear=linear * generator.standard_normal(count), matrix=matrix + matrix.T)


def random_waves(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A linear, a difference-frequency and a total-frequency function."""
    generator = np.random.default_rng(seed)
    linear, rest = np.split(generator.standard_normal((1 + 2 * count, count, 2)) @ [1.0, 1j], [1])
    first, second = np.split(rest, 2)
    return linear[0], first + first.conj().T, second + second.T


def normals(seed: int, samples: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((samples, count))


def values(form: QuadraticForm, variables: np.ndarray) -> np.ndarray:
    return variables @ form.linear + np.sum((variables @ form.matrix) * variables, axis=-1)


def product(x: np.ndarray, y: np.ndarray, step: float) -> QuadraticForm:
    """Form of the product of two linear responses in the same waves."""
    difference = 0.5 * (np.outer(x, y.conj()) + np.outer(y, x.conj()))
    total = 0.5 * (np.outer(x, y) + np.outer(y, x))
    return from_waves(np.zeros(len(x), complex), difference, total, step)


def assert_moments(form: QuadraticForm, seed: int, samples: int = 400_000) -> None:
    """Within 4 standard errors, which come from 40 batches, of the sample's mean and central moments.

    Of a batch, central moments about the exact mean have no bias.
    """
    result = cumulants(form)
    deviation = math.sqrt(result.variance)
    batches = values(form, normals(seed, samples, len(form.linear))).reshape(40, -1)
    scaled = (batches - result.mean) / deviation
    for order, exact in ((1, 0.0), (2, 1.0), (3, result.skewness), (4, 3.0 + result.excess_kurtosis)):
        moment = np.mean(scaled**order, axis=1)
        assert abs(moment.mean() - exact) < 4.0 * moment.std(ddof=1) / math.sqrt(40), order


@pytest.mark.parametrize("degrees", [1, 2, 5, 40])
def test_chi_square_has_its_cumulants_in_closed_form(degrees: int) -> None:
    result = cumulants(QuadraticForm(linear=np.zeros(degrees), matrix=3.0 * np.eye(degrees)))
    assert result.mean == pytest.approx(3.0 * degrees)
    assert result.variance == pytest.approx(9.0 * 2.0 * degrees)
    assert result.skewness == pytest.approx(math.sqrt(8.0 / degrees))
    assert result.excess_kurtosis == pytest.approx(12.0 / degrees)


def test_non_central_chi_square() -> None:
    """(y + d)^2 = y^2 + 2 d y + d^2 has the cumulants 2^(k-1) (k-1)! (1 + k d^2)."""
    d = 0.7
    result = cumulants(QuadraticForm(linear=np.array([2.0 * d]), matrix=np.eye(1)))
    variance = 2.0 * (1.0 + 2.0 * d**2)
    assert result.variance == pytest.approx(variance)
    assert result.skewness == pytest.approx(8.0 * (1.0 + 3.0 * d**2) / variance**1.5)
    assert result.excess_kurtosis == pytest.approx(48.0 * (1.0 + 4.0 * d**2) / variance**2)


def test_the_square_of_a_linear_response_is_chi_square() -> None:
    """Whatever its spectrum: skewness √8, excess kurtosis 12, mean the variance of the response."""
    x, _, _ = random_waves(3, 30)
    result = cumulants(product(x, x, 0.01))
    assert result.mean == pytest.approx(np.sum(np.abs(x) ** 2) * 0.01)
    assert result.variance == pytest.approx(2.0 * result.mean**2)
    assert result.skewness == pytest.approx(math.sqrt(8.0))
    assert result.excess_kurtosis == pytest.approx(12.0)


def test_the_product_of_two_linear_responses_has_the_cumulants_of_a_bivariate_normal() -> None:
    """k_n of x y from sigma_x sigma_y and the correlation: eigenvalues (rho ± 1) / 2 times sigma_x sigma_y."""
    (x, _, _), (y, _, _) = random_waves(4, 25), random_waves(5, 25)
    step = 0.004
    scale = step * math.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2))
    rho = step * np.sum(x * y.conj()).real / scale
    result = cumulants(product(x, y, step))
    assert result.mean == pytest.approx(rho * scale)
    assert result.variance == pytest.approx((1.0 + rho**2) * scale**2)
    assert result.skewness == pytest.approx((6.0 * rho + 2.0 * rho**3) / (1.0 + rho**2) ** 1.5)
    assert result.excess_kurtosis == pytest.approx(6.0 * (1.0 + 6.0 * rho**2 + rho**4) / (1.0 + rho**2) ** 2)


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.floats(1e-3, 10.0))
@settings(max_examples=30, deadline=None)
def test_a_product_is_the_product_in_every_realization(seed: int, count: int, step: float) -> None:
    (x, _, _), (y, _, _) = random_waves(seed, count), random_waves(seed + 1, count)
    variables = normals(seed, 5, 2 * count)
    waves = math.sqrt(step) * (variables[:, :count] + 1j * variables[:, count:])
    x_value, y_value = (waves @ x).real, (waves @ y).real
    form = product(x, y, step)
    size = step * count * 2.0 * np.abs(x).max() * np.abs(y).max() * (1.0 + np.abs(variables).max() ** 2)
    np.testing.assert_allclose(values(form, variables), x_value * y_value, atol=1e-13 * count * size)
    linear = from_waves(x, np.zeros((count, count), complex), np.zeros((count, count), complex), step)
    np.testing.assert_allclose(values(linear, variables), x_value, atol=1e-13 * count * math.sqrt(size) * 10.0)


def test_waves_give_the_variance_of_their_spectra() -> None:
    """Variance from the spectra at difference and total frequencies: df² (ΣΣ |B|² + ΣΣ |P|²), by other means."""
    linear, difference, total = random_waves(11, 20)
    step = 0.02
    result = cumulants(from_waves(linear, difference, total, step))
    assert result.mean == pytest.approx(step * np.trace(difference).real)
    first_order = step * np.sum(np.abs(linear) ** 2)
    second_order = step**2 * (np.sum(np.abs(difference) ** 2) + np.sum(np.abs(total) ** 2))
    assert result.variance == pytest.approx(first_order + second_order)


@given(st.integers(0, 2**32 - 1), st.integers(1, 15))
@settings(max_examples=40, deadline=None)
def test_traces_are_the_sums_over_eigenvalues(seed: int, count: int) -> None:
    """Kac and Siegert: k_n = sum of 2^(n-1) (n-1)! λ^n + 2^(n-3) n! λ^(n-2) c²."""
    form = random_form(seed, count)
    eigenvalue, vector = np.linalg.eigh(form.matrix)
    along = vector.T @ form.linear
    result = cumulants(form)
    scale = np.sum(np.abs(eigenvalue))
    assert result.mean == pytest.approx(np.sum(eigenvalue), abs=1e-12 * scale)
    variance = np.sum(along**2 + 2.0 * eigenvalue**2)
    assert result.variance == pytest.approx(variance)
    third = np.sum(6.0 * eigenvalue * along**2 + 8.0 * eigenvalue**3)
    assert result.skewness == pytest.approx(third / variance**1.5, abs=1e-12)
    fourth = np.sum(48.0 * (eigenvalue * along) ** 2 + 48.0 * eigenvalue**4)
    assert result.excess_kurtosis == pytest.approx(fourth / variance**2)


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(0.0, 30.0))
@settings(max_examples=60, deadline=None)
def test_kurtosis_is_at_least_four_thirds_of_the_squared_skewness(seed: int, count: int, linear: float) -> None:
    result = cumulants(random_form(seed, count, linear))
    assert result.excess_kurtosis >= 4.0 / 3.0 * result.skewness**2 * (1.0 - 1e-12)
    assert result.skewness**2 <= 8.0 * (1.0 + 1e-12)


def test_moments_of_a_simulated_form() -> None:
    assert_moments(random_form(21, 4, 3.0), seed=22)


def test_moments_of_simulated_waves() -> None:
    linear, difference, total = random_waves(31, 4)
    assert_moments(from_waves(3.0 * linear, difference, 0.3 * total, 0.1), seed=32)


def test_moments_of_waves_beside_slow_motion() -> None:
    first, second = random_form(41, 3, 2.0), random_form(42, 2, 2.0)
    cross = np.array([[3.0, -1.0], [0.5, 2.0], [0.0, 4.0]])
    form = beside(first, second, cross)
    assert_moments(form, seed=43)
    variables = normals(44, 6, 5)
    slow = variables[:, 3:]
    waves = variables[:, :3]
    parts = values(first, waves) + values(second, slow) + np.sum((waves @ cross) * slow, axis=1)
    np.testing.assert_allclose(values(form, variables), parts, rtol=1e-12)


def test_independent_forms_add_their_cumulants() -> None:
    first, second = random_form(51, 4), random_form(52, 3)
    a, b, both = cumulants(first), cumulants(second), cumulants(beside(first, second, np.zeros((4, 3))))
    assert both.mean == pytest.approx(a.mean + b.mean)
    assert both.variance == pytest.approx(a.variance + b.variance)
    third = a.skewness * a.variance**1.5 + b.skewness * b.variance**1.5
    assert both.skewness * both.variance**1.5 == pytest.approx(third)
    fourth = a.excess_kurtosis * a.variance**2 + b.excess_kurtosis * b.variance**2
    assert both.excess_kurtosis * both.variance**2 == pytest.approx(fourth)


def test_gaussian_and_constant_responses_are_limits() -> None:
    gaussian = cumulants(QuadraticForm(linear=np.array([3.0, 4.0]), matrix=np.zeros((2, 2))))
    assert (gaussian.mean, gaussian.variance, gaussian.skewness, gaussian.excess_kurtosis) == (0.0, 25.0, 0.0, 0.0)
    nothing = cumulants(QuadraticForm(linear=np.zeros(2), matrix=np.zeros((2, 2))))
    assert (nothing.variance, nothing.skewness, nothing.excess_kurtosis) == (0.0, 0.0, 0.0)


def test_what_does_not_fit_is_refused() -> None:
    linear, difference, total = random_waves(61, 3)
    with pytest.raises(ScenarioError, match=r"\(n,\) and \(n, n\)"):
        QuadraticForm(linear=np.zeros(2), matrix=np.zeros((3, 3)))
    with pytest.raises(ScenarioError, match="transpose"):
        QuadraticForm(linear=np.zeros(2), matrix=np.array([[0.0, 1.0], [0.0, 0.0]]))
    with pytest.raises(ScenarioError, match="finite"):
        QuadraticForm(linear=np.zeros(1), matrix=np.full((1, 1), np.nan))
    with pytest.raises(ScenarioError, match="Hermitian"):
        from_waves(linear, total, total, 0.1)
    with pytest.raises(ScenarioError, match="symmetric"):
        from_waves(linear, difference, difference, 0.1)
    with pytest.raises(ScenarioError, match="bi-spectral"):
        from_waves(linear, difference[:2], total, 0.1)
    with pytest.raises(ScenarioError, match="spacing"):
        from_waves(linear, difference, total, 0.0)
    form = random_form(1, 2)
    with pytest.raises(ScenarioError, match=r"\(2, 2\)"):
        beside(form, form, np.zeros((2, 3)))
