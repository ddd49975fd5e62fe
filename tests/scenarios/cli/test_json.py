"""`--json`: standard output is JSON and nothing else, its numbers are those of the files, null is what is not known."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.loads.bem.database import read
from tlpsim.loads.bem.quadratic_transfer import read_quadratic_transfer
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.results import open_results

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def printed(command: Command) -> Callable[..., tuple[Any, str]]:
    """JSON of a command that ends well, and what it says on standard error."""

    def run(*arguments: object) -> tuple[Any, str]:
        code, told, aside = command(*arguments, "--json")
        assert code == 0, aside
        assert "NaN" not in told
        return json.loads(told), aside

    return run


def test_a_run_and_its_file(printed: Callable[..., tuple[Any, str]], scenario_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "r.h5"
    found, aside = printed("run", scenario_file, "-o", file, "--seed", 5, "--set", "outputs.statistics_from=0")
    assert aside.strip() == f"results: {file}"
    results = open_results(file)
    assert {name: found[name] for name in ("kind", "path", "title", "status", "seeds")} == {
        "kind": "results",
        "path": str(file),
        "title": "Short",
        "status": "complete",
        "seeds": results.seeds,
    }
    assert found["wall_time"] > 0.0
    rows = {row["name"]: row for row in found["summary"]}
    assert list(rows) == ["surge", "sway", "heave", "roll", "pitch", "yaw"]
    for name, row in rows.items():
        signal = results.signal(f"platform.position.{name}")  # in SI units, which those of the table are not
        assert row["unit"] == results.unit(f"platform.position.{name}")
        for statistic, value in (
            ("mean", np.mean(signal)),
            ("std", np.std(signal)),
            ("minimum", np.min(signal)),
            ("maximum", np.max(signal)),
        ):
            assert row[statistic] == pytest.approx(value, rel=1e-12)
        assert row["low_frequency"] is None  # of 20 s
    tensions = np.stack([results.signal(f"platform.tendon_tension[{k}]") for k in range(1, 13)])
    assert found["tension"]["maximum"] == pytest.approx(np.max(tensions), rel=1e-12)
    assert found["tension"]["minimum_tendon"] == f"tendon_tension[{1 + int(np.argmin(np.min(tensions, axis=1)))}]"
    assert any("no low-frequency part" in note for note in found["notes"])
    platform = next(each for each in found["components"] if each["name"] == "platform")
    assert platform["samples"] == 201
    assert {"name": "platform.position.surge", "unit": "m"}.items() <= platform["signals"][0].items()
    again, aside = printed("info", file)
    assert again == found
    assert aside == ""


def test_a_run_of_fmus(printed: Callable[..., tuple[Any, str]], chain: Path, tmp_path: Path) -> None:
    file = tmp_path / "r.h5"
    wiring = ("--connect", "a.flag=b.u[1]", "--step", "0.1", "--stop", "3", "--set", "a.flag_in=true")
    found, aside = printed("run", f"a={chain}", f"b={chain}", *wiring, "-o", file)
    assert f"results: {file}" in aside
    results = open_results(file)
    rows = {row["name"]: row for row in found["outputs"]}
    for name in ("a.y[1]", "b.y[1]"):
        assert rows[name]["unit"] == "m"
        assert rows[name]["mean"] == pytest.approx(np.mean(results.signal(name)), rel=1e-12)
    assert rows["b.y[1]"]["maximum"] > 0.0
    assert found["seeds"] == {}
    told = [line.removeprefix("note: ") for line in aside.splitlines() if line.startswith("note: ")]
    assert found["notes"] == told


def test_check_and_export(printed: Callable[..., tuple[Any, str]], scenario_file: Path, tmp_path: Path) -> None:
    found, aside = printed("check", scenario_file, "--coupling", "--band", 0.05)
    assert aside == ""
    assert found["valid"] is True
    assert {each["name"]: each["step"] for each in found["components"]} == {"wind": 1.0, "wave": 0.5, "platform": 0.1}
    assert found["loops"] == [["platform", "wave", "wind"]]
    assert {"from": "wave.elevation", "to": "platform.elevation"}.items() <= found["connections"][-1].items()
    assert len(found["coupling"]) == len(found["connections"])
    report = found["coupling"][0]
    assert report["connection"] == "wind.force.surge -> platform.wind_force.surge"
    assert report["band"] == pytest.approx(0.05)  # Hz: 0.05 cycles a sample of 1 s
    assert report["alias"] is None  # minus infinity, in dB
    assert any("external_force" in note for note in found["notes"])


def test_swap_and_fmu(command: Command, printed: Callable[..., tuple[Any, str]], chain: Path, tmp_path: Path) -> None:
    scenario = tmp_path / "s.toml"
    scenario.write_text('title = "S"\n')
    code, told, _ = command("swap", scenario, "wave", chain, "--json")
    found = json.loads(told)
    assert code == 1
    assert found["fits"] is False
    assert found["component"] == "wave"
    assert len(found["errors"]) > 0
    missing = [each["variable"] for each in found["variables"] if not each["fits"]]
    assert "force.surge" in missing
    assert found["changes"]["components"]["wave"]["fmu"] == str(chain)

    described, _ = printed("info", chain)
    assert described["kind"] == "FMU"
    assert described["interfaces"] == ["co-simulation"]
    variables = {each["name"]: each for each in described["variables"]}
    assert variables["u[1]"]["causality"] == "input"
    assert variables["y[1]"]["unit"] == "m"


HULL = """
[hull]
kind = "box"
length = 20.0
beam = 10.0
draft = 5.0
panel = 5.0
"""


def test_hydrodynamics(
    printed: Callable[..., tuple[Any, str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    hull, file, qtf = tmp_path / "hull.toml", tmp_path / "hydro.h5", tmp_path / "qtf.h5"
    hull.write_text(HULL)
    found, aside = printed("bem", hull, "-o", file, "--omega", "0.4,0.8", "--headings", "0,90", "--qtf", qtf)
    assert [line for line in aside.splitlines() if not line.startswith("tlpsim: ")] == [
        f"database: {file}",
        f"quadratic transfer function: {qtf}",
    ]
    assert (found["deep_water"], found["depth"]) == (True, None)
    assert found["heading"] == pytest.approx([0.0, np.pi / 2.0])
    assert found["volume"] == pytest.approx(1000.0)
    assert (found["paths"], found["from_cache"]) == ([str(file)], False)
    database = read(file)
    heave = next(each for each in found["modes"] if each["name"] == "heave")
    assert heave["added_mass_infinite"] == pytest.approx(database.added_mass_infinite[2, 2])
    assert heave["largest_radiation_damping"] == pytest.approx(np.max(database.radiation_damping[:, 2, 2]))
    shown, _ = printed("info", file)
    assert shown["modes"] == found["modes"]

    table, _ = printed("info", qtf)
    assert table["kind"] == "quadratic transfer function"
    assert {**table, "path": str(qtf)} == found["quadratic_transfer"]
    transfer = read_quadratic_transfer(qtf).transfer
    assert table["modes"][0]["largest_transfer"] == pytest.approx(np.max(np.abs(transfer[..., 0])))


def test_a_spectral_response(
    printed: Callable[..., tuple[Any, str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fake_response: Callable[..., SpectralResponse],
) -> None:
    response = fake_response()
    monkeypatch.setattr("tlpsim.scenarios.spectral.spectral_response", lambda scenario: response)
    scenario, file = tmp_path / "s.toml", tmp_path / "s.h5"
    scenario.write_text('title = "S"\n')
    found, aside = printed("spectral", scenario, "-o", file, "--duration", "3h")
    assert aside.strip() == f"response: {file}"
    assert found["duration"] == 10800.0
    quantities = {each["name"]: each for each in found["quantities"]}
    assert list(quantities) == list(response.quantities)
    surge = response.quantities["position.surge"]
    assert quantities["position.surge"]["unit"] == "m"
    assert quantities["position.surge"]["std"] == pytest.approx(
        np.sqrt(np.trapezoid(surge.density, surge.frequency)), rel=1e-9
    )
    assert quantities["position.surge"]["maximum"] == pytest.approx(surge.expected_maximum(10800.0))
    assert found["modes"][0] == {"name": "surge", "period": 102.0, "damping_ratio": 0.2}
    assert found["mean_loads"]["wind"] == [0.0, 1e6, 2e6, 3e6, 4e6, 5e6]
    shown, aside = printed("info", file)
    assert (shown, aside) == (found, "")


def test_an_error_leaves_standard_output_empty(command: Command, tmp_path: Path) -> None:
    for name in ("check", "spectral", "info"):
        code, told, error = command(name, tmp_path / "none.toml", "--json")
        assert (code, told) == (2, "")
        assert error.startswith("tlpsim: error: ")
