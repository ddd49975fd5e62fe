"""Long-term results of hand-made summaries, against direct calls of what makes them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tlpsim.scenarios.statistics.long_term import LongTermExtreme, long_term_extreme
from tlpsim.scenarios.statistics.long_term_fatigue import SNCurve, long_term_fatigue
from tlpsim.scenarios.statistics.sea_states import SeaStates
from tlpsim.scenarios.statistics.short_term import SpectralExtremes, WeibullExtremes
from tlpsim.scenarios.sweep.outlook import Group, groups, outlook
from tlpsim.scenarios.sweep.sections import LongTerm
from tlpsim.scenarios.sweep.table import SweepTable

SPECTRAL = ("mean", "std", "skewness", "excess_kurtosis", "zero_crossing_period", "bandwidth")
WEIBULL = ("location", "scale", "shape", "threshold", "share", "rate")
SURGE = "platform.position.surge"
TENDONS = tuple(f"platform.tendon_tension[{k}]" for k in (1, 2, 3))


def spectral(mean: float, std: float, ranges: float = np.nan) -> dict[str, float]:
    """Numbers of a signal of the frequency domain."""
    found = dict(zip(SPECTRAL, (mean, std, 0.2, 0.1, 12.0, 0.6), strict=True))
    return found | {"damage_equivalent_range": ranges}


def weibull(mean: float, scale: float, ranges: float = np.nan) -> dict[str, float]:
    """Numbers of a signal of a record."""
    found = {"mean": mean, "damage_equivalent_range": ranges}
    for side, factor in (("maxima", 1.0), ("minima", 0.8)):
        numbers = (mean, factor * scale, 1.7, scale, 0.4, 0.08)
        found |= {f"weibull_{side}.{name}": number for name, number in zip(WEIBULL, numbers, strict=True)}
    return found


Row = tuple[int, str, int, float, Mapping[str, Mapping[str, float]]]
"""Number of the case, domain, number of the alternative, probability, and numbers by signal and statistic."""


def table_of(rows: Sequence[Row], *, weighted: bool = True, status: Sequence[str] = (), **others: Any) -> SweepTable:
    names = dict.fromkeys(
        f"{signal}.{statistic}" for row in rows for signal, numbers in row[4].items() for statistic in numbers
    )
    columns: dict[str, np.ndarray] = {
        "case": np.array([row[0] for row in rows], dtype=np.int64),
        "name": np.array([""] * len(rows), dtype=object),
        "variant": np.array([row[2] for row in rows], dtype=np.int64),
        "probability": np.array([row[3] for row in rows]),
        "domain": np.array([row[1] for row in rows], dtype=object),
        "status": np.array(list(status) or ["done"] * len(rows), dtype=object),
        "waves.significant_height": np.array([3.0 + row[0] for row in rows]),
    }
    for name in names:
        signal, _, statistic = next(
            (each, ".", name.removeprefix(f"{each}.")) for row in rows for each in row[4] if name.startswith(f"{each}.")
        )
        columns[name] = np.array([row[4].get(signal, {}).get(statistic, np.nan) for row in rows])
    signals = dict.fromkeys(signal for row in rows for signal in row[4])
    variants = max((row[2] for row in rows), default=0) + 1
    table = SweepTable(
        title="Hand-made",
        keys=("waves.significant_height",),
        variants=tuple({"platform.draught": 30.0 + k} for k in range(variants)),
        weighted=weighted,
        units={signal: "N" if "tension" in signal else "m" for signal in signals},
        columns=columns,
        duration=3600.0,
        exposure=10800.0,
        slope=4.0,
        long_term=LongTerm(years=(1.0, 100.0), life=20.0),
        notes=(),
        planned=len(rows),
    )
    return replace(table, **others)


CALM, STORM = {SURGE: spectral(1.0, 0.5)}, {SURGE: spectral(4.0, 2.0)}
TWO: list[Row] = [(0, "frequency", 0, 0.75, CALM), (1, "frequency", 0, 0.25, STORM)]


def direct(
    mean: Sequence[float],
    std: Sequence[float],
    probability: Sequence[float],
    sign: float,
    years: tuple[float, float] = (1.0, 100.0),
) -> LongTermExtreme:
    names = tuple(str(k) for k in range(len(mean)))
    law = SpectralExtremes(
        sign=sign,
        mean=np.array(mean),
        deviation=np.array(std),
        skewness=np.full(len(mean), 0.2),
        excess_kurtosis=np.full(len(mean), 0.1),
        zero_crossing_period=np.full(len(mean), 12.0),
        bandwidth=np.full(len(mean), 0.6),
    )
    states = SeaStates(names=names, probability=np.array(probability), duration=10800.0)
    return long_term_extreme(states, law, signal=SURGE, unit="m", years=years)


def levels(found: LongTermExtreme) -> list[float]:
    return [each.level.value for each in found.returns]


def test_two_sea_states_of_the_frequency_domain() -> None:
    found = outlook(table_of(TWO))
    assert [each.sign for _, each in found.extremes] == [1.0, -1.0]
    for _, each in found.extremes:
        wanted = direct([1.0, 4.0], [0.5, 2.0], [0.75, 0.25], each.sign)
        assert levels(each) == levels(wanted)
        assert (each.signal, each.unit, each.covered) == (SURGE, "m", 1.0)
        assert each.returns[-1].contributions[0].name == "significant_height 4"
    assert found.fatigue == ()
    # All that passes such levels are storms, a quarter of the time.
    storms = direct([4.0], [2.0], [1.0], 1.0, (0.25, 25.0))
    assert levels(found.extremes[0][1]) == pytest.approx(levels(storms), rel=1e-6)


def test_without_probabilities_there_is_none() -> None:
    found = outlook(table_of(TWO, weighted=False))
    assert found.extremes == ()
    assert found.fatigue == ()


def test_records_of_a_sea_state_stand_together() -> None:
    rows: list[Row] = [
        (case, "time", 0, probability, {SURGE: weibull(mean, scale)})
        for case, probability, mean in ((3, 0.75, 1.0), (5, 0.25, 4.0))
        for scale in (1.0, 1.1, 1.2)
    ]
    found = outlook(table_of(rows))
    (group, maximum), (_, minimum) = found.extremes
    assert group.cases.tolist() == [3, 5]
    assert group.state.tolist() == [0, 0, 0, 1, 1, 1]
    scale = np.array([1.0, 1.1, 1.2] * 2)
    states = SeaStates(names=("a", "b"), probability=np.array([0.75, 0.25]), duration=10800.0)
    for each, sign, factor in ((maximum, 1.0, 1.0), (minimum, -1.0, 0.8)):
        law = WeibullExtremes(
            sign=sign,
            location=np.array([1.0] * 3 + [4.0] * 3),
            scale=factor * scale,
            shape=np.full(6, 1.7),
            threshold=scale,
            share=np.full(6, 0.4),
            rate=np.full(6, 0.08),
        )
        wanted = long_term_extreme(states, law, signal=SURGE, unit="m", state=group.state, years=(1.0, 100.0))
        assert [(each_.level.low, each_.level.value) for each_ in each.returns] == [
            (each_.level.low, each_.level.value) for each_ in wanted.returns
        ]


def test_alternatives_and_domains_stand_apart() -> None:
    rows: list[Row] = []
    for variant, factor in ((0, 1.0), (1, 3.0)):
        for case, probability, mean in ((0, 0.75, 1.0), (1, 0.25, 4.0)):
            number = 2 * case + variant  # alternatives need not be one after the other
            rows.append((number, "frequency", variant, probability, {SURGE: spectral(factor * mean, factor * 0.5)}))
            rows.append((number, "time", variant, probability, {SURGE: weibull(factor * mean, 2.0)}))
    found = outlook(table_of(rows))
    whose = [(group.variant, group.domain) for group, each in found.extremes if each.sign > 0.0]
    assert whose == [(0, "frequency"), (0, "time"), (1, "frequency"), (1, "time")]
    by = {(group.variant, group.domain): levels(each) for group, each in found.extremes if each.sign > 0.0}
    for variant, factor in ((0, 1.0), (1, 3.0)):
        wanted = direct([factor * 1.0, factor * 4.0], [factor * 0.5] * 2, [0.75, 0.25], 1.0)
        assert by[variant, "frequency"] == levels(wanted)
    assert {tuple(group.cases.tolist()) for group, _ in found.extremes} == {(0, 2), (1, 3)}


@pytest.mark.parametrize("probability", [(0.97, 0.02, 0.01), (0.2, 0.4, 0.4)])
def test_the_worst_cases_alone_have_no_outlook(probability: tuple[float, ...]) -> None:
    """Also where they are most of the sea states: those that are worst would stand for the calm ones."""
    rows: list[Row] = [(k, "frequency", 0, probability[k], CALM) for k in range(3)]
    rows += [(k, "time", 0, probability[k], {SURGE: weibull(1.0, 1.0)}) for k in (1, 2)]
    assert [group.domain for group in groups(table_of(rows))] == ["frequency"]


def test_all_cases_as_the_worst_have_an_outlook() -> None:
    rows: list[Row] = [(k, "frequency", 0, 0.5, CALM) for k in range(2)]
    rows += [(k, "time", 0, 0.5, {SURGE: weibull(1.0, 1.0)}) for k in range(2)]
    assert [group.domain for group in groups(table_of(rows))] == ["frequency", "time"]


@pytest.mark.parametrize(("probability", "there"), [((0.7, 0.3), True), ((0.4, 0.6), False)])
def test_failed_cases_are_told_and_most_must_be_there(probability: tuple[float, float], there: bool) -> None:
    rows: list[Row] = [(0, "frequency", 0, probability[0], CALM), (1, "frequency", 0, probability[1], {})]
    found = outlook(table_of(rows, status=("done", "failed")))
    assert bool(found.extremes) is there
    for _, each in found.extremes:
        assert each.covered == pytest.approx(probability[0])
        assert any("have no answer: significant_height 4" in note for note in each.notes)


def test_one_tendon_of_a_kind_is_told_for_each_side() -> None:
    numbers = {
        TENDONS[0]: spectral(10.0, 1.0, 3.0),
        TENDONS[1]: spectral(11.0, 3.0, 9.0),
        TENDONS[2]: spectral(1.0, 1.5, 4.0),
        "platform.tendon_bottom_tension[2]": spectral(4.0, 1.5, 5.0),
    }
    found = outlook(table_of([(0, "frequency", 0, 1.0, numbers)]))
    told = [(each.signal, each.sign) for _, each in found.extremes]
    assert told == [
        (TENDONS[1], 1.0),
        (TENDONS[2], -1.0),
        ("platform.tendon_bottom_tension[2]", 1.0),
        ("platform.tendon_bottom_tension[2]", -1.0),
    ]
    assert [each.signal for _, each in found.fatigue] == [TENDONS[1], "platform.tendon_bottom_tension[2]"]


def test_fatigue_of_a_life() -> None:
    rows: list[Row] = [
        (0, "frequency", 0, 0.75, {TENDONS[0]: spectral(1e7, 1e6, 1e6)}),
        (1, "frequency", 0, 0.25, {TENDONS[0]: spectral(1e7, 2e6, 5e6)}),
    ]
    settings = LongTerm(life=30.0, log10_a=12.0, area=0.2, stress_concentration=1.3)
    ((_, found),) = outlook(table_of(rows, long_term=settings)).fatigue
    states = SeaStates(names=("a", "b"), probability=np.array([0.75, 0.25]), duration=10800.0)
    curve = SNCurve(log10_a=12.0, slope=4.0)
    wanted = long_term_fatigue(
        states, [1e6, 5e6], 4.0, signal="x", unit="N", years=30.0, curve=curve, stress_factor=1e-6 * 1.3 / 0.2
    )
    assert found.damage is not None
    assert wanted.damage is not None
    assert found.range_at_1_hz.value == wanted.range_at_1_hz.value
    assert found.damage.value == pytest.approx(wanted.damage.value, rel=1e-14)
    # Miner's sum by hand: cycles at 1 Hz of the stress range in each sea state.
    cycles = 30.0 * 365.25 * 86400.0
    stress = np.array([1.0, 5.0]) * 1.3 / 0.2
    assert found.damage.value == pytest.approx(cycles * np.sum([0.75, 0.25] * stress**4) / 1e12, rel=1e-12)


def test_no_curve_no_damage_and_no_curve_for_lengths() -> None:
    rows: list[Row] = [(0, "frequency", 0, 1.0, {SURGE: spectral(1.0, 0.5, 2.0), TENDONS[0]: spectral(1e7, 1e6, 1e6)})]
    assert [each.damage for _, each in outlook(table_of(rows)).fatigue] == [None, None]
    with_curve = outlook(table_of(rows, long_term=LongTerm(log10_a=12.0, area=0.2))).fatigue
    damages = {each.signal: each.damage for _, each in with_curve}
    assert damages[SURGE] is None
    assert damages[TENDONS[0]] is not None


def test_signals_that_a_domain_lacks_are_left_out() -> None:
    rows: list[Row] = [
        (0, "frequency", 0, 1.0, {SURGE: spectral(1.0, 0.5)}),
        (0, "time", 0, 1.0, {SURGE: weibull(1.0, 0.5), "wave.elevation": weibull(0.0, 3.0)}),
    ]
    told = [(group.domain, each.signal) for group, each in outlook(table_of(rows)).extremes if each.sign > 0.0]
    assert told == [("frequency", SURGE), ("time", SURGE), ("time", "wave.elevation")]


def test_a_name_of_a_case_is_that_of_its_sea_state() -> None:
    table = table_of(TWO)
    table.columns["name"][1] = "the storm"
    (group,) = groups(table)
    assert isinstance(group, Group)
    assert group.states.names == ("significant_height 3", "the storm")
    assert group.states.duration == 10800.0


def test_a_signal_of_sea_states_that_never_come_is_left_out() -> None:
    never = {SURGE: spectral(4.0, 2.0), "platform.position.sway": spectral(1.0, 1.0, 1.0)}
    found = outlook(table_of([(0, "frequency", 0, 1.0, CALM), (1, "frequency", 0, 0.0, never)]))
    assert {each.signal for _, each in found.extremes} == {SURGE}
    assert found.fatigue == ()
    assert levels(found.extremes[0][1]) == levels(direct([1.0], [0.5], [1.0], 1.0))
