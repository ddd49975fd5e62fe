"""Integer time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.clock import to_positive_ticks, to_seconds, to_ticks


@given(st.integers(-(10**15), 10**15))
def test_ticks_survive_a_round_trip(ticks: int) -> None:
    assert to_ticks(to_seconds(ticks), "time") == ticks


def test_decimal_steps_are_exact() -> None:
    assert to_ticks(0.1, "step") == 100_000_000
    assert to_ticks(0.3, "step") == 300_000_000
    assert to_ticks(1e-9, "step") == 1


@pytest.mark.parametrize("seconds", [float("nan"), float("inf")])
def test_time_must_be_finite(seconds: float) -> None:
    with pytest.raises(WiringError, match=r"step of wind: .* is not a finite time"):
        to_ticks(seconds, "step of wind")


def test_time_must_be_whole_nanoseconds() -> None:
    with pytest.raises(WiringError, match=r"step of wind: 0\.333\d* s is not a whole number of nanoseconds"):
        to_ticks(1.0 / 3.0, "step of wind")


@pytest.mark.parametrize("seconds", [0.0, -0.1])
def test_positive_ticks(seconds: float) -> None:
    with pytest.raises(WiringError, match="is not positive"):
        to_positive_ticks(seconds, "step of wind")
