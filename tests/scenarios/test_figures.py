"""The figures' data against theory, and the files."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli import main as cli
from tlpsim.scenarios.figures import (
    WAVE_FIGURE,
    WIND_FIGURE,
    Spectra,
    draw_processes,
    reference_sea,
    reference_wind,
    shown_points,
    wave_spectra,
    wind_figure,
    wind_spectra,
)
from tlpsim.scenarios.schema import Scenario

DURATION = 24 * 3 * 3600.0


@pytest.fixture(scope="module")
def wind() -> Spectra:
    return wind_spectra(reference_wind(), duration=DURATION)


@pytest.fixture(scope="module")
def waves() -> Spectra:
    return wave_spectra(reference_sea(), duration=DURATION)


def test_simulated_auto_spectra_of_the_wind_lie_in_the_band_of_the_estimate(wind: Spectra) -> None:
    low, high = wind.band()
    assert 0.85 < low < 1.0 < high < 1.15
    ratio = np.einsum("fii->fi", wind.sampled).real / np.einsum("fii->fi", wind.fitted).real
    inside = np.mean((ratio > low) & (ratio < high))
    # 500 frequencies of 6 points, of which some 1000 values are independent: 0.95 ± 3 x 0.007.
    assert 0.925 < inside < 0.975


def test_simulated_elevation_lies_in_the_band_of_the_estimate(waves: Spectra) -> None:
    low, high = waves.band()
    energetic = waves.target[:, 0, 0].real > 1e-3 * waves.target.real.max()
    ratio = (waves.sampled[:, 0, 0].real / waves.fitted[:, 0, 0].real)[energetic]
    # Some 400 frequencies, neighbours correlated.
    assert 0.92 < np.mean((ratio > low) & (ratio < high)) < 0.98


def test_simulated_cross_spectra_are_the_filters(wind: Spectra) -> None:
    auto = np.sqrt(np.einsum("fii->fi", wind.fitted).real)
    error = (wind.sampled - wind.fitted) / (auto[:, :, None] * auto[:, None, :])
    # An estimate of a cross-spectrum deviates by sqrt((1 + coherence²) / segments) in modulus at most.
    assert np.sqrt(np.mean(np.abs(error) ** 2)) < 1.2 * np.sqrt(2.0 / wind.segments)
    assert np.abs(error).max() < 6.0 * np.sqrt(2.0 / wind.segments)


def test_the_filters_meet_their_targets(wind: Spectra, waves: Spectra) -> None:
    for spectra, level in ((wind, 0.0), (waves, 0.01)):
        target, fitted = (np.einsum("fii->fi", m).real for m in (spectra.target, spectra.fitted))
        counts = (target > level * target.max()) & (spectra.frequency[:, None] < 0.4)
        assert np.abs(10.0 * np.log10(fitted[counts] / target[counts])).max() < 0.6


def test_record_is_as_long_as_asked_for(wind: Spectra, waves: Spectra) -> None:
    assert wind.duration == waves.duration == DURATION


def test_two_coherent_but_not_coincident_points_are_shown() -> None:
    target = np.tile(np.array([[1.0, 1.0, 0.5], [1.0, 1.0, 0.5], [0.5, 0.5, 1.0]]), (4, 1, 1))
    assert shown_points(target) in ((0, 2), (1, 2))
    assert shown_points(np.ones((4, 1, 1))) == (0, 0)
    assert shown_points(np.ones((4, 2, 2))) == (0, 1)


def test_figure_shows_what_it_says(wind: Spectra) -> None:
    figure = wind_figure(wind, "Kaimal")
    axes = figure.get_axes()
    assert len(axes) == 4
    for one in axes:
        assert one.get_title()
        assert "Hz" in one.get_xlabel()
        assert one.get_ylabel()
        shown = {line.get_label(): line for line in one.get_lines()}
        assert {"target", "simulated", "fitted filter"} <= set(shown)
        for line in shown.values():
            assert np.all(np.isfinite(np.asarray(line.get_ydata(), dtype=np.float64)))
    first, second = shown_points(wind.target)
    lines = {line.get_label(): line.get_ydata() for line in axes[3].get_lines()}
    coherence = np.abs(wind.target[:, first, second]) / np.sqrt(
        wind.target[:, first, first].real * wind.target[:, second, second].real
    )
    np.testing.assert_allclose(np.asarray(lines["target"]), coherence)
    assert axes[0].get_legend() is not None


def test_files_of_the_reference_case(tmp_path: Path) -> None:
    paths = draw_processes(tmp_path / "new" / "folder", duration=3 * 3600.0)
    assert [path.name for path in paths] == [WIND_FIGURE, WAVE_FIGURE]
    for path in paths:
        image = imread(path)
        assert image.shape[1] > 1000
        assert image.std() > 0.05


def test_command_draws_the_processes_of_a_scenario(tmp_path: Path) -> None:
    file = tmp_path / "calm.toml"
    file.write_text("[waves]\nsignificant_height = 0\n")
    arguments = ["figures", "processes", "-o", str(tmp_path / "out"), "--scenario", str(file)]
    result = CliRunner().invoke(cli.app, [*arguments, "--set", "wind.speed=35"])
    assert result.exit_code == 0, result.output
    assert result.output.split() == [str(tmp_path / "out" / WIND_FIGURE)]
    assert (tmp_path / "out" / WIND_FIGURE).is_file()


def test_nothing_to_draw_and_nowhere_to_write_are_told(tmp_path: Path) -> None:
    scenario = Scenario.from_dict({"wind": {"speed": 0}, "waves": {"significant_height": 0}})
    with pytest.raises(ScenarioError, match="neither gusts nor waves"):
        draw_processes(tmp_path, scenario)
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="cannot write figures"):
        draw_processes(tmp_path / "file" / "below", duration=3600.0)
    result = CliRunner().invoke(cli.app, ["figures", "processes", "-o", str(tmp_path), "--set", "wind.speed=35"])
    assert isinstance(result.exception, ScenarioError)


def test_a_poor_fit_is_one_line_on_the_error_stream(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "davenport.toml"
    # Few points, for speed.
    file.write_text(
        "[wind]\nspectrum = 'davenport'\norders = { long = 25, autoregressive = 3, moving_average = 3 }\n"
        "segments = [{ position = [0, 0, 30], area = 500, shape_coefficient = 1.2 }]\n"
        "[waves]\nsignificant_height = 0\n"
    )
    monkeypatch.setattr("sys.argv", ["tlpsim", "figures", "processes", "-o", str(tmp_path), "--scenario", str(file)])
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        with pytest.raises(SystemExit) as left:
            cli.main()
    assert left.value.code == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("tlpsim: warning: gusts, spectrum 'davenport': AR(25)")
