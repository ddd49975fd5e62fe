"""Arrays to text and back, by a decoder of its own; the browser's is tested in `test_browser.py`."""

import base64
import math
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tlpsim.scenarios.report.packing import LARGEST, pack, pack_times


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    """Eq. (1) of `tlpsim.scenarios.report.packing` and its differences, undone value by value."""
    data, count = zlib.decompress(base64.b64decode(packed["data"])), packed["count"]
    folded = [(data[i] << 8) + data[count + i] for i in range(count)]
    coded = [f // 2 if f % 2 == 0 else -(f + 1) // 2 for f in folded]
    for _ in range(packed["differences"]):
        total, sums = 0, []
        for each in coded:
            total += each
            sums.append(total)
        coded = sums
    whole = [each % 65536 for each in coded]
    return np.array([math.nan if q == LARGEST + 1 else packed["offset"] + packed["scale"] * q for q in whole])


@given(arrays.arrays(np.float64, st.integers(0, 60), elements=st.floats(-1e12, 1e12, width=64)))
def test_values_come_back_within_half_a_step(values: np.ndarray) -> None:
    packed = pack(values)
    room = 0.5 * packed["scale"] + 1e-12 * np.max(np.abs(values), initial=0.0)
    np.testing.assert_allclose(unpacked(packed), values, rtol=0.0, atol=room)
    if len(values) and np.ptp(values) > 0.0:
        assert packed["scale"] == pytest.approx(np.ptp(values) / LARGEST)


def test_missing_values_stay_missing_and_do_not_set_the_range() -> None:
    values = np.array([1.0, np.nan, 2.0, np.inf, 1.5, -np.inf, np.nan])
    found = unpacked(pack(values))
    assert np.array_equal(np.isnan(found), ~np.isfinite(values))
    np.testing.assert_allclose(found[[0, 2, 4]], [1.0, 2.0, 1.5], atol=0.5 / LARGEST)
    assert np.isnan(unpacked(pack(np.full(3, np.nan)))).all()


@pytest.mark.parametrize("values", [np.zeros(0), np.full(5, -3.25), np.array([7.0])])
def test_what_does_not_vary_is_exact(values: np.ndarray) -> None:
    assert np.array_equal(unpacked(pack(values)), values)


def test_smooth_signals_take_a_fraction_of_their_doubles() -> None:
    time = np.arange(0.0, 3600.0, 0.1)
    waves = np.sin(2 * np.pi * time / 11.0) + 0.3 * np.sin(2 * np.pi * time / 7.3)
    text = pack(waves)["data"]
    # 36000 doubles; noise of rounding alone is some 3 bits a value after four differences.
    assert len(text) < 36_000
    # Noise has no small differences: no more than 16 bits a value, and the tenth that deflate may add.
    noise = np.random.default_rng(1).standard_normal(36_000)
    assert len(pack(noise)["data"]) < 1.1 * 36_000 * 2 * 4 / 3


def test_a_table_is_packed_flat() -> None:
    table = np.arange(6.0).reshape(2, 3)
    np.testing.assert_allclose(unpacked(pack(table)), table.ravel(), atol=1e-4)


def test_even_times_are_three_numbers_and_others_doubles() -> None:
    even = pack_times(np.arange(1000) * 0.1)
    assert even == {"count": 1000, "start": 0.0, "step": pytest.approx(0.1)}
    times = np.array([0.0, 0.1, 0.1 + 1e-9, 5.0])
    uneven = pack_times(times)
    assert np.array_equal(np.frombuffer(zlib.decompress(base64.b64decode(uneven["data"])), "<f8"), times)
    assert pack_times(np.zeros(0))["count"] == 0
