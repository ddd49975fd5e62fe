import math

import numpy as np
import pytest

from tlpsim.scenarios.report.words import (
    display_unit,
    interval,
    listed,
    number,
    rounded,
    seconds,
    short,
    squared,
    typeset,
)
from tlpsim.scenarios.statistics.records import Estimate


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.23456, "1.235"), (-0.0001, "0.000"), (-2.5, "−2.500"), (math.nan, "–"), (math.inf, "–")],
)
def test_number(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (9.999, "10.0"),
        (12345.0, "12\u202f300"),
        (-0.00123, "−0.00123"),
        (1e-9, "1.00·10⁻⁹"),
        (-1.5e12, "−1.50·10¹²"),
        (math.nan, "–"),
    ],
)
def test_short(value: float, text: str) -> None:
    assert short(value) == text


@pytest.mark.parametrize(
    ("unit", "text"),
    [("m/s2", "m/s²"), ("N.m", "N·m"), ("1e-4 rad", "10⁻⁴ rad"), ("kg.m2", "kg·m²"), ("", ""), ("m", "m")],
)
def test_typeset(unit: str, text: str) -> None:
    assert typeset(unit) == text


def test_squares_of_units() -> None:
    assert [squared(unit) for unit in ("m", "cm", "1e-4 rad", "m/s")] == ["m²", "cm²", "(10⁻⁴ rad)²", "(m/s)²"]


@pytest.mark.parametrize(
    ("time", "text"), [(45.0, "45.0 s"), (600.0, "10 min"), (10800.0, "3 h"), (9999.6, "2 h 46 min 40 s")]
)
def test_seconds(time: float, text: str) -> None:
    assert seconds(time) == text


def test_interval_and_lists() -> None:
    assert interval(Estimate(value=1.0, low=0.5, high=1.5), 10.0, 1) == "5.0 to 15.0"
    assert interval(Estimate(value=1.0)) == ""
    assert [listed(each) for each in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]


def test_signals_are_shown_in_units_of_the_field() -> None:
    values = np.array([-3e6, 1.0, np.nan])
    assert display_unit("wave.force.surge", "N", values) == ("MN", 1e-6)
    assert display_unit("wave.force.surge", "N", 1e-2 * values) == ("kN", 1e-3)
    assert display_unit("platform.position.roll", "rad", values) == ("1e-4 rad", 1e4)
    assert display_unit("platform.position.heave", "mm", values) == ("cm", pytest.approx(0.1))
    # Of another quantity than a length nothing is known: it stays as it is.
    assert display_unit("platform.position.heave", "V", values) == ("V", 1.0)
    assert display_unit("a.y", "", np.zeros(0)) == ("", 1.0)


def test_rounded_values_keep_four_figures() -> None:
    assert rounded(np.array([123456.0, -0.00012345678, np.nan])) == [123500.0, -0.0001235, None]
