"""Units in scenarios, against their definitions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from tlpsim.scenarios import quantities
from tlpsim.scenarios.quantities import Dimension, PositiveDuration

DIMENSIONS = [value for value in vars(quantities).values() if isinstance(value, Dimension)]


@pytest.mark.parametrize(
    ("dimension", "text", "value"),
    [
        ("LENGTH", "450 m", 450.0),
        ("TIME", "3 h", 10800.0),
        ("TIME", "3h", 10800.0),
        ("TIME", "10 min", 600.0),
        ("TIME", "-1.5e1 s", -15.0),
        ("SPEED", "36 km/h", 10.0),
        ("SPEED", "3600 kn", 1852.0),  # 1 kn = 1852 m / 3600 s
        ("FREQUENCY", ".2 Hz", 0.2),
        ("HEADING", "90 deg", 90.0),
        ("HEADING", f"{math.pi} rad", 180.0),
        ("ANGLE", "180 deg", math.pi),
        ("MASS", "40_500 t", 40.5e6),
        ("DENSITY", "1025 kg/m3", 1025.0),
        ("INERTIA", "82.37e6 t.m2", 82.37e9),
        ("LINEAR_DENSITY", "1.05 t/m", 1050.0),
        ("FORCE", "14 MN", 14e6),
        ("FORCE", "14 kN", 14e3),
        ("AREA", "3000 m2", 3000.0),
        ("ACCELERATION", "9.80665 m/s2", 9.80665),
        ("RATIO", "2 %", 0.02),
        ("LENGTH", " 7 ", 7.0),
    ],
)
def test_units_have_their_defined_factors(dimension: str, text: str, value: float) -> None:
    assert getattr(quantities, dimension).parse(text) == pytest.approx(value, rel=1e-15)


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(DIMENSIONS))
def test_a_bare_number_and_one_in_the_base_unit_are_the_same(value: float, dimension: Dimension) -> None:
    assert dimension.parse(value) == value
    assert dimension.parse(f"{value!r} {dimension.base_unit}") == value


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("52 knots", "'knots' is not a unit of speed"),
        ("52 KN", "did you mean 'kn'"),
        ("3 h", "'h' is not a unit of speed"),
        ("fast", "no number"),
        ("", "no number"),
        (True, "a speed is wanted"),
        ([1.0], "a speed is wanted"),
        (None, "a speed is wanted"),
        (math.nan, "finite"),
        (math.inf, "finite"),
        ("1e999 kn", "finite"),
        (10**400, "finite"),
    ],
)
def test_an_error_lists_the_accepted_units(value: object, reason: str) -> None:
    with pytest.raises(ValueError, match=reason) as caught:
        quantities.SPEED.parse(value)
    assert "'m/s', 'km/h', 'kn'" in str(caught.value)


def test_annotated_types_parse_before_their_limits_are_checked() -> None:
    adapter = TypeAdapter(PositiveDuration)
    assert adapter.validate_python("0.5 min") == 30.0
    assert adapter.validate_json("0.1") == 0.1
    with pytest.raises(ValidationError):
        adapter.validate_python("0 min")
