"""Jobs on a cluster: what is done, done again, not done again, and what becomes of workers that die."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np
import pytest
from distributed import Client

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.scenarios.results import open_results
from tlpsim.scenarios.spectral_file import read_spectral
from tlpsim.scenarios.spectral_tables import quantity_statistics
from tlpsim.scenarios.statistics.signals import run_statistics
from tlpsim.scenarios.sweep import execution
from tlpsim.scenarios.sweep.cluster import connected
from tlpsim.scenarios.sweep.execution import run_sweep
from tlpsim.scenarios.sweep.job import Order, Outcome
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.table import NAME, read_table

# Morison's forces and constant added mass, which need no boundary elements; waves without digital filters.
LIGHT: dict[str, Any] = {
    "simulation": {"duration": 300.0},
    "platform": {"hydrodynamics": "morison"},
    "waves": {"drift": "none", "drift_damping": False, "generator": "harmonic", "components": 20},
}
HEIGHT = "waves.significant_height"


def sweep(heights: list[Any], **rest: Any) -> Sweep:
    return Sweep.from_dict({"set": LIGHT, "grid": {HEIGHT: heights}, "time": {"engine": "monolithic"}, **rest})


def numbers(order: Order, *prepared: object) -> Outcome:
    """A job that leaves the height of its waves."""
    height = float(order.scenario.partition('"significant_height":')[2].partition(",")[0])
    return Outcome(key=order.key, names=("elevation.mean",), units=("m",), values=np.array([height]), seconds=0.0)


def refuse(*_: object) -> Any:
    raise AssertionError("a cluster is started, and there is nothing to do")


def test_statistics_of_both_domains_are_those_of_the_scenario_itself(tmp_path: Path, client: Client) -> None:
    chosen = sweep([4.0, 6.0], domains=["frequency", "time"])
    table = run_sweep(chosen, tmp_path / "s")
    assert list(table.columns["domain"]) == ["frequency", "time"] * 2
    assert table.failed == 0
    case = chosen.plan().cases[1]
    response = chosen.scenario(case).spectral()
    expected = quantity_statistics(response.quantities["position.surge"], 10800.0)
    for name, value in (("std", expected.std), ("expected_maximum", expected.maximum), ("mean", expected.mean)):
        assert table.statistic("platform.position.surge", name)[2] == value
    kept = read_spectral(tmp_path / "s" / table.columns["file"][2])
    np.testing.assert_allclose(kept.cross_spectrum, response.cross_spectrum, rtol=1e-6, atol=1e-12)
    results = open_results(tmp_path / "s" / table.columns["file"][3])
    assert results.seeds == {"wind": table.columns["wind_seed"][3], "wave": table.columns["wave_seed"][3]}
    found = {each.name: each for each in run_statistics([results])}
    for name in ("platform.position.surge", "platform.tendon_tension[1]"):
        assert table.statistic(name, "std")[3] == found[name].std.value
        assert table.statistic(name, "maximum")[3] == found[name].maximum


def test_what_is_done_is_not_done_again_and_the_summary_is_the_same(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_sweep(sweep([4.0, 6.0]), tmp_path)
    before = (tmp_path / NAME).read_bytes()
    monkeypatch.setattr(execution, "connected", refuse)
    run_sweep(sweep([4.0, 6.0]), tmp_path)
    assert (tmp_path / NAME).read_bytes() == before


def test_a_sweep_that_grows_does_only_its_new_cases(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[int, int, int]] = []
    monkeypatch.setattr(execution, "perform", numbers)
    run_sweep(sweep([4.0, 6.0]), tmp_path)
    grown = sweep([3.0, 4.0, 5.0, 6.0])
    table = run_sweep(grown, tmp_path, progress=lambda *numbers: seen.append(numbers))
    assert seen[0] == (2, 4, 0)
    assert seen[-1] == (4, 4, 0)
    assert list(table.columns["elevation.mean"]) == [3.0, 4.0, 5.0, 6.0]


def test_a_failed_case_is_told_and_stops_no_other_and_is_done_again_when_asked(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = True

    def sometimes(order: Order, *prepared: object) -> Outcome:
        found = numbers(order)
        if broken and found.values[0] == 5.0:
            return Outcome(key=order.key, error="it broke", values=np.zeros(0), seconds=0.0)
        return found

    monkeypatch.setattr(execution, "perform", sometimes)
    chosen = sweep([4.0, 5.0, -1.0, 6.0])
    table = run_sweep(chosen, tmp_path)
    assert list(table.columns["status"]) == ["done", "failed", "failed", "done"]
    assert table.columns["error"][1] == "it broke"
    assert "must be at least 0" in table.columns["error"][2]
    assert np.isnan(table.columns["elevation.mean"][1])
    broken = False
    assert run_sweep(chosen, tmp_path).failed == 2  # only when asked
    table = run_sweep(chosen, tmp_path, retry_failed=True)
    assert list(table.columns["status"]) == ["done", "done", "failed", "done"]


@pytest.mark.parametrize(("by", "expected"), [("elevation.mean", {2, 3}), ("elev*.minimum", {0, 1})])
def test_only_the_worst_cases_are_simulated(
    by: str, expected: set[int], tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def both(order: Order, *prepared: object) -> Outcome:
        found = numbers(order)
        return Outcome(
            key=order.key,
            names=("elevation.mean", "elevation.minimum"),
            units=("m", "m"),
            values=np.repeat(found.values, 2),
            seconds=0.0,
        )

    monkeypatch.setattr(execution, "perform", both)
    chosen = sweep(
        [3.0, 4.0, 5.0, 6.0],
        domains=["frequency", "time"],
        time={"worst": 2, "by": by},
        replicates={"records": 3},
    )
    seen: list[tuple[int, int, int]] = []
    table = run_sweep(chosen, tmp_path, progress=lambda *numbers: seen.append(numbers))
    in_time = table.columns["domain"] == "time"
    assert set(table.columns["case"][in_time]) == expected
    assert list(table.columns["replicate"][in_time]) == [1, 2, 3] * 2
    assert table.planned == table.rows == 4 + 6
    assert {total for _, total, _ in seen} == {10}
    assert [done for done, _, _ in seen] == sorted(done for done, _, _ in seen)


def test_the_worst_by_an_unknown_statistic_is_refused(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "perform", numbers)
    chosen = sweep([3.0], domains=["frequency", "time"], time={"worst": 1, "by": "elevation.maxi"})
    with pytest.raises(ScenarioError, match=r"time.by = 'elevation.maxi' matches no statistic"):
        run_sweep(chosen, tmp_path)


def test_more_jobs_than_are_with_the_scheduler_at_a_time(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "perform", numbers)
    monkeypatch.setattr(execution, "LEAST_WINDOW", 7)
    monkeypatch.setattr(execution, "PREPARED", 1)
    heights = np.linspace(1.0, 9.0, 100).tolist()
    table = run_sweep(sweep(heights, domains=["frequency", "time"], files=[]), tmp_path)
    np.testing.assert_array_equal(table.columns["elevation.mean"], np.repeat(heights, 2))


def test_a_worker_without_the_folder_sends_its_files(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tlpsim.scenarios.sweep.job.Place.is_here", lambda place: False)
    table = run_sweep(sweep([5.0]), tmp_path)
    assert read_spectral(tmp_path / table.columns["file"][0]).modes


def test_a_worker_of_another_version_is_refused(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "program_version", lambda: "0.0.1")
    with pytest.raises(ScenarioError, match=r"a worker has tlpsim .* started by 0.0.1"):
        run_sweep(sweep([5.0]), tmp_path)


def test_a_cluster_that_is_lost_keeps_what_is_done(
    tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "perform", numbers)
    monkeypatch.setattr(execution, "LEAST_WINDOW", 4)

    def interrupted(done: int, total: int, failed: int) -> None:
        if done >= 2 and client.status == "running":
            closing = threading.Thread(target=client.close)
            closing.start()
            closing.join(10.0)

    with pytest.raises(SolverError, match=r"the local cluster is gone .* the same command goes on"):
        run_sweep(sweep(np.linspace(1.0, 9.0, 50).tolist()), tmp_path, progress=interrupted)
    table = read_table(tmp_path)
    assert 2 <= table.rows < table.planned == 50


# Processes


def deadly(order: Order, *prepared: object) -> Outcome:
    """A job that kills its worker at 5 m, and once at 4 m."""
    found = numbers(order)
    once = Path(order.place.folder) / "once"
    if found.values[0] == 5.0 or (found.values[0] == 4.0 and not once.exists()):
        once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return found


def test_a_job_of_a_lost_worker_is_done_again_and_one_that_kills_workers_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = sys.modules[__name__]
    cloudpickle.register_pickle_by_value(module)
    monkeypatch.setattr(execution, "perform", deadly)
    try:
        table = run_sweep(sweep([3.0, 4.0, 5.0, 6.0], files=[]), tmp_path, workers=2)
    finally:
        cloudpickle.unregister_pickle_by_value(module)
    assert list(table.columns["status"]) == ["done", "done", "failed", "done"]
    assert table.columns["error"][2].startswith("3 workers died at this job")
    assert list(table.columns["elevation.mean"][[0, 1, 3]]) == [3.0, 4.0, 6.0]


def test_after_a_kill_the_summary_is_that_of_an_undisturbed_sweep(tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text(
        "files = []\n[set]\nplatform.hydrodynamics = 'morison'\nwaves.drift = 'none'\nwaves.drift_damping = false\n"
        "[grid]\nwaves.significant_height = { from = 2, to = 8, count = 6 }\n"
    )
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", "sweep", str(file), "--workers", "2", "-q", "-o"]
    killed = subprocess.Popen([*command, str(tmp_path / "killed")], stderr=subprocess.DEVNULL)
    ledger = tmp_path / "killed" / "ledger.sqlite"
    limit = time.monotonic() + 120.0
    while not (ledger.exists() and _finished(ledger)) and killed.poll() is None and time.monotonic() < limit:
        time.sleep(0.05)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    done = _finished(ledger)
    assert done >= 1
    subprocess.run([*command, str(tmp_path / "killed")], check=True, capture_output=True)
    run_sweep(Sweep.load(file), tmp_path / "whole")
    assert (tmp_path / "killed" / NAME).read_bytes() == (tmp_path / "whole" / NAME).read_bytes()
    assert read_table(tmp_path / "killed").rows == 6


def _finished(ledger: Path) -> int:
    import sqlite3

    try:
        with sqlite3.connect(f"file:{ledger}?mode=ro", uri=True) as connection:
            return int(connection.execute("SELECT COUNT(*) FROM jobs").fetchone()[0])
    except sqlite3.Error:
        return 0


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"workers": 0}, "workers is 0; it must be 1 or more"),
        ({"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "--workers is for a local cluster"),
        ({"scheduler": "nonsense"}, "--scheduler nonsense: nothing answers there"),
    ],
)
def test_a_cluster_that_cannot_be_is_told(options: dict[str, Any], told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tlpsim.scenarios.sweep.cluster._CONNECT", "1s")
    with pytest.raises(ScenarioError, match=told), connected(**options):
        pass
