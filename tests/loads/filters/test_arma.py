import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.arma import (
    AutoregressiveProcess,
    autoregressive_fit,
    autoregressive_spectrum,
    correlation_from_spectrum,
    noise_block,
    random_generator,
    stationary_start,
)

FloatArray = NDArray[np.float64]


def vector_markov_correlation(seed: int, size: int, lags: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A first-order vector process y_n = A y_{n-1} + B w_n: A, B B^T and its R_k = A^k R_0."""
    generator = np.random.default_rng(seed)
    transition = generator.standard_normal((size, size))
    transition *= 0.8 / np.max(np.abs(np.linalg.eigvals(transition)))
    root = generator.standard_normal((size, size)) + 2.0 * np.eye(size)
    innovation = root @ root.T
    covariance = solve_discrete_lyapunov(transition, innovation)
    correlation = np.array([np.linalg.matrix_power(transition, k) @ covariance for k in range(lags + 1)])
    return transition, innovation, correlation


def block_toeplitz(correlation: FloatArray) -> FloatArray:
    """Covariance of (y_0, y_1, ... y_{P-1}) from R_0 ... R_{P-1}: block (i, j) is E[y_i y_j^T] = R_{i-j}."""
    order = len(correlation)
    blocks = [[correlation[i - j] if i >= j else correlation[j - i].T for j in range(order)] for i in range(order)]
    return np.block(blocks)


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 4), order=st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_fit_recovers_a_vector_markov_process_of_any_size(seed: int, size: int, order: int) -> None:
    transition, innovation, correlation = vector_markov_correlation(seed, size, order)
    model = autoregressive_fit(correlation)
    # Round-off grows with the condition of R_0, hence a scale of the largest entry and 1e-7.
    scale = np.abs(correlation[0]).max() / np.linalg.eigvalsh(correlation[0])[0]
    np.testing.assert_allclose(model.coefficients[0], transition, atol=1e-9 * scale)
    np.testing.assert_allclose(model.coefficients[1:], 0.0, atol=1e-9 * scale)
    fitted = model.innovation_factor @ model.innovation_factor.T
    np.testing.assert_allclose(fitted, innovation, atol=1e-9 * scale * np.abs(innovation).max())


def test_recursion_equals_the_dense_block_yule_walker_system() -> None:
    generator = np.random.default_rng(5)
    # Sums of decaying exponentials with a positive definite matrix each: a valid correlation, not of finite order.
    roots = generator.standard_normal((3, 3, 3))
    correlation = np.array(
        [sum(root @ root.T * decay**k for root, decay in zip(roots, (0.9, 0.5, -0.3), strict=True)) for k in range(7)]
    )
    model = autoregressive_fit(correlation)
    # R_j = sum_k Phi_k R_{j-k} for j = 1 ... P, written for the transposes.
    dense = np.linalg.solve(block_toeplitz(correlation[:6]).T, np.vstack([r.T for r in correlation[1:]]))
    expected = np.array([dense[3 * k : 3 * k + 3].T for k in range(6)])
    np.testing.assert_allclose(model.coefficients, expected, atol=1e-10)
    innovation = correlation[0] - sum(model.coefficients[k] @ correlation[k + 1].T for k in range(6))
    np.testing.assert_allclose(model.innovation_factor @ model.innovation_factor.T, innovation, atol=1e-10)


def test_stationary_start_has_exactly_the_block_toeplitz_covariance() -> None:
    _, _, correlation = vector_markov_correlation(3, 3, 5)
    # The start is linear in the noise; its columns are the images of unit noises.
    columns = [stationary_start(correlation, unit.reshape(5, 3)).ravel() for unit in np.eye(15)]
    factor = np.array(columns).T
    expected = block_toeplitz(correlation[:5])
    np.testing.assert_allclose(factor @ factor.T, expected, atol=1e-11 * np.abs(expected).max())


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


def test_spectrum_of_the_model_integrates_to_the_variance_and_is_the_closed_form() -> None:
    step, pole = 0.5, 0.7
    model = autoregressive_fit(pole ** np.arange(3.0)[:, None, None])
    frequency = np.linspace(0.0, 1.0 / (2 * step), 4001)
    density = autoregressive_spectrum(model, frequency, step)[:, 0, 0]
    closed = 2 * step * (1 - pole**2) / np.abs(1 - pole * np.exp(-2j * np.pi * frequency * step)) ** 2
    np.testing.assert_allclose(density, closed, rtol=1e-12)
    assert np.trapezoid(density.real, frequency) == pytest.approx(1.0, rel=1e-12)


def test_samples_are_a_function_of_seed_and_index_only() -> None:
    _, _, correlation = vector_markov_correlation(1, 2, 3)
    process = AutoregressiveProcess(correlation, seed=9, stream=4, retained=6)
    straight = np.array([process.window(n, 1)[0].copy() for n in range(600)])
    other = AutoregressiveProcess(correlation, seed=9, stream=4, retained=6)
    np.testing.assert_array_equal(other.window(594, 6), straight[594:])
    np.testing.assert_array_equal(other.window(250, 6), straight[250:256])  # goes back: replayed from the start
    np.testing.assert_array_equal(other.window(0, 6), straight[:6])
    assert not np.array_equal(AutoregressiveProcess(correlation, 10, 4, 6).window(0, 6), straight[:6])
    assert not np.array_equal(AutoregressiveProcess(correlation, 9, 5, 6).window(0, 6), straight[:6])


def test_restored_stream_continues_exactly_also_in_another_object() -> None:
    _, _, correlation = vector_markov_correlation(1, 2, 3)
    process = AutoregressiveProcess(correlation, seed=0, stream=0, retained=4)
    process.window(300, 4)
    state = process.get_state()
    expected = process.window(800, 4).copy()
    process.set_state(state)
    np.testing.assert_array_equal(process.window(800, 4), expected)
    other = AutoregressiveProcess(correlation, seed=0, stream=0, retained=4)
    other.set_state(state)
    np.testing.assert_array_equal(other.window(800, 4), expected)
    with pytest.raises(ScenarioError, match=r"shape \(4, 2\); it must be \(5, 2\)"):
        AutoregressiveProcess(correlation, seed=0, stream=0, retained=5).set_state(state)


def test_stream_has_the_correlation_that_it_was_made_from() -> None:
    _, _, correlation = vector_markov_correlation(7, 2, 4)
    process = AutoregressiveProcess(correlation, seed=2, stream=0, retained=1)
    count = 100_000
    samples = np.array([process.window(n, 1)[0].copy() for n in range(count)])
    # Bartlett's bound on the standard deviation of a sample covariance, sum of |rho| over lags both ways, with
    # rho of the slowest mode 0.8: sqrt(2 / n * (1 + 0.64) / (1 - 0.64)) = 1 %; four of them.
    for lag in range(4):
        sampled = samples[lag:].T @ samples[: count - lag] / (count - lag)
        scale = np.sqrt(np.outer(np.diag(correlation[0]), np.diag(correlation[0])))
        assert np.max(np.abs(sampled - correlation[lag]) / scale) < 0.04


def test_noise_blocks_are_standard_normal_and_distinct() -> None:
    block = noise_block(1, 2, 3, 20_000, 2)
    assert np.array_equal(block, noise_block(1, 2, 3, 20_000, 2))
    assert not np.array_equal(block[:5], noise_block(1, 2, 4, 5, 2))
    # Four standard deviations of the mean and of the variance of 20 000 normal numbers.
    np.testing.assert_allclose(block.mean(axis=0), 0.0, atol=4 / np.sqrt(20_000))
    np.testing.assert_allclose(block.var(axis=0), 1.0, atol=4 * np.sqrt(2 / 20_000))


def test_bad_input_is_refused_with_the_value_and_the_limit() -> None:
    def white(frequency: FloatArray) -> FloatArray:
        return np.ones((len(frequency), 1, 1))

    with pytest.raises(ScenarioError, match=r"sampling step .* is 0.0 s; it must be finite and > 0"):
        correlation_from_spectrum(white, 0.0, 3)
    with pytest.raises(ScenarioError, match=r"order .* is 0"):
        correlation_from_spectrum(white, 1.0, 0)
    with pytest.raises(ScenarioError, match="not finite"):
        correlation_from_spectrum(lambda frequency: np.inf * white(frequency), 1.0, 3)
    with pytest.raises(ScenarioError, match="random seed is -1"):
        random_generator(-1, 0)
    with pytest.raises(SolverError, match=r"innovation covariance of order 1 .* must be > 0"):
        autoregressive_fit(np.array([[[1.0]], [[1.5]]]))
    with pytest.raises(ValueError, match="window of 3"):
        AutoregressiveProcess(np.array([[[1.0]], [[0.5]]]), 0, 0, 3).window(-1, 2)
