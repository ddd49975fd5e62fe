"""`tlpsim statistics`: tables of 80 columns, files, records that are whole and broken, one line for an error."""

import csv
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tlpsim.scenarios import terminal
from tlpsim.scenarios.cli.main import main
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.statistics.signals import run_statistics

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Exit code, standard output and standard error of `tlpsim statistics` with some arguments."""

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["tlpsim", "statistics", *map(str, arguments)])
        monkeypatch.setattr(terminal.output, "width", 80)
        with pytest.raises(SystemExit) as end:
            main()
        told = capsys.readouterr()
        return int(end.value.code or 0), told.out, told.err

    return run


@pytest.fixture(scope="module")
def three(record: Callable[..., Results], gaussian: Callable[..., np.ndarray]) -> list[Results]:
    """Three records of 2000 s with waves, in the six degrees of freedom and three tendons, one of them lost."""
    waves = gaussian(lambda f: np.where((f > 0.01) & (f < 0.1), 10.0, 0.0), 3, 4001, 0.5, 4)
    positions = {"surge": 1.0, "sway": 0.5, "heave": 0.02, "roll": 1e-4, "pitch": 1e-4, "yaw": 1e-2}
    made = []
    for number, wave in enumerate(waves):
        signals = {f"position.{name}": scale * (5.0 + wave) for name, scale in positions.items()}
        tensions = {"tendon_tension[1]": 11e6 + 5e5 * wave, "tendon_tension[2]": 11e6 - 5e5 * wave}
        lost = {"tendon_tension[3]": np.zeros(len(wave))}
        scenario = Scenario.from_dict({"title": "Storm", "simulation": {"seed": number + 1}})
        made.append(record(scenario, {**signals, **tensions, **lost}, units=UNITS))
    return made


UNITS = dict.fromkeys([f"position.{name}" for name in ("surge", "sway", "heave")], "m")
UNITS |= dict.fromkeys([f"position.{name}" for name in ("roll", "pitch", "yaw")], "rad")
UNITS |= dict.fromkeys([f"tendon_tension[{number}]" for number in (1, 2, 3)], "N")


def paths(results: list[Results]) -> list[Path]:
    return [each.path for each in results]


def test_tables_of_one_record_fit_80_columns(command: Command, three: list[Results]) -> None:
    code, told, _ = command(three[0].path)
    assert code == 0
    assert max(map(len, told.splitlines())) <= 80
    assert told.startswith("Storm: 1 record of 1400 s from 600 s; intervals of 95 %")
    assert "note: tendon 3: constant" in told
    assert "Gumbel" not in told
    (found,) = run_statistics(three[:1], ["platform.position.surge"])
    row = next(line for line in told.splitlines() if line.startswith("│ surge, m "))
    mean, half = (float(each) for each in row.split("│")[2].split("±"))
    assert mean == pytest.approx(found.mean.value, abs=half)
    assert half == pytest.approx(0.5 * (found.mean.high - found.mean.low), rel=0.05)  # of two digits
    for row in ("surge, m ", "heave, cm ", "pitch, 1e-4 rad ", "tendon 1, MN ", "tendon 3, MN "):
        assert told.count(f"│ {row}") == 3  # tables
    assert "expected in 3 h" in told
    assert "range, m = 4" in told


def test_several_records_have_extremes_by_gumbel(command: Command, three: list[Results]) -> None:
    code, told, _ = command(*paths(three), "--signal", "*.surge", "--exposure", "1h", "--from", "100", "--slope", 3)
    assert code == 0
    assert told.startswith("Storm: 3 records of 1900 s from 100 s")
    assert "extremes of records (Gumbel), mean in 1 h" in told
    assert "range, m = 3" in told
    assert max(map(len, told.splitlines())) <= 80


def test_json_holds_what_python_gets(command: Command, three: list[Results]) -> None:
    code, told, _ = command(*paths(three), "--json")
    assert code == 0
    found = json.loads(told)
    assert found["kind"] == "statistics"
    assert found["paths"] == [str(each.path) for each in three]
    assert found["seeds"] == [each.seeds for each in three]
    assert (found["exposure"], found["slope"], found["confidence"], found["equivalent_frequency"]) == (
        10800,
        4,
        0.95,
        1,
    )
    made = {each.name: each for each in run_statistics(three)}
    for row in found["signals"]:
        same = made[row["name"]]
        for name in ("mean", "low_frequency", "expected_maximum", "zero_crossing_period"):
            estimate: Estimate = getattr(same, name)
            assert row[name]["value"] == pytest.approx(estimate.value, nan_ok=True) or row[name]["value"] is None
    lost = next(row for row in found["signals"] if row["name"] == "platform.tendon_tension[3]")
    assert lost["skewness"] == {"value": None, "low": None, "high": None}
    assert lost["mean"]["value"] == 0.0
    assert lost["weibull_maxima"] is None
    surge = found["signals"][0]
    assert surge["weibull_maxima"]["count"] == made[surge["name"]].weibull_maxima.count  # type: ignore[union-attr]
    assert surge["gumbel_maximum"]["records"] == 3
    assert len(surge["exceedance"]["level"]) == len(surge["exceedance"]["probability"]) > 100


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_files(command: Command, three: list[Results], tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"deep/statistics{suffix}"
    code, told, _ = command(three[0].path, "-o", path, "-q")
    assert (code, told) == (0, "")
    (surge,) = run_statistics(three[:1], ["platform.position.surge"])
    if suffix == ".json":
        row = json.loads(path.read_text())["signals"][0]["std"]
        assert (row["value"], row["high"]) == (surge.std.value, surge.std.high)
        return
    with path.open(newline="") as text:
        rows = {(row["signal"], row["statistic"]): row for row in csv.DictReader(text)}
    std = rows["platform.position.surge", "std"]
    assert (float(std["value"]), float(std["low"]), std["unit"]) == (surge.std.value, surge.std.low, "m")
    assert float(rows["platform.position.surge", "weibull_maxima.shape"]["value"]) == surge.weibull_maxima.shape  # type: ignore[union-attr]
    assert rows["platform.tendon_tension[3]", "maximum"]["value"] == "0.0"
    assert ("platform.position.surge", "damage_equivalent_range") not in rows
    assert ("platform.tendon_tension[1]", "damage_equivalent_range") in rows


def test_a_run_that_was_killed(command: Command, three: list[Results], tmp_path: Path) -> None:
    """Its file has the suffix .part, and half a record; here it is cut by hand."""
    import h5py

    part = tmp_path / "killed.h5.part"
    shutil.copy(three[0].path, part)
    with h5py.File(part, "r+") as file:
        file.attrs["status"] = "running"
        for dataset in file["platform"].values():
            dataset.resize((3000,))
    code, told, _ = command(part)
    assert code == 0
    assert "1 record of 900 s" in told
    assert "note: killed.h5.part is not of a complete run (running)" in told
    code, told, _ = command(part, three[1].path, "--signal", "*.surge")
    assert code == 0
    assert "2 records of 900 s" in told


def test_bad_input_is_told_in_one_line(command: Command, three: list[Results], tmp_path: Path) -> None:
    first = three[0].path
    (tmp_path / "no.h5").write_text("text")
    cases = {
        (tmp_path / "nothing.h5",): "no such results file",
        (tmp_path / "no.h5",): "not an HDF5 file",
        (first, first): "same seeds",
        (first, "--signal", "platform.position.serge"): "no recorded signal matches",
        (first, "--from", "soon"): "--from is 'soon'",
        (first, "--exposure", "0"): "exposure is 0",
        (first, "--slope", "0.1"): "slope is 0.1",
        (first, "-o", tmp_path / "a.txt"): ".csv or .json",
        (first, "-o", first / "a.csv"): "is a file, not a folder",
    }
    for arguments, words in cases.items():
        code, told, error = command(*arguments)
        assert (code, told) == (2, "")
        assert error.startswith("tlpsim: error: ")
        assert words in error
        assert len(error.splitlines()) == 1


def test_a_case_of_another_sea_is_named(command: Command, three: list[Results], record: Callable[..., Results]) -> None:
    other = Scenario.from_dict({"simulation": {"seed": 9}, "waves": {"significant_height": 9.0}})
    code, _, error = command(three[0].path, record(other, {"position.surge": np.zeros(5)}).path)
    assert code == 2
    assert "waves.significant_height is 9.0, and not 7.08" in error


def test_a_record_of_a_moment(command: Command, record: Callable[..., Results]) -> None:
    results = record(Scenario(), {"position.surge": np.arange(4.0), "tendon_tension[1]": np.zeros(4)})
    code, told, _ = command(results.path)
    assert code == 0
    assert "fewer than 10 cycles" in told
    code, told, _ = command(results.path, "--json")
    assert json.loads(told)["signals"][0]["expected_maximum"]["value"] is None
