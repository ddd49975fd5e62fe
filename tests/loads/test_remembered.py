"""Results kept by the content of arrays."""

import numpy as np
import pytest

from tlpsim.loads.remembered import remembered


def test_a_result_is_computed_once_for_the_same_values() -> None:
    calls = []

    @remembered(2)
    def scaled(values: np.ndarray, factor: float) -> tuple[np.ndarray, float]:
        calls.append(values)
        return factor * values, factor

    values = np.arange(6.0).reshape(2, 3)
    first, again = scaled(values, 2.0), scaled(values.copy(), 2.0)
    assert len(calls) == 1
    np.testing.assert_array_equal(again[0], 2.0 * values)
    with pytest.raises(ValueError, match="read-only"):
        first[0][0, 0] = 1.0
    values[0, 0] = 5.0  # other values in the same array are another argument
    np.testing.assert_array_equal(scaled(values, 2.0)[0], 2.0 * values)
    scaled(values.reshape(3, 2), 2.0)
    scaled(values.astype(np.complex128), 2.0)
    assert len(calls) == 4
    scaled(np.arange(6.0).reshape(2, 3), 2.0)  # the first of more than two is gone
    assert len(calls) == 5


def test_a_failure_is_not_kept() -> None:
    found = []

    @remembered(2)
    def sometimes(values: np.ndarray) -> np.ndarray:
        found.append(0)
        if len(found) == 1:
            raise ValueError("not yet")
        return values + 1.0

    with pytest.raises(ValueError, match="not yet"):
        sometimes(np.zeros(2))
    np.testing.assert_array_equal(sometimes(np.zeros(2)), np.ones(2))
