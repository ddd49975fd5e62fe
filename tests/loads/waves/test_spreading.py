import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.spreading import density, spread_directions

ANGLE = np.linspace(-np.pi, np.pi, 20_001)


def moment(exponent: float, order: int) -> float:
    """E[cos k theta] of cos-2s in closed form."""
    return float(np.prod([(exponent - i) / (exponent + 1 + i) for i in range(order)]))


@pytest.mark.parametrize("exponent", [1.0, 2.5, 10.0, 75.0])
def test_density_has_unit_area_and_the_moments_in_closed_form(exponent: float) -> None:
    values = density(ANGLE, exponent)
    assert np.trapezoid(values, ANGLE) == pytest.approx(1.0, rel=1e-9)
    for order in (1, 2, 3):
        assert np.trapezoid(values * np.cos(order * ANGLE), ANGLE) == pytest.approx(moment(exponent, order), abs=1e-9)


@given(exponent=st.floats(0.5, 100.0), count=st.integers(1, 15), heading=st.floats(-7.0, 7.0))
@settings(max_examples=50, deadline=None)
def test_directional_moments_of_the_decomposition_are_exact(exponent: float, count: int, heading: float) -> None:
    parts = spread_directions(heading, exponent, count)
    angle = parts.heading - heading
    assert parts.share.sum() == pytest.approx(1.0, rel=1e-12)
    assert np.all(parts.share > 0.0)
    for order in range(1, count):
        assert parts.share @ np.cos(order * angle) == pytest.approx(moment(exponent, order), abs=1e-10)
        assert parts.share @ np.sin(order * angle) == pytest.approx(0.0, abs=1e-10)


def test_one_direction_is_long_crested() -> None:
    parts = spread_directions(0.3, 5.0, 1)
    assert parts.heading.tolist() == [0.3]
    assert parts.share.tolist() == [1.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.nan, 5.0, 3), "wave heading is nan"),
        ((0.0, 0.0, 3), r"spreading exponent of the waves is 0\.0"),
        ((0.0, np.inf, 3), "spreading exponent of the waves is inf"),
        ((0.0, 5.0, 0), "number of wave directions is 0; it must be from 1 to 32"),
        ((0.0, 5.0, 33), "number of wave directions is 33"),
    ],
)
def test_bad_input_is_refused(arguments: tuple[float, float, int], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        spread_directions(*arguments)
