"""The comparison of the domains, against Gaussian records of known spectra and against results files."""

import dataclasses
import json
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.image import imread

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios import compare as module
from tlpsim.scenarios.compare import (
    Comparison,
    Times,
    combined,
    compare,
    comparison_json,
    read_comparison,
    write_comparison,
)
from tlpsim.scenarios.compare_figures import (
    CONTRIBUTIONS,
    SPECTRA,
    SURGE,
    confidence_band,
    contributions_figure,
    draw_comparison,
    spectra_figure,
)
from tlpsim.scenarios.compare_tables import print_comparison
from tlpsim.scenarios.parallel import in_parallel
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.bands import band_statistics
from tlpsim.scenarios.time_domain import (
    STATISTICS,
    Case,
    RecordStatistics,
    _evaluated,
    record,
    records,
    seeded,
    spectra,
)

Maker = Callable[..., SpectralResponse]
DURATION, STEP = 10800.0, 0.5
DEGREES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def gaussian(response: SpectralResponse, names: Sequence[str], rng: np.random.Generator) -> np.ndarray:
    """A record of the given spectra with random amplitudes and phases, (samples, quantities)."""
    count = round(DURATION / STEP) + 1
    frequency = np.fft.rfftfreq(count, STEP)
    columns = []
    for name in names:
        quantity = response.quantities[name]
        density = np.interp(frequency, quantity.frequency, quantity.density)
        parts = rng.standard_normal((2, len(frequency)))
        lines = 0.5 * count * np.sqrt(density * frequency[1]) * (parts[0] + 1j * parts[1])
        lines[0] = count * quantity.mean
        columns.append(np.fft.irfft(lines, count))
    return np.column_stack(columns)


@pytest.fixture(scope="module")
def made(fake_response: Maker) -> Comparison:
    """A comparison of records that do have the spectra of the frequency domain."""
    response = fake_response(skewness=0.0)
    rng = np.random.default_rng(7)

    def gaussian_records(scenario: Scenario, count: int, names: Sequence[str], *_: object, **__: object) -> list:
        seeds = [seeded(scenario, k).seeds() for k in range(count)]
        return [_evaluated(gaussian(response, names, rng), STEP, each, 0.0) for each in seeds]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tlpsim.scenarios.spectral.spectral_response", lambda scenario: response)
        patch.setattr(module, "records", gaussian_records)
        patch.setattr(module, "require_records", lambda scenario, cosimulation: None)
        return compare(Scenario(title="Gaussian").with_(simulation={"duration": DURATION}), 24, workers=2)


def test_domains_of_one_spectrum_agree_within_their_errors(made: Comparison) -> None:
    rows = made.by_name()
    assert len(rows) == 11 * len(STATISTICS)
    # Means and spreads of 11 quantities, of which all are independent: 44 errors of one standard error each.
    score = np.array(
        [
            (row.frequency - row.time) / row.error
            for row in made.rows
            if row.statistic in ("low_frequency", "wave_frequency", "std") and row.error > 0.0
        ]
    )
    assert len(score) == 33
    assert np.abs(score).max() < 4.0  # of Student's distribution with 23 degrees of freedom
    assert 0.5 < np.sqrt(np.mean(score**2)) < 1.5
    for row in made.rows:
        if row.statistic in ("std", "low_frequency", "wave_frequency"):
            assert row.ratio == pytest.approx(row.frequency / row.time)


def test_mean_of_maxima_is_the_expected_maximum(made: Comparison) -> None:
    """Of a Gaussian process, by the formula of the extremes: it is good to 2 % of the distance from the mean."""
    for row in made.rows:
        if row.statistic in ("maximum", "minimum"):
            distance = abs(row.time - made.response.quantities[row.name].mean)
            assert row.ratio == pytest.approx(1.0, abs=0.02 + 3.0 * row.error / distance)


def test_error_of_a_spread_is_what_many_comparisons_scatter() -> None:
    """Variances of records as gamma variables with CoV 0.2; the delta method's next term is of relative size 1/N."""
    rng = np.random.default_rng(3)
    spreads = 2.0 * np.sqrt(rng.gamma(25.0, 1.0 / 25.0, size=(4000, 16)))
    found = np.array([combined(row, is_spread=True) for row in spreads])
    assert found[:, 0].mean() == pytest.approx(2.0, rel=2e-3)
    assert found[:, 0].std() == pytest.approx(2.0 * 0.5 * 0.2 / 4.0, rel=0.04)
    assert found[:, 1].mean() == pytest.approx(found[:, 0].std(), rel=0.04)
    means = np.array([combined(row, is_spread=False) for row in spreads])
    assert means[:, 1].mean() == pytest.approx(means[:, 0].std(), rel=0.04)


def test_one_record_has_no_error() -> None:
    assert math.isnan(combined(np.array([2.0]), is_spread=True)[1])
    assert combined(np.zeros(3), is_spread=True) == (0.0, 0.0)


def test_records_that_are_needed() -> None:
    """A CoV of 10 % and N records leave 1.96 x 10 % / sqrt(N) of uncertainty at 95 %: 2 % of 96."""
    times = Times(
        frequency_domain=2.0, record=4.0, all_records=50.0, workers=2, scatter=0.1, scattered="surge"
    )  # fmt: skip
    assert 1.96 * 0.1 / math.sqrt(times.records_needed) == pytest.approx(0.02)
    assert times.ratio == pytest.approx(times.records_needed * 2.0)


def test_scatter_is_the_largest_of_surge_sway_and_yaw(made: Comparison) -> None:
    """All three have the same resonance: of 0.2 damping at 0.01 Hz, 1/(2 sqrt(pi zeta f T)) of the std, about 6 %."""
    assert made.times.scattered in ("surge", "sway", "yaw")
    low = made.samples[:, [DEGREES.index(name) for name in ("surge", "sway", "yaw")], STATISTICS.index("low_frequency")]
    cov = low.std(axis=0, ddof=1) / np.sqrt((low**2).mean(axis=0))
    assert made.times.scatter == pytest.approx(cov.max())
    assert 0.03 < made.times.scatter < 0.12
    assert (made.times.workers, len(made.samples)) == (2, 24)


def test_spectrum_of_records_is_that_of_the_process(made: Comparison) -> None:
    """Scatter by the number of independent segments, and the band holds the truth at nine frequencies in ten."""
    low, high = confidence_band(made.segments)
    assert low < 1.0 < high
    inside, scores = [], []
    for index, degree in enumerate(DEGREES):
        quantity = made.response.quantities[f"position.{degree}"]
        true = np.interp(made.frequency, quantity.frequency, quantity.density)
        # Where the spectrum is even over the window's 1 mHz.
        even = (made.frequency > 0.07) & (made.frequency < 0.095)
        ratio = true[even] / made.density[even, index]
        inside.append((ratio > low) & (ratio < high))
        scores.append(1.0 / ratio - 1.0)
    assert len(np.concatenate(inside)) > 250
    assert 0.84 < np.mean(np.concatenate(inside)) < 0.96
    # Neighbouring lines of a Hann window are correlated: some 100 independent ones are left of 270.
    assert np.std(np.concatenate(scores)) == pytest.approx(1.0 / math.sqrt(made.segments), rel=0.2)


def test_spectrum_keeps_the_variance() -> None:
    rng = np.random.default_rng(5)
    samples = rng.standard_normal((40000, 2)) * np.array([1.0, 3.0])
    frequency, density, segments = spectra(samples, 1.0)
    assert segments == pytest.approx((2 * 40000 / 1800 - 1) * 18 / 19, rel=0.03)
    np.testing.assert_allclose(density.mean(axis=0), 2.0 * np.array([1.0, 9.0]), rtol=0.03)
    assert frequency[0] == pytest.approx(2.0 / 1800.0)
    assert spectra(samples[:1000], 1.0)[2] == 1.0


def test_file_gives_the_comparison_back(made: Comparison, tmp_path: Path) -> None:
    write_comparison(made, tmp_path / "c.h5")
    again = read_comparison(tmp_path / "c.h5")
    assert again.rows == made.rows
    for name in ("scenario", "times", "names", "units", "cosimulation", "segments"):
        assert getattr(again, name) == getattr(made, name)
    for name in ("samples", "seeds", "frequency", "density"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name))
    with pytest.raises(ScenarioError, match="tlpsim compare SCENARIO"):
        read_comparison(tmp_path / "none.h5")
    with h5py.File(tmp_path / "c.h5", "a") as file:
        file.attrs["schema_version"] = 99
    with pytest.raises(ScenarioError, match="newer"):
        read_comparison(tmp_path / "c.h5")


def test_json_holds_the_rows(made: Comparison) -> None:
    one = dataclasses.replace(made, samples=made.samples[:1], times=dataclasses.replace(made.times, scatter=math.nan))
    for comparison in (made, one):
        told = json.loads(comparison_json(comparison), parse_constant=pytest.fail)
        assert len(told["rows"]) == len(made.rows)
        surge = told["rows"][0]
        assert (surge["name"], surge["statistic"], surge["unit"]) == ("position.surge", "mean", "m")
        assert surge["frequency"] == 6.0
        assert (surge["error"] is None) == (comparison is one)
    assert json.loads(comparison_json(made))["records"] == len(json.loads(comparison_json(made))["seeds"]) == 24


def test_tables_show_both_domains_and_the_paper(made: Comparison, capsys: pytest.CaptureFixture[str]) -> None:
    print_comparison(made)
    told = capsys.readouterr().out
    for words in ("24 records of 3 h", "std 0.022–0.2 Hz", "heave, cm", "tendon 2, bottom", "times as fast"):
        assert words in told
    assert "Li and Kareem" not in told
    print_comparison(dataclasses.replace(made, samples=made.samples[:1]), paper=True)
    told = capsys.readouterr().out
    assert "the paper's inputs are not published; those of this scenario were inferred by fitting" in told
    surge = next(line for line in told.splitlines() if line.startswith("│ surge, m"))
    cells = [cell.strip() for cell in surge.strip("│").split("│")]
    assert cells[2] == "–"  # the error of one record
    assert cells[5:] == ["7.55", "7.66", "1.015"]


def test_figures_show_both_domains(made: Comparison, tmp_path: Path) -> None:
    paths = draw_comparison(tmp_path / "figures", made)
    assert [path.name for path in paths] == [SPECTRA, SURGE, CONTRIBUTIONS]
    for path in paths:
        assert np.std(imread(path)) > 0.05
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="another folder"):
        draw_comparison(tmp_path / "file", made)
    surge = spectra_figure(made).axes[0]
    lines = {line.get_label(): line for line in surge.get_lines()}
    at = np.argmin(np.abs(made.response.frequency - 0.08))
    drawn = lines["frequency domain"].get_ydata()
    assert np.asarray(drawn)[at] == pytest.approx(made.response.quantities["position.surge"].density[at])


def test_bars_are_the_spreads_of_the_contributions(made: Comparison) -> None:
    """Half of the variance by wind: a bar of sqrt(1/2) of that of all, in both bands."""
    figure = contributions_figure(made.response, "title")
    widths = np.array([bar.get_width() for bar in figure.axes[2].patches]).reshape(2, -1)  # type: ignore[attr-defined]
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    np.testing.assert_allclose(widths[:, names.index("wind")], math.sqrt(0.5) * widths[:, names.index("all")])
    assert widths[0, -1] == pytest.approx(2.0, rel=0.02)  # cm


# Records


def test_seeds_go_on_from_the_scenario_s() -> None:
    scenario = Scenario()
    assert seeded(scenario, 0) == scenario
    assert seeded(scenario, 3) == scenario.with_(simulation={"seed": 4})
    given = scenario.with_(wind={"seed": 7}, waves={"seed": 8})
    assert seeded(given, 0) == given
    found = [seeded(given, k).seeds() for k in range(50)]
    for name in ("wind", "wave"):
        assert len({seeds[name] for seeds in found}) == 50
    with pytest.raises(ScenarioError, match=r"components\.wind\.parameters\.seed"):
        seeded(scenario.with_(components={"wind": {"parameters": {"seed": 3}}}), 1)


NAMES = ("position.surge", "position.heave", "tendon_tension[3]", "point_acceleration[1].x")
UNITS = ("m", "cm", "kN", "m/s2")


@pytest.mark.parametrize("cosimulation", [False, True])
def test_record_is_the_end_of_a_longer_run(tmp_path: Path, cosimulation: bool) -> None:
    """Against the results file of the same run: the transient is beside the duration, not a part of it."""
    scenario = Scenario.from_dict({"simulation": {"duration": 120.0}, "outputs": {"statistics_from": 29.5}})
    found = record(Case(scenario=scenario, names=NAMES, units=UNITS, cosimulation=cosimulation))
    # Components of 1, 0.5 and 0.1 s are together at 30 s.
    longer = scenario.with_(simulation={"duration": 150.0})
    results = run_scenario(longer, tmp_path / "r.h5", monolithic=not cosimulation)
    for name, factor, statistics in zip(NAMES, (1.0, 100.0, 1e-3, 1.0), found.statistics, strict=True):
        signal = factor * results.signal(f"platform.{name}")[300:]
        expected = band_statistics(0.1 * np.arange(len(signal)), signal)
        assert expected.duration == pytest.approx(120.1)
        np.testing.assert_allclose(statistics, [getattr(expected, each) for each in STATISTICS], rtol=1e-9)
    assert found.seeds == scenario.seeds()


def test_processes_make_the_same_records_as_one_does() -> None:
    scenario = Scenario.from_dict({"simulation": {"duration": 100.0}, "outputs": {"statistics_from": 10.0}})
    told: list[tuple[int, int]] = []
    alone, together = (
        records(scenario, 2, NAMES, UNITS, workers=workers, progress=lambda *done: told.append(done))
        for workers in (1, 2)
    )
    assert isinstance(together[0], RecordStatistics)
    # To rounding: this process may have fitted the filters before, with more threads.
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(one.statistics, other.statistics, rtol=1e-7)
        np.testing.assert_allclose(one.density[:20], other.density[:20], rtol=1e-7)
    assert not np.array_equal(alone[0].statistics, alone[1].statistics)
    assert told == [(0, 2), (1, 2), (2, 2)] * 2


def test_an_output_that_is_missing_is_named() -> None:
    case = Case(scenario=Scenario(), names=("position.surge", "nonsense"), units=("m", "m"), cosimulation=False)
    with pytest.raises(ScenarioError, match="no output 'nonsense'"):
        record(case)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"simulation": {"duration": 60.0}}, "needs 91 s or more"),
        ({"components": {"platform": {"fmu": ""}}}, "needs the platform"),
    ],
)
def test_what_cannot_be_compared_is_refused_at_once(changes: dict, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        compare(Scenario.from_dict(changes))
    with pytest.raises(ScenarioError, match="1 or more"):
        compare(Scenario(), 0)


def test_first_error_of_a_process_ends_the_others() -> None:
    with pytest.raises(ValueError, match="domain"):
        in_parallel(math.sqrt, [1.0, -1.0, 2.0, 3.0], workers=2)
    assert in_parallel(math.sqrt, [4.0, 9.0, 16.0], workers=2) == [2.0, 3.0, 4.0]
    with pytest.raises(SolverError, match="without a result"):
        in_parallel(os._exit, [1, 1], workers=2)
    with pytest.raises(ScenarioError, match="workers"):
        in_parallel(math.sqrt, [1.0], workers=0)
