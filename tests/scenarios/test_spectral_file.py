"""A response as a file, against the response itself and against what a results file holds."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral_file import read_head, read_spectral, write_spectral
from tlpsim.scenarios.spectral_tables import quantity_statistics, worst_tendons


@pytest.fixture
def file(tmp_path: Path, fake_response: Callable[..., SpectralResponse]) -> Path:
    write_spectral(fake_response(), Scenario(title="Short"), tmp_path / "new" / "s.h5")
    return tmp_path / "new" / "s.h5"


def same(one: object, other: object) -> None:
    """Equality to the last bit and in the same order, through records, mappings and arrays."""
    assert type(one) is type(other)
    if dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, dict):
        assert isinstance(other, dict)
        assert list(one) == list(other)
        for key in one:
            same(one[key], other[key])
    elif isinstance(one, tuple):
        assert isinstance(other, tuple)
        assert len(one) == len(other)
        for each, its in zip(one, other, strict=True):
            same(each, its)
    else:
        np.testing.assert_array_equal(one, other)  # type: ignore[arg-type]


def test_round_trip_is_exact(file: Path, fake_response: Callable[..., SpectralResponse]) -> None:
    same(read_spectral(file), fake_response())


def test_head_is_that_of_a_results_file(file: Path, scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    results = run_scenario(scenario, tmp_path / "r.h5", monolithic=True)
    head = read_head(file)
    assert set(head) <= set(results.attributes)
    assert json.loads(head["versions"]) == results.versions
    assert Scenario.from_json(head["scenario"]) == Scenario(title="Short")
    assert head["title"] == "Short"
    assert read_head(tmp_path / "none.h5") == {}


def test_units_stand_with_the_data(file: Path) -> None:
    with h5py.File(file) as opened:
        surge = opened["quantities/position.surge"]
        assert (surge.attrs["units"], surge.attrs["density_units"]) == ("m", "(m)²/Hz")
        assert surge.dims[0][0] == opened["frequency"]
        assert opened["frequency"].attrs["units"] == "Hz"


def test_what_is_no_response_is_refused_in_a_sentence(file: Path, tmp_path: Path) -> None:
    results = tmp_path / "r.h5"
    with h5py.File(results, "w") as other:
        other.attrs["format"] = "tlpsim results"
    (tmp_path / "text.h5").write_text("no HDF5")
    for name, words in (
        ("none.h5", "no such file"),
        ("r.h5", "holds tlpsim results"),
        ("text.h5", "cannot be read"),
        (".", "no such file"),
    ):
        with pytest.raises(ScenarioError, match=words) as told:
            read_spectral(tmp_path / name)
        assert "tlpsim spectral SCENARIO -o" in str(told.value)
    with h5py.File(file, "a") as newer:
        newer.attrs["schema_version"] = 2
    with pytest.raises(ScenarioError, match="newer tlpsim"):
        read_spectral(file)
    with h5py.File(file, "a") as broken:
        broken.attrs["schema_version"] = 1
        del broken["modes"]
    with pytest.raises(ScenarioError, match="cannot be read"):
        read_spectral(file)


def test_a_file_that_cannot_be_written_leaves_nothing(
    tmp_path: Path, fake_response: Callable[..., SpectralResponse]
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="cannot be written"):
        write_spectral(fake_response(), Scenario(), tmp_path / "file" / "s.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_statistics_of_a_quantity(fake_response: Callable[..., SpectralResponse]) -> None:
    """The spectrum is made of a slow part of 1.1 m and waves of 0.7 m, whose tails cross the band's edge by little."""
    found = quantity_statistics(fake_response().quantities["position.surge"], 10800.0)
    assert found.mean == 6.0
    assert found.std == pytest.approx(np.hypot(1.1, 0.7), rel=1e-6)
    assert found.low_frequency == pytest.approx(1.1, rel=0.02)
    assert found.wave_frequency == pytest.approx(0.7, rel=0.02)
    # The waves' second moment is 0.7² (0.08² + 0.01²); that of the resonance 1.1² 0.01² and a little of its tail.
    assert found.period == pytest.approx(np.hypot(1.1, 0.7) / np.hypot(0.7 * 0.0806, 1.1 * 0.0105), rel=0.03)
    assert found.minimum < found.mean - 3.0 * found.std
    assert found.maximum - found.mean > found.mean - found.minimum  # skewness is above zero


def test_worst_tendons_are_told_by_end(fake_response: Callable[..., SpectralResponse]) -> None:
    top = worst_tendons(fake_response(), "top", 10800.0)
    # Tendon 1 has the higher mean and the larger spread; by 0.5 MN of mean and 4 x 0.1 MN the lowest is tendon 2's.
    assert list(top) == ["1", "2"]
    assert top["1"].maximum > top["2"].maximum
    assert top["2"].minimum < top["1"].minimum
    assert worst_tendons(dataclasses.replace(fake_response(), quantities={}), "top", 10800.0) == {}


def test_a_compact_file_has_the_same_in_single_precision(
    tmp_path: Path, fake_response: Callable[..., SpectralResponse]
) -> None:
    response, path = fake_response(), tmp_path / "compact.h5"
    write_spectral(response, Scenario(title="Short"), path, compact=True)
    found = read_spectral(path)
    assert list(found.quantities) == list(response.quantities)
    for name, quantity in response.quantities.items():
        kept = found.quantities[name]
        assert (kept.unit, kept.mean, kept.skewness) == (quantity.unit, quantity.mean, quantity.skewness)
        # Half of the last of 24 binary digits; where a density is tiny, of the smallest number instead.
        np.testing.assert_allclose(kept.density, quantity.density, rtol=2**-24, atol=2**-149)
    assert list(found.contributions) == list(response.contributions)
    for name, density in response.contributions.items():
        np.testing.assert_allclose(found.contributions[name], density, rtol=2**-24, atol=2**-149)
    np.testing.assert_allclose(found.cross_spectrum, response.cross_spectrum, rtol=2**-23, atol=2**-148)
    same(found.modes, response.modes)
