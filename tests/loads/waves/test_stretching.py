import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.stretching import STRETCHING, stretched

HEIGHT = np.array([-30.0, -2.0, 0.0, 1.5, 4.0])
CREST = np.full(5, 3.0)


def test_wheeler_keeps_surface_and_bottom_and_is_linear_between() -> None:
    levels = stretched("wheeler", HEIGHT, CREST, 30.0)
    np.testing.assert_allclose(levels.level, [-30.0, 30.0 * -5.0 / 33.0, 30.0 * -3.0 / 33.0, 30.0 * -1.5 / 33.0, 0.0])
    assert levels.wet.tolist() == [True, True, True, True, False]
    trough = stretched("wheeler", np.array([-3.0, -2.9]), np.full(2, -3.0), 30.0)
    assert trough.level[0] == 0.0
    assert trough.wet.tolist() == [True, False]


def test_wheeler_in_deep_water_shifts_the_profile() -> None:
    np.testing.assert_allclose(stretched("wheeler", HEIGHT, CREST, np.inf).level, [-33.0, -5.0, -3.0, -1.5, 0.0])
    # The limit of finite depth.
    np.testing.assert_allclose(stretched("wheeler", HEIGHT[1:4], CREST[1:4], 1e9).level, [-5.0, -3.0, -1.5], atol=1e-6)


def test_linear_and_vertical_leave_the_water_below_alone() -> None:
    for name in ("linear", "vertical"):
        levels = stretched(name, HEIGHT, CREST, 30.0)
        np.testing.assert_array_equal(levels.level, np.minimum(HEIGHT, 0.0))
        assert levels.wet.tolist() == [True, True, True, True, False]
    np.testing.assert_array_equal(stretched("linear", HEIGHT, CREST, 30.0).excess, np.maximum(HEIGHT, 0.0))
    assert not np.any(stretched("vertical", HEIGHT, CREST, 30.0).excess)


def test_none_ends_at_mean_water_level() -> None:
    assert stretched("none", HEIGHT, CREST, 30.0).wet.tolist() == [True, True, True, False, False]


@pytest.mark.parametrize("name", STRETCHING)
def test_all_agree_in_still_water(name: str) -> None:
    levels = stretched(name, HEIGHT, np.zeros(5), 30.0)
    np.testing.assert_allclose(levels.level[levels.wet], HEIGHT[levels.wet])
    assert levels.wet.tolist() == [True, True, True, False, False]


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="stretching 'wheler' is not known; did you mean 'wheeler'"):
        stretched("wheler", HEIGHT, CREST, 30.0)
    with pytest.raises(ScenarioError, match=r"z = -30\.0 m, below the sea bed at -20\.0 m"):
        stretched("none", HEIGHT, CREST, 20.0)
    with pytest.raises(ScenarioError, match=r"trough of -30\.0 m reaches the sea bed"):
        stretched("wheeler", HEIGHT, -10.0 * CREST, 30.0)
