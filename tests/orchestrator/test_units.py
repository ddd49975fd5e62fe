"""Units: spellings, conversion, dimensions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.orchestrator.instance import Unit
from tlpsim.orchestrator.units import BASE_UNITS, dimension, spelled, unit_conversion

# text, factor, exponents that are not zero
SPELLINGS = [
    ("N", 1.0, {"kg": 1, "m": 1, "s": -2}),
    ("kN", 1e3, {"kg": 1, "m": 1, "s": -2}),
    ("MN.m", 1e6, {"kg": 1, "m": 2, "s": -2}),
    ("kN*m", 1e3, {"kg": 1, "m": 2, "s": -2}),
    ("N m", 1.0, {"kg": 1, "m": 2, "s": -2}),
    ("N·m", 1.0, {"kg": 1, "m": 2, "s": -2}),
    ("kg.m2/s2", 1.0, {"kg": 1, "m": 2, "s": -2}),
    ("kg.m^2.s^-2", 1.0, {"kg": 1, "m": 2, "s": -2}),
    ("kg.m**2.s**(-2)", 1.0, {"kg": 1, "m": 2, "s": -2}),
    ("m/s²", 1.0, {"m": 1, "s": -2}),
    ("m/s/s", 1.0, {"m": 1, "s": -2}),
    ("N/(m.s)", 1.0, {"kg": 1, "s": -3}),
    ("N/(m s2)", 1.0, {"kg": 1, "s": -4}),
    ("1/s", 1.0, {"s": -1}),
    ("rad/s", 1.0, {"rad": 1, "s": -1}),
    ("deg/s", math.pi / 180.0, {"rad": 1, "s": -1}),
    ("rpm", math.pi / 30.0, {"rad": 1, "s": -1}),
    ("Hz", 1.0, {"s": -1}),
    ("mm", 1e-3, {"m": 1}),
    ("cm3", 1e-6, {"m": 3}),
    ("km/h", 1.0 / 3.6, {"m": 1, "s": -1}),
    ("t", 1e3, {"kg": 1}),
    ("mg", 1e-6, {"kg": 1}),
    ("min", 60.0, {"s": 1}),
    ("cd", 1.0, {"cd": 1}),
    ("GPa", 1e9, {"kg": 1, "m": -1, "s": -2}),
    ("kW.h", 3.6e6, {"kg": 1, "m": 2, "s": -2}),
    ("%", 0.01, {}),
    ("1", 1.0, {}),
]


@pytest.mark.parametrize(("text", "factor", "exponents"), SPELLINGS, ids=[each[0] for each in SPELLINGS])
def test_spelled(text: str, factor: float, exponents: dict[str, int]) -> None:
    unit = spelled(text)
    assert unit is not None
    assert unit.factor == pytest.approx(factor, rel=1e-14)
    assert unit.exponents == tuple(exponents.get(name, 0) for name in BASE_UNITS)
    assert unit.offset == 0.0


@pytest.mark.parametrize("text", ["", "furlong", "N/", "/s", "(N", "N)", "m/s.kg", "m..s", "N.-2", "5", "m^", "kg2.5"])
def test_what_is_no_unit_or_can_be_read_two_ways_is_not_known(text: str) -> None:
    assert spelled(text) is None


def test_temperatures_have_an_offset_alone_and_are_differences_in_a_product() -> None:
    assert unit_conversion("degC", "K", {}, {}) == (1.0, 273.15)
    assert unit_conversion("K", "degC", {}, {}) == (1.0, -273.15)
    assert unit_conversion("W/degC", "W/K", {}, {}) == (1.0, 0.0)


def test_definitions_of_a_component_go_before_the_spelling() -> None:
    long_ton = Unit(exponents=(1, 0, 0, 0, 0, 0, 0, 0), factor=1016.0469088)
    assert unit_conversion("t", "kg", {"t": long_ton}, {}) == (1016.0469088, 0.0)
    assert unit_conversion("t", "t", {"t": long_ton}, {}) == (1.0160469088, 0.0)
    fathom = Unit(exponents=(0, 1, 0, 0, 0, 0, 0, 0), factor=1.8288)
    assert unit_conversion("m", "fathom", {}, {"fathom": fathom}) == (1.0 / 1.8288, 0.0)


def test_equal_spelling_is_enough_where_nothing_is_defined() -> None:
    assert unit_conversion("furlong", "furlong", {}, {}) == (1.0, 0.0)
    assert unit_conversion("fur*m", "fur.m", {}, {}) == (1.0, 0.0)
    with pytest.raises(ValueError, match="what furlong is, is not defined"):
        unit_conversion("furlong", "m", {}, {})


@pytest.mark.parametrize(("source", "target"), [(None, "N"), ("N", None), ("1", "rad"), ("-", "m"), ("", "m")])
def test_what_has_no_unit_is_not_converted(source: str | None, target: str | None) -> None:
    assert unit_conversion(source, target, {}, {}) == (1.0, 0.0)


def test_ratios_are_converted() -> None:
    assert unit_conversion("%", "1", {}, {}) == (0.01, 0.0)


def test_different_dimensions_are_told_with_both() -> None:
    with pytest.raises(ValueError, match=r"^Hz is of the dimension s-1 and rad/s of s-1\.rad$"):
        unit_conversion("Hz", "rad/s", {}, {})


def test_dimension() -> None:
    assert dimension(Unit()) == "1"
    assert dimension(Unit(exponents=(1, 2, -2, 0, 0, 0, 0, 0))) == "kg.m2.s-2"


@given(
    st.sampled_from([each[0] for each in SPELLINGS]),
    st.floats(1e-6, 1e6),
    st.floats(-1e3, 1e3),
    st.floats(-1e6, 1e6),
)
def test_there_and_back_is_the_identity(text: str, factor: float, offset: float, value: float) -> None:
    unit = spelled(text)
    assert unit is not None
    own = {"own": Unit(exponents=unit.exponents, factor=factor, offset=offset)}
    gain, constant = unit_conversion(text, "own", {}, own)
    back, constant_back = unit_conversion("own", text, own, {})
    again = back * (gain * value + constant) + constant_back
    scale = max(abs(value), abs(offset / unit.factor), 1.0)
    assert again == pytest.approx(value, rel=1e-9, abs=1e-9 * scale)
