"""Fatigue of a life against closed forms, a life counted cycle by cycle, and simulated intervals."""

import math
from typing import Any

import numpy as np
import pytest
import rainflow
from scipy import integrate, stats

from tlpsim.loads.spectral.fatigue import damage_equivalent_range
from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.long_term_fatigue import LongTermFatigue, SNCurve, long_term_fatigue
from tlpsim.scenarios.statistics.sea_states import YEAR, SeaStates

CURVE = SNCurve(log10_a=12.164, slope=3.0, name="D in air")


def sea(probability: Any) -> SeaStates:
    p = np.asarray(probability, dtype=np.float64)
    return SeaStates(names=tuple(f"cell {k}" for k in range(len(p))), probability=p)


def fatigue(probability: Any, ranges: Any, slope: float = 3.0, **changed: Any) -> LongTermFatigue:
    return long_term_fatigue(sea(probability), ranges, slope, signal="tendon 1", unit="N", **changed)


def test_a_life_of_two_sea_states_by_hand() -> None:
    """Cycles of 30 MPa at 1 Hz in 80 %, of 60 MPa in 20 % of 25 years."""
    result = fatigue([0.8, 0.2], [30e6, 60e6], years=25.0, curve=CURVE, equivalent_cycles=2e6)
    seconds = 25.0 * 365.25 * 86400.0
    damage = seconds * (
        0.8 / 10.0 ** (12.164 - 3.0 * math.log10(30.0)) + 0.2 / 10.0 ** (12.164 - 3.0 * math.log10(60.0))
    )
    assert result.damage is not None
    assert result.damage.value == pytest.approx(damage, rel=1e-9)
    assert result.life == pytest.approx(25.0 / damage, rel=1e-9)
    assert result.range_at_1_hz.value == pytest.approx((0.8 * 30e6**3 + 0.2 * 60e6**3) ** (1.0 / 3.0), rel=1e-9)
    # As many cycles of one range do the same damage.
    same = 2e6 / 10.0 ** (12.164 - 3.0 * math.log10(result.range_of_cycles.value / 1e6))
    assert same == pytest.approx(damage, rel=1e-9)
    assert [(part.name, round(part.share, 9)) for part in result.contributions] == [
        ("cell 1", round(1.6 / 2.4, 9)),
        ("cell 0", round(0.8 / 2.4, 9)),
    ]
    assert math.isnan(result.damage.low)
    assert "most by cell 1 with 67%" in result.lines[0]
    assert "damage" in result.lines[1]


def test_a_tension_becomes_a_stress_by_the_area_of_the_tendon() -> None:
    """The same of a tension in MN by its own factor, and of one in N: 0.2 m² and a concentration of 1.3."""
    newton = fatigue([1.0], [4e6], curve=CURVE, stress_factor=1.3e-6 / 0.2)
    mega = fatigue([1.0], [4.0], curve=CURVE, stress_factor=1.3 / 0.2)
    stress = fatigue([1.0], [26e6], curve=CURVE)  # Pa
    assert newton.damage is not None
    assert mega.damage is not None
    assert stress.damage is not None
    assert newton.damage.value == pytest.approx(stress.damage.value, rel=1e-12)
    assert mega.damage.value == pytest.approx(stress.damage.value, rel=1e-12)


def test_weibull_heights_with_ranges_of_rayleigh() -> None:
    """Ranges of narrow-banded waves over a Weibull distribution of Hs: E[Hs^m] = scale^m Gamma(1 + m / shape)."""
    heights, slope, rate = stats.weibull_min(1.4, scale=2.5), 4.0, 0.1
    edges = np.linspace(0.0, 25.0, 1001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    p = np.diff(heights.cdf(edges))
    of_height = (rate * 2.0 ** (-0.5 * slope) * math.gamma(1.0 + 0.5 * slope)) ** (1.0 / slope)  # of crest to trough
    life = (
        rate * 2.0 ** (-0.5 * slope) * math.gamma(1.0 + 0.5 * slope) * 2.5**slope * math.gamma(1.0 + slope / 1.4)
    ) ** (1.0 / slope)
    assert fatigue(p / p.sum(), of_height * middle, slope).range_at_1_hz.value == pytest.approx(life, rel=1e-3)
    by_integral = integrate.quad(lambda h: float(heights.pdf(h)) * h**slope, 0.0, 60.0)[0] ** (1.0 / slope)
    assert of_height * by_integral == pytest.approx(life, rel=1e-6)


def test_a_life_that_is_counted_in_one_record() -> None:
    """Records of three sea states one after the other, each as long as it is likely: rainflow counts of the whole,
    whose few cycles from one sea state to the next do not matter, and Dirlik's ranges of each within his 3 %."""
    generator = np.random.Generator(np.random.Philox(9))
    frequency, step, slope = np.linspace(0.0, 0.3, 601), 0.2, 4.0
    p, heights, whole, ranges = np.array([0.5, 0.3, 0.2]), (1.0, 2.0, 3.5), [], []
    for part, height in zip(p, heights, strict=True):
        density = height**2 * np.exp(-0.5 * ((frequency - 0.09) / 0.02) ** 2)
        ranges.append(damage_equivalent_range(frequency, density, slope))
        count = int(part * 500_000)
        lines = np.fft.rfftfreq(count, step)
        amplitude = np.sqrt(np.interp(lines, frequency, density, right=0.0) / (count * step))
        whole.append(
            np.fft.irfft((generator.standard_normal((len(lines), 2)) @ [1.0, 1j]) * amplitude * count / 2.0, n=count)
        )
    record = np.concatenate(whole)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(record)))) + 1
    cycles = np.array([(size, number) for size, _, number, _, _ in rainflow.extract_cycles(record[turns].tolist())])
    counted = (cycles[:, 1] @ cycles[:, 0] ** slope / (len(record) * step)) ** (1.0 / slope)
    assert fatigue(p, ranges, slope).range_at_1_hz.value == pytest.approx(counted, rel=0.03)


def test_scale_and_years() -> None:
    """Ranges of 1e7 N to the power of 15 are no trouble; damage goes with the power, and with the years."""
    generator = np.random.Generator(np.random.Philox(1))
    p, ranges = generator.dirichlet(np.ones(20)), generator.random(20)
    for slope in (1.0, 5.0, 15.0):
        curve = SNCurve(log10_a=16.0, slope=slope)
        unit = fatigue(p, ranges, slope, curve=curve, stress_factor=1.0)
        large = fatigue(p, 1e7 * ranges, slope, curve=curve, stress_factor=1e-6, years=40.0)
        assert large.range_at_1_hz.value == pytest.approx(1e7 * unit.range_at_1_hz.value, rel=1e-9)
        assert unit.damage is not None
        assert large.damage is not None
        assert large.damage.value == pytest.approx(2.0 * 10.0**slope * unit.damage.value, rel=1e-9)
        assert large.range_of_cycles.value == pytest.approx(
            1e7 * 2.0 ** (1.0 / slope) * unit.range_of_cycles.value, rel=1e-9
        )
        assert sum(part.share for part in large.contributions) == pytest.approx(1.0, abs=2e-3)
    assert unit.range_of_cycles.value == pytest.approx(unit.range_at_1_hz.value * (20.0 * YEAR / 1e7) ** (1.0 / 15.0))


def test_intervals_hold_the_truth() -> None:
    """Damage of records scattered by 10 to 30 %, three of each of six sea states: 95 % of 400 within four errors."""
    generator = np.random.Generator(np.random.Philox(2))
    p, spread, slope = np.array([0.4, 0.3, 0.15, 0.1, 0.04, 0.01]), np.linspace(0.1, 0.3, 6), 4.0
    state, truth = np.repeat(np.arange(6), 3), 10.0 * np.arange(1.0, 7.0)
    life = (p @ truth**slope) ** (1.0 / slope)
    held = 0
    for _ in range(400):
        damage = truth[state] ** slope * (1.0 + spread[state] * generator.standard_normal(18))
        each = fatigue(p, damage ** (1.0 / slope), slope, state=state).range_at_1_hz
        held += each.low <= life <= each.high
    assert held / 400 == pytest.approx(0.95, abs=4.0 * math.sqrt(0.05 * 0.95 / 400))


def test_what_is_missing_is_told() -> None:
    result = fatigue([0.5, 0.3, 0.2], [10.0, math.nan, 20.0])
    assert result.covered == pytest.approx(0.7)
    assert result.without_answer == ("cell 1",)
    assert "of the probability 0.3, have no answer: cell 1" in result.notes[0]
    assert result.range_at_1_hz.value == pytest.approx(((0.5 * 1e3 + 0.2 * 8e3) / 0.7) ** (1.0 / 3.0))
    nothing = fatigue([0.5, 0.3, 0.2], [10.0, math.nan, 20.0], renormalise=False)
    assert nothing.range_at_1_hz.value == pytest.approx((0.5 * 1e3 + 0.2 * 8e3) ** (1.0 / 3.0))
    alone = fatigue([0.5, 0.5], [10.0, 11.0, 20.0], state=[0, 0, 1])
    assert math.isnan(alone.range_at_1_hz.low)
    assert "one record each" in alone.notes[-1]


def test_a_tendon_that_is_lost_has_no_damage() -> None:
    result = fatigue([0.5, 0.5], [0.0, 0.0], curve=CURVE)
    assert result.damage is not None
    assert (result.range_at_1_hz.value, result.damage.value, result.life) == (0.0, 0.0, math.inf)
    assert result.contributions == ()
    assert len(result.lines) == 2


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ResultsError, match=r"ranges are of the slope 4 and the S-N curve D in air of 3"):
        fatigue([1.0], [1.0], 4.0, curve=CURVE)
    with pytest.raises(ResultsError, match="a range is -1 N"):
        fatigue([1.0], [-1.0])
    with pytest.raises(ResultsError, match="no sea state has an answer"):
        fatigue([1.0], [math.nan])
    for name in ("years", "equivalent_cycles", "stress_factor"):
        with pytest.raises(ResultsError, match=f"{name} is 0"):
            fatigue([1.0], [1.0], **{name: 0.0})
    with pytest.raises(ResultsError, match="slope is nan"):
        fatigue([1.0], [1.0], math.nan)
