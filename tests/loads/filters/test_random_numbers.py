"""Counter-based noise: a function of its arguments, standard normal, distinct between blocks."""

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.random_numbers import noise_block, random_generator


def test_noise_blocks_are_standard_normal_and_distinct() -> None:
    block = noise_block(1, 2, 3, 20_000, 2)
    assert np.array_equal(block, noise_block(1, 2, 3, 20_000, 2))
    for other in ((1, 2, 4), (1, 3, 3), (2, 2, 3)):
        assert not np.array_equal(block[:5], noise_block(*other, 5, 2))
    # Four standard deviations of the mean, the variance and the correlation of 20 000 normal numbers.
    np.testing.assert_allclose(block.mean(axis=0), 0.0, atol=4 / np.sqrt(20_000))
    np.testing.assert_allclose(block.var(axis=0), 1.0, atol=4 * np.sqrt(2 / 20_000))
    assert abs(np.mean(block[:, 0] * block[:, 1])) < 4 / np.sqrt(20_000)


def test_a_shorter_block_is_the_head_of_a_longer_one() -> None:
    np.testing.assert_array_equal(noise_block(5, 6, 7, 10, 3), noise_block(5, 6, 7, 100, 3)[:10])


@pytest.mark.parametrize("arguments", [(-1, 0, 0), (0, 2**64, 0), (0, 0, -3)])
def test_numbers_out_of_range_are_refused(arguments: tuple[int, int, int]) -> None:
    with pytest.raises(ScenarioError, match="it must be a whole number from 0 to 2\\^64 - 1"):
        random_generator(*arguments)
