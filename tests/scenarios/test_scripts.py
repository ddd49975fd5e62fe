"""The ready scripts, at short durations: each runs, and says what its physics wants."""

import csv
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts import heading_sweep
from tlpsim.scenarios.scripts.free_decay import crests

PUBLISHED = {"surge": 103.6, "yaw": 82.7}
"""Natural periods of the ISSC TLP in s, as in benchmarks/chain.py."""


def said(name: str, folder: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    import_module(f"tlpsim.scenarios.scripts.{name}").main(["-o", str(folder), *arguments])
    return capsys.readouterr().out


def test_crests_give_period_and_damping_of_an_oscillator() -> None:
    """x = exp(-zeta w t) cos(w_d t): crests a period apart, each exp(-delta) of the one before."""
    zeta, omega = 0.05, 2.0 * np.pi / 100.0
    damped = omega * np.sqrt(1.0 - zeta**2)
    time = np.arange(0.0, 1000.0, 0.01)
    period, amplitude, ratio = crests(time, 3.0 * np.exp(-zeta * omega * time) * np.cos(damped * time))
    # The crests are a little before the cosine's, and the first sample is none; after it the series is exact.
    assert np.allclose(period[1:], 2.0 * np.pi / damped, atol=0.02)
    assert np.allclose(ratio[1:], zeta, rtol=1e-4)
    assert amplitude[0] == 3.0


def test_free_decay_has_the_published_periods(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = said("free_decay", tmp_path, capsys, "--duration", "450")
    for degree in ("surge", "yaw"):
        found = [float(number) for number in re.findall(rf"{degree}: ([\d.]+) s", text)]
        # The last pair of crests is that of small motions, as the published periods are.
        assert found[-1] == pytest.approx(PUBLISHED[degree], rel=0.02)


def test_tendon_failure_loads_the_corner(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = ("--duration", "180", "--set", "outputs.statistics_from=0")
    events = "[{at=20,lose_tendons=1},{at=100,lose_tendons=2}]"
    text = said("tendon_failure", tmp_path, capsys, *settings, "--set", f"events={events}")
    rows = re.findall(r"tendon_tension\[3\]: ([\d.]+), ([\d.]+), ([\d.]+)", text)
    assert len(rows) == 2
    # Three tethers of a corner hang at one place: two, then one, carry most of what three did.
    intact, _, first = (float(each) for each in rows[0])
    assert 1.25 * intact < first < 2.0 * intact
    assert float(rows[1][2]) > 1.8 * intact
    assert (tmp_path / "tendon_failure.html").stat().st_size > 100_000


def test_component_swap_gives_the_same_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = said("component_swap", tmp_path, capsys, "--duration", "120")
    apart = [float(number) for number in re.findall(r"difference ([\d.]+) %", text)]
    assert len(apart) == 6
    assert max(apart) < 2.0


def test_heading_sweep_repeats_after_a_quarter(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(heading_sweep, "TURNS", (0, 90))
    said("heading_sweep", tmp_path, capsys, "--duration", "60")
    with (tmp_path / "heading_sweep.csv").open(newline="") as file:
        rows = {int(row["turn, deg"]): row for row in csv.DictReader(file)}
    first, last = rows[0], rows[90]
    # The hull looks the same after a quarter turn, with x where y was.
    for what in ("mean", "std"):
        assert float(last[f"position.sway {what}"]) == pytest.approx(float(first[f"position.surge {what}"]), rel=1e-3)
    assert float(last["position.surge mean"]) == pytest.approx(-float(first["position.sway mean"]), rel=1e-3)


@pytest.mark.parametrize("name", ["typical_storm", "hundred_year_storm"])
def test_storms_leave_a_report(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = said(name, tmp_path, capsys, "--duration", "200", "--set", "outputs.statistics_from=50")
    assert "analysed" in text
    assert (tmp_path / f"{name}.html").stat().st_size > 100_000


@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "scenarios").glob("*.toml")), ids=lambda p: p.stem)
def test_every_scenario_file_can_be_loaded(path: Path) -> None:
    if path.stem.endswith("_hull") and not path.stem.startswith("table"):
        pytest.skip("a hull, not a scenario")
    assert Scenario.load(path).title
