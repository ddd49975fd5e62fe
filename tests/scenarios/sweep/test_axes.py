"""Rows of each kind of axis: values, probabilities, strata of a Latin hypercube, and damaged scatter diagrams."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.sweep.axes import Axis, axes, combinations, followed, read_scatter
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.sections import Linked, SweepFile

SPEED, HEIGHT, PERIOD = ("wind", "speed"), ("waves", "significant_height"), ("waves", "peak_period")


def axes_of(**content: object) -> tuple[Axis, ...]:
    return axes(SweepFile.read(content, "sweep.toml"), Path("sweep.toml"))


def column(axis: Axis, key: tuple[str, ...]) -> np.ndarray:
    return np.array([row.settings[key] for row in axis.rows])


# Grid and combinations


def test_range_has_both_ends_and_equal_steps() -> None:
    (axis,) = axes_of(grid={"wind.speed": {"from": 10, "to": 30, "count": 5}})
    assert [row.settings for row in axis.rows] == [{SPEED: value} for value in (10.0, 15.0, 20.0, 25.0, 30.0)]
    assert not axis.weighted


def test_range_may_fall() -> None:
    (axis,) = axes_of(grid={"wind.speed": {"from": 3, "to": 1, "count": 3}})
    assert column(axis, SPEED).tolist() == [3.0, 2.0, 1.0]


def test_the_last_axis_varies_fastest() -> None:
    found = axes_of(grid={"wind.speed": [1, 2], "current.speed": [3, 4, 5]})
    pairs = [(first.settings[SPEED], second.settings["current", "speed"]) for first, second in combinations(found)]
    assert pairs == [(1, 3), (1, 4), (1, 5), (2, 3), (2, 4), (2, 5)]


def test_values_with_probabilities_are_environments() -> None:
    (axis,) = axes_of(grid={"wind.speed": {"values": [1, 2], "probability": [0.25, 0.5]}})
    assert axis.weighted
    assert [row.probability for row in axis.rows] == [0.25, 0.5]


def test_list_has_the_keys_of_all_its_cases() -> None:
    (axis,) = axes_of(cases=[{"name": "a", "wind": {"speed": 1}}, {"current": {"speed": 2}}])
    assert axis.keys == (SPEED, ("current", "speed"))
    assert [(row.name, dict(row.settings)) for row in axis.rows] == [
        ("a", {SPEED: 1}),
        ("", {("current", "speed"): 2}),
    ]


@pytest.mark.parametrize("key", ["simulation.seed", "wind.seed", "waves.seed"])
@pytest.mark.parametrize("kind", ["grid", "cases", "linked", "latin_hypercube", "scatter"])
def test_seeds_stand_on_no_axis(key: str, kind: str) -> None:
    table = {"heights": [1], "periods": [5], "occurrences": [[1]]}
    content = {
        "grid": {key: [1, 2]},
        "cases": [{key: 1}],
        "linked": {key: {"by": "wind.speed"}},
        "latin_hypercube": {"samples": 2, "keys": {key: [1, 2]}},
        "scatter": table | {"height_key": key},
    }
    with pytest.raises(ScenarioError, match=rf"^sweep.toml: '{key}' cannot vary: .*\[replicates\]"):
        axes_of(**{kind: content[kind]})


@pytest.mark.parametrize("kind", ["scatter", "cases", "linked", "latin_hypercube"])
def test_a_key_stands_on_one_axis(kind: str) -> None:
    key = "waves.significant_height"
    content = {
        "cases": [{key: 1}],
        "linked": {key: {"by": "wind.speed"}},
        "latin_hypercube": {"samples": 2, "keys": {key: [1, 2]}},
        "scatter": {"heights": [1], "periods": [5], "occurrences": [[1]]},
    }
    with pytest.raises(ScenarioError, match=rf"^sweep.toml: '{key}' varies in two places: leave it in one of scatter"):
        axes_of(grid={key: [1]}, **{kind: content[kind]})


# Latin hypercube


SPREADS = {"wind.speed": {"from": -3, "to": 5}, "current.speed": {"mean": 2, "std": 0.5}}


@settings(max_examples=25, deadline=None)
@given(samples=st.integers(1, 300), seed=st.integers(0, 2**40))
def test_each_stratum_has_one_sample(samples: int, seed: int) -> None:
    (axis,) = axes_of(latin_hypercube={"samples": samples, "seed": seed, "keys": SPREADS})
    levels = (column(axis, SPEED) + 3.0) / 8.0, norm.cdf(column(axis, ("current", "speed")), 2.0, 0.5)
    for level in levels:
        assert sorted(np.floor(level * samples).astype(int)) == list(range(samples))
    assert [row.probability for row in axis.rows] == [1.0 / samples] * samples
    assert axis.weighted


def test_moments_of_samples() -> None:
    # With one sample in each of n strata a mean errs by some n^-3/2: 1e-4 of the width for 400.
    (axis,) = axes_of(latin_hypercube={"samples": 400, "keys": SPREADS})
    speed, current = column(axis, SPEED), column(axis, ("current", "speed"))
    assert np.mean(speed) == pytest.approx(1.0, abs=8.0 * 4e-4)
    assert np.std(speed) == pytest.approx(8.0 / np.sqrt(12.0), rel=2e-3)
    assert np.mean(current) == pytest.approx(2.0, abs=0.5 * 5e-3)
    assert np.std(current) == pytest.approx(0.5, rel=0.02)
    # Keys are paired at random: the correlation of n pairs has a standard deviation of n^-1/2 = 0.05.
    assert abs(np.corrcoef(speed, current)[0, 1]) < 0.2


def test_samples_are_of_the_seed_alone() -> None:
    given_ = {"samples": 20, "seed": 3, "keys": SPREADS}
    assert axes_of(latin_hypercube=given_) == axes_of(latin_hypercube=given_)
    assert axes_of(latin_hypercube=given_) != axes_of(latin_hypercube=given_ | {"seed": 4})
    (alone,) = axes_of(latin_hypercube=given_ | {"keys": {"wind.speed": SPREADS["wind.speed"]}})
    (both,) = axes_of(latin_hypercube=given_)
    assert column(alone, SPEED).tolist() == column(both, SPEED).tolist()


def test_alternatives_come_as_often_as_their_probabilities_say() -> None:
    keys = {"wind.profile": {"values": ["api", "iso"], "probability": [0.3, 0.7]}, "waves.splash": [True, False]}
    (axis,) = axes_of(latin_hypercube={"samples": 40, "keys": keys})
    assert len(axis.rows) == 4  # samples that are the same are one row
    chosen = {"api": 0.0, "iso": 0.0, True: 0.0, False: 0.0}
    for row in axis.rows:
        for value in row.settings.values():
            chosen[value] += row.probability or 0.0
    assert chosen == pytest.approx({"api": 0.3, "iso": 0.7, True: 0.5, False: 0.5})


# Scatter

CELLS = [[1, 0, 3], [0, 4, 2]]
TABLE = {"heights": [1, 2], "periods": [5, 6, 7], "occurrences": CELLS}


def test_scatter_has_a_row_for_each_cell_that_occurs() -> None:
    (axis,) = axes_of(scatter=TABLE)
    found = [(row.settings[HEIGHT], row.settings[PERIOD], row.probability) for row in axis.rows]
    assert found == [(1.0, 5.0, 0.1), (1.0, 7.0, 0.3), (2.0, 6.0, 0.4), (2.0, 7.0, 0.2)]
    assert axis.keys == (HEIGHT, PERIOD)
    assert axis.notes == ()


@settings(max_examples=50)
@given(st.lists(st.lists(st.floats(0, 1e6), min_size=3, max_size=3), min_size=1, max_size=6))
def test_probabilities_sum_to_one(cells: list[list[float]]) -> None:
    table = {"heights": list(range(len(cells))), "periods": [5, 6, 7], "occurrences": cells}
    if not sum(map(sum, cells)) > 1e-300:
        return
    (axis,) = axes_of(scatter=table)
    assert sum(row.probability or 0.0 for row in axis.rows) == pytest.approx(1.0, abs=1e-12)


def test_scatter_with_a_factor_and_keys_of_its_own() -> None:
    (axis,) = axes_of(
        scatter=TABLE | {"period_factor": 1.408, "period_key": "current.speed", "height_key": "wind.speed"}
    )
    assert axis.keys == (SPEED, ("current", "speed"))
    assert axis.rows[1].settings == {SPEED: 1.0, ("current", "speed"): 7.0 * 1.408}


def test_total_leaves_room_for_other_sea_states() -> None:
    (axis,) = axes_of(scatter=TABLE | {"total": 20})
    assert [row.probability for row in axis.rows] == [0.05, 0.15, 0.2, 0.1]
    assert axis.notes == ("scatter: sea states with a probability of 0.5 are not in it",)


def test_rare_cells_are_left_out_and_told() -> None:
    (axis,) = axes_of(scatter=TABLE | {"least_probability": 0.2})
    assert [row.probability for row in axis.rows] == [0.3, 0.4, 0.2]
    assert axis.notes[0] == "scatter: 1 cells below 0.2 are left out"
    assert "probability of 0.1" in axis.notes[1]


def test_scatter_file_equals_lists(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("# remark\n\nHs\\Tp,5,6,7\n1,1,,3\n  # another\n2,0, 4 ,2\n", encoding="utf-8")
    assert read_scatter(tmp_path / "s.csv") == ((1.0, 2.0), (5.0, 6.0, 7.0), ((1.0, 0.0, 3.0), (0.0, 4.0, 2.0)))
    from_file = axes(SweepFile.read({"scatter": {"file": "s.csv"}}, "s"), tmp_path / "sweep.toml")
    assert from_file == axes_of(scatter=TABLE)


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffh,5,6\n1,1,2\n",
        "\ufeff# Hs\nh,5,6\n1,1,2\n",
        "h,5,6\r\n1,1,2\r\n",
        "h,5,6,\n1,1,2,\n",
        "h,5,6\n1,1,2\n,,\n",
    ],
)
def test_tables_of_other_programs(text: str, tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_bytes(text.encode())
    (axis,) = axes(SweepFile.read({"scatter": {"file": "s.csv"}}, "s"), tmp_path / "sweep.toml")
    assert [(*row.settings.values(), row.probability) for row in axis.rows] == [(1.0, 5.0, 1 / 3), (1.0, 6.0, 2 / 3)]


DAMAGED = {
    "empty": (b"", "holds no scatter diagram: the first row has the periods"),
    "remarks alone": (b"# Hs\n# Tp\n", "holds no scatter diagram"),
    "one row": (b"h,5,6\n", "holds no scatter diagram"),
    "one column": (b"h\n1\n2\n", "holds no scatter diagram"),
    "semicolons": (b"h;5\n1;2\n", "holds no scatter diagram"),
    "text in a cell": (b"# x\nh,5\n1,a\n", "line 3: could not convert string to float: 'a'; give numbers"),
    "text in the first row": (b"h,Tp\n1,2\n", "line 1: could not convert string to float: 'Tp'"),
    "text in the first column": (b"h,5\nHs 1,2\n", "line 2: could not convert string to float: 'Hs 1'"),
    "short row": (b"h,5,6\n1,1,1\n2,1\n", "line 3: has 1 cells, and there are 2 periods in line 1"),
    "long row": (b"h,5\n1,1,1\n", "line 2: has 2 cells, and there are 1 periods in line 1"),
    "negative": (b"h,5\n1,-1\n", "line 2: occurrences must be finite numbers that are 0 or more"),
    "nan": (b"h,5\n1,nan\n", "line 2: occurrences must be finite"),
    "infinite": (b"h,5\n1,inf\n", "line 2: occurrences must be finite"),
    "no height": (b"h,5\n1,1\n,2\n", "line 3: has occurrences at the height nan and the period 5"),
    "no period": (b"h,5,\n1,2,3\n", "line 2: has occurrences at the height 1 and the period nan"),
    "infinite height": (b"h,5\ninf,2\n", "line 2: has occurrences at the height inf"),
    "not UTF-8": (b"h,5\n1,\xff\n", "cannot be read: not a text file in UTF-8"),
    "one enormous cell": (b"h,5\n1," + b"1" * 200_000, "holds no scatter diagram"),
}


@pytest.mark.parametrize(("content", "wanted"), DAMAGED.values(), ids=DAMAGED)
def test_damaged_scatter_files(content: bytes, wanted: str, tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_bytes(content)
    with pytest.raises(ScenarioError) as refused:
        read_scatter(tmp_path / "s.csv")
    assert str(refused.value).startswith(str(tmp_path / "s.csv"))
    assert wanted in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("name", "reason"), [("none.csv", "No such file"), (".", "Is a directory")])
def test_no_scatter_file(name: str, reason: str, sweep_of: Callable[..., Sweep]) -> None:
    with pytest.raises(ScenarioError, match=f"the scatter diagram cannot be read: {reason}"):
        sweep_of(f'[scatter]\nfile = "{name}"')


# Linked


@pytest.mark.parametrize(
    ("leader", "wanted"), [(0.0, 10.0), (1, 10.0), (1.5, 15.0), (2.0, 20.0), (3.0, 40.0), (9, 40.0)]
)
def test_linked_is_linear_between_points_and_constant_beyond(leader: float, wanted: float) -> None:
    linked = Linked(by="a", at=(1.0, 2.0, 3.0), value=(10.0, 20.0, 40.0))
    assert followed(linked, leader, "b") == wanted
    assert followed(linked.model_copy(update={"plus": -3.0}), leader, "b") == wanted - 3.0


def test_linked_without_points_is_the_other_key() -> None:
    assert followed(Linked(by="a", plus=2.5), 4, "b") == 6.5


@pytest.mark.parametrize(
    ("leader", "told"), [("jonswap", "'jonswap'"), (True, "True"), ([1.0], "[1.0]"), (None, "no value")]
)
def test_linked_follows_numbers(leader: object, told: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        followed(Linked(by="waves.spectrum"), leader, "wind.speed")
    assert "wind.speed follows waves.spectrum" in str(refused.value)
    assert told in str(refused.value)


@pytest.mark.parametrize("order", [("wind.speed", "current.speed"), ("current.speed",)])
def test_linked_follows_what_stands_before(order: tuple[str, ...]) -> None:
    """A chain of followers is worked out in its order, so that one in the wrong order would follow a stale value."""
    linked = {key: {"by": "current.speed"} for key in order}
    with pytest.raises(ScenarioError, match=r"'current.speed', which is linked too and does not stand before it"):
        axes_of(linked=linked)
    assert axes_of(linked={"wind.speed": {"by": "waves.peak_period"}, "current.speed": {"by": "wind.speed"}}) == ()
