"""The results file as other programs see it: xarray, netCDF, h5dump; complete, in the making, and after a kill."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray

from tlpsim.scenarios import results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario


@pytest.fixture(scope="module")
def storm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("storm") / "storm.h5"
    run_scenario(Scenario().with_(simulation={"duration": 60.0}), path)
    return path


def test_a_dataset_has_names_units_and_coordinates(storm: Path) -> None:
    record = results.open_results(storm)
    with results.open(storm) as data:
        surge = data["platform.position.surge"]
        assert surge.dims == ("platform.time",)
        assert surge.attrs["units"] == "m"
        assert "surge" in surge.attrs["long_name"]
        assert np.array_equal(surge, record.signal("platform.position.surge"))
        assert np.array_equal(data["platform.time"], np.arange(601) / 10)
        assert data["wave.time"].attrs["units"] == "s"
        assert float(surge.sel({"platform.time": 12.3}, method="nearest")) == surge.values[123]
        names = {f"{component}.{name}" for component in record.components for name in record.signals(component)}
        assert set(data.data_vars) == names
        assert data.attrs["title"] == record.title
        assert data.attrs["wave.sha256"] == record.components["wave"]["sha256"]


def test_values_are_read_when_they_are_asked_for(storm: Path) -> None:
    with results.open(storm) as data:
        surge = data["platform.position.surge"]
        assert not surge.variable._in_memory
        part = surge.isel({"platform.time": slice(100, 110)})
        assert not part.variable._in_memory
        assert part.values.shape == (10,)
        assert not surge.variable._in_memory


def test_xarray_alone_reads_a_component_and_all_of_them(storm: Path) -> None:
    with xarray.open_dataset(storm, group="platform", engine="h5netcdf") as data:
        assert data["position.surge"].dims == ("time",)
        assert data["position.surge"].attrs["units"] == "m"
    with xarray.open_datatree(storm, engine="h5netcdf") as tree:
        assert set(tree.children) == {"wind", "wave", "platform"}


@pytest.mark.skipif(shutil.which("h5dump") is None, reason="HDF5's own tools are not installed")
def test_h5dump_reads_the_compressed_samples(storm: Path) -> None:
    command = ["h5dump", "-m", "%.17g", "-y", "-w", "1", "-d", "/platform/position.surge", "-s", "0", "-c", "50", storm]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    numbers = text.partition("DATA {")[2].partition("}")[0].replace(",", " ").split()
    assert [float(each) for each in numbers] == list(results.open_results(storm).signal("platform.position.surge")[:50])


def test_the_file_says_how_long_each_component_took_and_what_the_coupling_cost(storm: Path) -> None:
    record = results.open_results(storm)
    assert all(each["wall_time"] > 0.0 and each["steps"] > 0 for each in record.components.values())
    by_name = {each.connection: each for each in record.coupling}
    assert len(by_name) == len(record.scenario.wiring())
    force = by_name["wave.force.surge -> platform.wave_force.surge"]
    # The waves' samples at 0.5 s, at 1 s from their neighbours: far from exact and far from useless.
    assert 1e-4 < force.interpolation < 0.1


KILLED = """
import sys
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
run_scenario(Scenario().with_(simulation={"duration": 360_000.0}, components={"platform": {"step": 0.05}}), sys.argv[1])
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_a_killed_run_opens_with_all_but_the_last_seconds(tmp_path: Path) -> None:
    path = tmp_path / "storm.h5.part"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path / "storm.h5")])
    try:
        _wait_for(path)
        with results.open(path) as data:  # while the run goes
            live = data.sizes["platform.time"]
            assert np.all(np.isfinite(data["platform.position.surge"]))
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    with results.open(path) as data:
        assert data.attrs["status"] == "running"
        assert data.sizes["platform.time"] >= live > 1
        assert np.allclose(np.diff(data["platform.time"]), 0.05)
        assert all(np.all(np.isfinite(each)) for each in data.data_vars.values())
    if shutil.which("h5dump"):
        subprocess.run(["h5dump", "-H", path], check=True, stdout=subprocess.DEVNULL)
    with xarray.open_dataset(path, group="platform", engine="h5netcdf") as data:
        assert "position.surge" in data


def _wait_for(path: Path) -> None:
    """Until the run has written more than its first samples."""
    for _ in range(600):
        if path.exists():
            try:
                if len(results.open_results(path).time("platform")) > 100:
                    return
            except results.ResultsError:
                pass  # just now it is being written
        time.sleep(0.1)
    raise AssertionError("the run wrote nothing within a minute")


def test_a_run_that_ended_before_its_first_sample_has_no_variables(tmp_path: Path) -> None:
    from tlpsim.orchestrator.execution import RunSummary
    from tlpsim.orchestrator.instance import PythonInstance
    from tlpsim.orchestrator.system import Component, System
    from tlpsim.scenarios.recording import Recording
    from tlpsim.scenarios.results_writer import ResultsWriter

    writer = ResultsWriter(tmp_path / "r.h5", Recording(title="Nothing", end=10))
    instance = PythonInstance("c", lambda values, time, size: None, outputs={"y": 0.0})
    writer.started(System(components=(Component(instance=instance, step=1),)))
    nothing = RunSummary(start=0, stop=0, components=(), wall_time=0.0, initialization_sweeps=0, notes=())
    writer.stopped(ValueError("at once"), nothing)
    with results.open(writer.part_path) as data:
        assert not data.data_vars
        assert data.attrs["status"].startswith("failed")


def test_what_is_not_a_results_file_is_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(results.ResultsError, match="no such results file"):
        results.open(tmp_path / "none.h5")
