"""The results file: what a run leaves in it, in full, cut short, and when it cannot be written or read."""

import json
import os
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.orchestrator.execution import RunSummary, run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.system import Component, Connection, System
from tlpsim.scenarios import results_writer
from tlpsim.scenarios.recording import Recording, select_signals
from tlpsim.scenarios.results import ResultsError, is_being_written, open_results
from tlpsim.scenarios.results_writer import ResultsWriter, chunk_length
from tlpsim.scenarios.schema import Scenario

SECOND = 1_000_000_000
DURATION = 300.0


def scenario(**changes: object) -> Scenario:
    return Scenario().with_(simulation={"duration": DURATION}).with_(**changes)


def system(fail_at: float = np.inf) -> System:
    """A clock that counts at 10 Hz, and a source that is stepped ahead of it; both tell their own time."""

    def count(values: Values, time: float, size: float) -> None:
        if time >= fail_at:
            raise StepError("platform: the sea\ntook it")
        values["position.surge"] = time + size
        values["tendon_tension[1]"] += 1.0

    def blow(values: Values, time: float, size: float) -> None:
        values["Fx"] = 2.0 * (time + size)

    clock = PythonInstance(
        "platform",
        count,
        inputs={"wind_force.surge": 0.0},
        outputs={"position.surge": 0.0, "tendon_tension[1]": 0.0, "time": 7.0, "a/b": 8.0},
        units={"position.surge": "m", "tendon_tension[1]": "N"},
    )
    clock.describe = lambda: {"fmu": "clock.fmu", "sha256": "ab" * 32}  # type: ignore[method-assign]
    wind = PythonInstance("wind", blow, outputs={"Fx": 0.0}, units={"Fx": "N"})
    return System(
        components=(Component(instance=wind, step=SECOND), Component(instance=clock, step=SECOND // 10)),
        connections=(
            Connection(source="wind", source_variable="Fx", target="platform", target_variable="wind_force.surge"),
        ),
    )


def write(path: Path, chosen: Scenario, fail_at: float = np.inf) -> ResultsWriter:
    writer = ResultsWriter(path, chosen)
    run(system(fail_at), round(chosen.simulation.duration) * SECOND, observers=[writer])
    return writer


def test_a_run_is_read_back_as_it_was(tmp_path: Path) -> None:
    chosen = scenario(components={"wind": {"map": {"force.surge": "Fx"}}})
    writer = write(tmp_path / "storm.h5", chosen)
    assert not writer.part_path.exists()
    results = open_results(str(tmp_path / "storm.h5"))
    assert results.complete
    assert results.status == "complete"
    assert results.scenario == chosen
    assert results.title == chosen.title
    assert results.seeds == chosen.seeds()
    assert set(results.versions) == {"tlpsim", "numpy", "scipy", "numba", "fmpy", "h5py", "python"}
    assert list(results.components) == ["wind", "platform"]
    # In the order of the component, by the contract's names, "time" and "/" notwithstanding.
    assert results.signals("platform") == ("position.surge", "tendon_tension[1]", "time", "a/b")
    assert results.signals("wind") == ("force.surge",)
    # Times without accumulated error.
    assert len(results.time("platform")) == 3001
    assert np.array_equal(results.time("platform"), np.arange(3001) / 10)
    assert np.array_equal(results.signal("platform.tendon_tension[1]"), np.arange(3001))
    assert np.array_equal(results.signal("platform.position.surge")[1:], np.arange(3000) / 10 + 0.1)
    assert set(results.signal("platform.time")) == {7.0}
    assert set(results.signal("platform.a/b")) == {8.0}
    # The source was stepped past the end for the filter's sake; the file ends with the run.
    assert np.array_equal(results.time("wind"), np.arange(301))
    assert np.array_equal(results.signal("wind.force.surge"), 2.0 * np.arange(301))
    assert results.unit("platform.position.surge") == "m"
    assert results.unit("platform.time") == ""
    attributes = results.components["platform"]
    assert (attributes["fmu"], attributes["step"], attributes["steps"]) == ("clock.fmu", 0.1, 3000)
    assert attributes["wall_time"] > 0.0


def test_the_layout_is_that_of_the_documentation(tmp_path: Path) -> None:
    write(tmp_path / "storm.h5", scenario())
    with h5py.File(tmp_path / "storm.h5") as file:
        assert file.attrs["format"] == "tlpsim results"
        assert file.attrs["schema_version"] == 2
        assert file.attrs["created"].endswith("+00:00")
        assert json.loads(file.attrs["scenario"])["simulation"]["duration"] == DURATION
        surge = file["platform/position.surge"]
        assert surge.dtype == np.float64
        assert surge.dims[0][0] == file["platform/time"]
        assert dict(surge.attrs)["units"] == "m"
        assert (surge.compression, surge.shuffle) == ("gzip", True)
        assert file["wind/Fx"].attrs["long_name"] == ""


def test_netcdf_readers_see_time_as_the_dimension(tmp_path: Path) -> None:
    h5netcdf = pytest.importorskip("h5netcdf")
    write(tmp_path / "storm.h5", scenario())
    with h5netcdf.File(tmp_path / "storm.h5") as file:
        assert file["platform"]["position.surge"].dimensions == ("time",)
        assert file["platform"].dimensions["time"].size == 3001


def test_only_chosen_signals_are_recorded(tmp_path: Path) -> None:
    write(tmp_path / "storm.h5", scenario(outputs={"signals": ["platform.tendon_tension[1]", "*.position.*"]}))
    results = open_results(tmp_path / "storm.h5")
    assert results.signals("platform") == ("position.surge", "tendon_tension[1]")
    assert results.signals("wind") == ()


def test_brackets_in_a_pattern_are_those_of_a_name() -> None:
    names = ["p.tension[1]", "p.tension[12]", "p.tension1"]
    assert select_signals(names, ["p.tension[1]"]) == {"p.tension[1]"}
    assert select_signals(names, ["p.tension[*]"]) == {"p.tension[1]", "p.tension[12]"}
    assert select_signals(names, ["p.tension?", "*2]"]) == {"p.tension1", "p.tension[12]"}
    assert select_signals(names, []) == set()


def test_a_pattern_that_matches_nothing_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"'platform.positon.surge' .* 'platform.position.surge'"):
        write(tmp_path / "storm.h5", scenario(outputs={"signals": ["platform.positon.surge"]}))
    assert not list(tmp_path.iterdir())


def test_a_failed_run_leaves_what_it_had(tmp_path: Path) -> None:
    path = tmp_path / "storm.h5"
    path.write_bytes(b"an older result")
    with pytest.raises(StepError):
        write(path, scenario(), fail_at=250.0)
    assert path.read_bytes() == b"an older result"
    results = open_results(tmp_path / "storm.h5.part")
    assert not results.complete
    assert results.status.startswith("failed: ")
    assert "the sea took it" in results.status
    assert results.time("platform")[-1] == 250.0
    path.unlink()
    with pytest.raises(ResultsError, match=r"did not end, open .*storm\.h5\.part"):
        open_results(path)


def test_an_interrupted_run_says_so(tmp_path: Path) -> None:
    writer = ResultsWriter(tmp_path / "storm.h5", scenario())

    class Interrupt(ResultsWriter):
        def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
            if times[-1] > 10 * SECOND:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(
            system(),
            100 * SECOND,
            observers=[writer, Interrupt(tmp_path / "other.h5", scenario())],
        )
    assert open_results(writer.part_path).status == "failed: KeyboardInterrupt"


KILLED = """
import os, signal, sys
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance
from tlpsim.orchestrator.system import Component, System
from tlpsim.scenarios import results_writer
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario

results_writer.FLUSH_INTERVAL = 0.0
results_writer._FLUSH_SHARE = 1.0

def step(values, time, size):
    values["x"] = time + size
    if time > 250.0:
        if sys.argv[2] == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        print("here", flush=True)
        sys.stdin.readline()

platform = Component(instance=PythonInstance("platform", step, outputs={"x": 0.0}), step=100_000_000)
run(System(components=(platform,)), 3600 * 10**9, observers=[ResultsWriter(sys.argv[1], Scenario())])
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_a_killed_run_can_be_read_up_to_its_last_flush(tmp_path: Path) -> None:
    path = tmp_path / "storm.h5"
    process = subprocess.run([sys.executable, "-c", KILLED, str(path), "kill"], check=False)
    assert process.returncode == -signal.SIGKILL
    check_beginning(path)


def test_a_run_can_be_read_while_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "storm.h5"
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(path), "wait"], stdin=pipe, stdout=pipe)
    assert process.stdout is not None
    assert process.stdout.readline() == b"here\n"
    assert is_being_written(path)
    check_beginning(path)
    process.kill()
    process.communicate()
    assert not is_being_written(path)


def check_beginning(path: Path) -> None:
    """The samples that a run had written when it came to a time of 250 s, all of them right."""
    results = open_results(f"{path}.part")
    assert results.status == "running"
    count = len(results.time("platform"))
    assert 1 < count <= 2502
    assert np.array_equal(results.time("platform"), np.arange(count) / 10)
    assert np.array_equal(results.signal("platform.x")[1:], np.arange(count - 1) / 10 + 0.1)


def test_memory_does_not_grow_with_the_run(tmp_path: Path) -> None:
    """Two hundred thousand samples of twenty signals are 40 MB; a chunk holds 16384 of them, 2.8 MB."""
    outputs = dict.fromkeys([f"x{number}" for number in range(20)], 0.0)
    platform = PythonInstance("platform", lambda values, time, size: None, outputs=outputs)
    writer = ResultsWriter(tmp_path / "storm.h5", Scenario().with_(**{"simulation.duration": "7 h"}))
    writer.started(System(components=(Component(instance=platform, step=SECOND // 10),)))
    values = np.zeros((500, 20))

    def feed(samples: range) -> None:
        for sample in samples[::500]:
            writer.sampled(0, np.arange(sample, sample + 500) * SECOND // 10, values)

    feed(range(20_000))
    tracemalloc.start()
    feed(range(20_000, 200_000))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000


def test_chunks_fill_the_file_and_keep_within_the_memory() -> None:
    assert chunk_length(15, 201) == 201
    assert [chunk_length(15, 16384), chunk_length(15, 16385)] == [16384, 8193]
    assert chunk_length(57, 108_001) == 8308  # 13 chunks of 108 004 samples in all
    assert chunk_length(10_000, 10**9) == 1024
    assert chunk_length(1, 0) == 1


EMPTY = RunSummary(start=0, stop=0, components=(), wall_time=0.0, initialization_sweeps=0, notes=())


def changing(path: Path, samples: int, flush: bool) -> np.ndarray:
    """Record samples of signals that change now and then, of 40000 that the run is to have; return them."""
    chance = np.random.Generator(np.random.Philox(5))
    names = ["steady", "late", "zero", "walk"]
    values = np.zeros((40_000, 4))
    values[:, 0] = 7.0
    values[30_000:, 1] = 1.0
    values[20_000:, 2] = -0.0  # equal to the first value, but for its bits
    values[:, 3] = np.cumsum(chance.standard_normal(40_000))
    component = PythonInstance("c", lambda values, time, size: None, outputs=dict.fromkeys(names, 0.0))
    writer = ResultsWriter(path, Recording(title="Changing", end=39_999 * (SECOND // 10)))
    writer.started(System(components=(Component(instance=component, step=SECOND // 10),)))
    first = 0
    while first < samples:
        count = min(int(chance.integers(1, 3000)), samples - first)
        writer.sampled(0, np.arange(first, first + count) * (SECOND // 10), values[first : first + count])
        first += count
        writer._due = 0.0 if flush else np.inf
    writer.stopped(None, EMPTY)
    return values[:samples]


@pytest.mark.parametrize("samples", [1, 13_334, 13_335, 40_000])
@pytest.mark.parametrize("flush", [False, True])
def test_every_bit_is_kept_whenever_the_file_is_written(tmp_path: Path, samples: int, flush: bool) -> None:
    values = changing(tmp_path / "r.h5", samples, flush)
    results = open_results(tmp_path / "r.h5")
    assert np.array_equal(results.time("c"), np.arange(samples) / 10)
    for column, name in enumerate(results.signals("c")):
        assert results.signal(f"c.{name}").tobytes() == values[:, column].tobytes()


def test_steady_signals_take_no_room(tmp_path: Path) -> None:
    changing(tmp_path / "r.h5", 40_000, flush=True)
    with h5py.File(tmp_path / "r.h5") as file:
        chunks = {name: dataset.id.get_num_chunks() for name, dataset in file["c"].items()}
    assert chunks == {"time": 3, "steady": 0, "late": 1, "zero": 2, "walk": 3}
    assert (tmp_path / "r.h5").stat().st_size < 9 * 8 * 13_334 + 40_000


def test_steady_signals_are_read_by_netcdf(tmp_path: Path) -> None:
    netcdf = pytest.importorskip("netCDF4")
    changing(tmp_path / "r.h5", 40_000, flush=False)
    with netcdf.Dataset(tmp_path / "r.h5") as file:
        steady = file["c"]["steady"]
        assert "_FillValue" not in steady.ncattrs()
        assert not np.ma.is_masked(steady[:])
        assert set(steady[:]) == {7.0}


def test_a_run_without_a_sample_can_be_opened(tmp_path: Path) -> None:
    writer = ResultsWriter(tmp_path / "storm.h5", scenario())
    writer.started(system())
    writer.stopped(StepError("at once"), EMPTY)
    results = open_results(writer.part_path)
    assert results.status == "failed: at once"
    assert list(results.components) == ["wind", "platform"]
    assert results.signals("wind") == ()
    assert results.time("wind").shape == (0,)


def test_a_long_scenario_fits(tmp_path: Path) -> None:
    """An HDF5 attribute of fixed length ends at 64 kB."""
    segment = {"position": [0.0, 0.0, 30.0], "area": 1.0, "shape_coefficient": 1.0}
    chosen = scenario(wind={"segments": [segment] * 2000})
    assert len(chosen.to_json()) > 100_000
    write(tmp_path / "storm.h5", chosen)
    assert open_results(tmp_path / "storm.h5").scenario == chosen


# What cannot be written


def test_destinations_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="there is no folder"):
        ResultsWriter(tmp_path / "none" / "storm.h5", scenario())
    with pytest.raises(ResultsError, match="is a folder"):
        ResultsWriter(tmp_path, scenario())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(ResultsError, match="cannot be written"):
        ResultsWriter(tmp_path / "storm.h5", scenario())


def test_two_runs_do_not_write_one_file(tmp_path: Path) -> None:
    first = ResultsWriter(tmp_path / "storm.h5", scenario())
    first.started(system())
    with pytest.raises(ResultsError, match="cannot be created"):
        ResultsWriter(tmp_path / "storm.h5", scenario()).started(system())


def test_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(group: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results_writer._Group, "store", full)
    with pytest.raises(ResultsError, match=r"storm\.h5\.part: .* cannot be written: .*No space left"):
        write(tmp_path / "storm.h5", scenario())
    assert not (tmp_path / "storm.h5").exists()


def test_without_room_to_compress_the_file_stays_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(source: Path, destination: Path) -> None:
        destination.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results_writer, "pack", full)
    write(tmp_path / "storm.h5", scenario())
    assert [each.name for each in tmp_path.iterdir()] == ["storm.h5"]
    assert open_results(tmp_path / "storm.h5").complete


# What cannot be read


def test_files_that_are_no_results(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match=r"no such results file$"):
        open_results(tmp_path / "none.h5")
    with pytest.raises(ResultsError, match="is a folder"):
        open_results(tmp_path)
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(ResultsError, match="is not an HDF5 file"):
        open_results(tmp_path / "text.h5")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    with pytest.raises(ResultsError, match="not one with results of tlpsim"):
        open_results(tmp_path / "other.h5")


def test_a_newer_layout_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "storm.h5", scenario())
    with h5py.File(tmp_path / "storm.h5", "r+") as file:
        file.attrs["schema_version"] = 3
    with pytest.raises(ResultsError, match=r"version 3 .* up to 2; open it with a newer tlpsim"):
        open_results(tmp_path / "storm.h5")


def test_names_that_are_not_in_the_file(tmp_path: Path) -> None:
    write(tmp_path / "storm.h5", scenario())
    results = open_results(tmp_path / "storm.h5")
    with pytest.raises(ResultsError, match=r"no component 'platfrm' \(did you mean 'platform'\?\)"):
        results.time("platfrm")
    with pytest.raises(ResultsError, match=r"no signal 'position.surg' .* \(did you mean 'position.surge'"):
        results.signal("platform.position.surg")
