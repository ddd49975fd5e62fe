"""Two-stage matching against dense systems, processes of finite order, and the properties that define it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.matching import (
    autoregressive_fit,
    correlation_from_spectrum,
    matched_arma,
    with_variance,
)
from tlpsim.loads.filters.model import ArmaModel, covariance, impulse_response, largest_pole

FloatArray = NDArray[np.float64]


def vector_markov_correlation(seed: int, size: int, lags: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A first-order vector process y_n = A y_{n-1} + B w_n: A, B B^T and its R_k = A^k R_0."""
    generator = np.random.default_rng(seed)
    transition = generator.standard_normal((size, size))
    transition *= 0.8 / np.max(np.abs(np.linalg.eigvals(transition)))
    root = generator.standard_normal((size, size)) + 2.0 * np.eye(size)
    innovation = root @ root.T
    present = solve_discrete_lyapunov(transition, innovation)
    correlation = np.array([np.linalg.matrix_power(transition, k) @ present for k in range(lags + 1)])
    return transition, innovation, correlation


def block_toeplitz(correlation: FloatArray) -> FloatArray:
    """Covariance of (y_0, y_1, ... y_{P-1}) from R_0 ... R_{P-1}: block (i, j) is E[y_i y_j^T] = R_{i-j}."""
    order = len(correlation)
    return np.block(
        [[correlation[i - j] if i >= j else correlation[j - i].T for j in range(order)] for i in range(order)]
    )


def decaying_correlation(lags: int) -> FloatArray:
    """Sum of decaying exponentials with a positive definite matrix each: valid, and of no finite order."""
    roots = np.random.default_rng(5).standard_normal((3, 3, 3))
    decays = (0.9, 0.5, -0.3)
    return np.array(
        [sum(root @ root.T * decay**k for root, decay in zip(roots, decays, strict=True)) for k in range(lags + 1)]
    )


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 4), order=st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_fit_recovers_a_vector_markov_process_of_any_size(seed: int, size: int, order: int) -> None:
    transition, innovation, correlation = vector_markov_correlation(seed, size, order)
    model = autoregressive_fit(correlation, 1.0)
    # Round-off grows with the condition of R_0, hence a scale of the largest entry and 1e-9.
    scale = np.abs(correlation[0]).max() / np.linalg.eigvalsh(correlation[0])[0]
    np.testing.assert_allclose(model.autoregressive[0], transition, atol=1e-9 * scale)
    np.testing.assert_allclose(model.autoregressive[1:], 0.0, atol=1e-9 * scale)
    fitted = model.moving_average[0] @ model.moving_average[0].T
    np.testing.assert_allclose(fitted, innovation, atol=1e-9 * scale * np.abs(innovation).max())


def test_recursion_equals_the_dense_block_yule_walker_system() -> None:
    correlation = decaying_correlation(6)
    model = autoregressive_fit(correlation, 1.0)
    # R_j = sum_k Phi_k R_{j-k} for j = 1 ... P, written for the transposes.
    dense = np.linalg.solve(block_toeplitz(correlation[:6]).T, np.vstack([r.T for r in correlation[1:]]))
    expected = np.array([dense[3 * k : 3 * k + 3].T for k in range(6)])
    np.testing.assert_allclose(model.autoregressive, expected, atol=1e-10)
    np.testing.assert_allclose(covariance(model, 6), correlation, atol=1e-10)


@pytest.mark.parametrize(("p", "q"), [(1, 1), (3, 3), (2, 5), (5, 2), (8, 0)])
def test_matched_model_keeps_the_impulse_response_and_satisfies_its_equations(p: int, q: int) -> None:
    correlation = decaying_correlation(8)
    long = autoregressive_fit(correlation, 1.0)
    model = matched_arma(long, correlation, p, q, lags=p)
    assert model.orders == (p, q)
    response = impulse_response(long, q + 1)
    np.testing.assert_allclose(impulse_response(model, q + 1), response, atol=1e-10)
    for j in range(1, p + 1):
        expected = sum(
            model.autoregressive[k - 1] @ (correlation[j - k] if j >= k else correlation[k - j].T)
            for k in range(1, p + 1)
        )
        expected = expected + sum(
            (model.moving_average[m] @ response[m - j].T for m in range(j, q + 1)), start=np.zeros((3, 3))
        )
        np.testing.assert_allclose(correlation[j], expected, atol=1e-10)


def test_match_of_full_order_is_the_autoregression_itself() -> None:
    correlation = decaying_correlation(5)
    long = autoregressive_fit(correlation, 1.0)
    model = matched_arma(long, correlation, 5, 0, lags=5)
    np.testing.assert_allclose(model.autoregressive, long.autoregressive, atol=1e-9)
    np.testing.assert_allclose(model.moving_average, long.moving_average, atol=1e-9)


def test_match_recovers_an_arma_process() -> None:
    true = ArmaModel(
        autoregressive=np.array([[[0.5, 0.2], [-0.1, 0.6]]]),
        moving_average=np.array([[[1.0, 0.0], [0.3, 0.8]], [[0.4, 0.1], [0.0, 0.3]]]),
        step=1.0,
    )
    correlation = covariance(true, 60)
    for lags in (1, 60):
        model = matched_arma(autoregressive_fit(correlation, 1.0), correlation, 1, 1, lags)
        # The moving average is invertible with the root 0.4: an autoregression of 60 terms leaves 0.4^60.
        np.testing.assert_allclose(model.autoregressive, true.autoregressive, atol=1e-10)
        np.testing.assert_allclose(model.moving_average, true.moving_average, atol=1e-10)


def test_variance_is_restored_exactly_and_the_poles_stay() -> None:
    correlation = decaying_correlation(12)
    model = matched_arma(autoregressive_fit(correlation, 1.0), correlation, 2, 2, lags=2)
    restored = with_variance(model, correlation[0])
    assert np.abs(covariance(model, 0)[0] - correlation[0]).max() > 1e-4  # there is something to restore
    np.testing.assert_allclose(covariance(restored, 0)[0], correlation[0], rtol=1e-12, atol=1e-12)
    assert largest_pole(restored) == pytest.approx(largest_pole(model), abs=1e-10)


def test_correlation_of_white_noise_and_of_a_pure_delay() -> None:
    step, level = 0.5, 3.0

    def delayed(frequency: FloatArray) -> NDArray[np.complex128]:
        # y_1(t) = y_2(t - 2 steps) has S_12 = S exp(-i 2 pi f 2 dt): E[y_1(n) y_2(n-2)] is the whole variance.
        cross = level * np.exp(-2j * np.pi * frequency * 2 * step)
        white = np.full_like(cross, level)
        return np.moveaxis(np.array([[white, cross], [np.conj(cross), white]]), 2, 0)

    correlation = correlation_from_spectrum(delayed, step, 4, intervals=2**10)
    expected = np.zeros((5, 2, 2))
    expected[0] = level / (2 * step) * np.eye(2)
    expected[2, 0, 1] = level / (2 * step)
    np.testing.assert_allclose(correlation, expected, atol=1e-12)


def test_bad_input_is_refused_with_the_value_and_the_limit() -> None:
    def white(frequency: FloatArray) -> FloatArray:
        return np.ones((len(frequency), 1, 1))

    with pytest.raises(ScenarioError, match=r"sampling step .* is 0.0 s; it must be finite and > 0"):
        correlation_from_spectrum(white, 0.0, 3)
    with pytest.raises(ScenarioError, match=r"order .* is 0"):
        correlation_from_spectrum(white, 1.0, 0)
    with pytest.raises(ScenarioError, match="not finite"):
        correlation_from_spectrum(lambda frequency: np.inf * white(frequency), 1.0, 3)
    with pytest.raises(SolverError, match=r"innovation covariance of order 1 .* must be > 0"):
        autoregressive_fit(np.array([[[1.0]], [[1.5]]]), 1.0)
