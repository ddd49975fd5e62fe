"""Tables of signals as components: reading, interpolation, ends, state."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.errors import FmuError, StepError, WiringError
from tlpsim.orchestrator.checkpoint import Checkpoints, read
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance
from tlpsim.orchestrator.observers import MemoryRecorder, Observer
from tlpsim.orchestrator.system import Component, Connection, System
from tlpsim.orchestrator.table import TableInstance, read_table, write_table

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND


def written(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text)
    return path


def values_at(instance: TableInstance, times: list[float], **parameters: object) -> list[list[float]]:
    instance.set_parameters(parameters)
    instance.bind([], list(instance.table.names))
    instance.enter_initialization(times[0])
    instance.exit_initialization()
    found = [np.empty(len(instance.table.names))]
    instance.get_outputs(found[0])
    for before, after in pairwise(times):
        instance.step(before, after - before)
        found.append(np.empty(len(instance.table.names)))
        instance.get_outputs(found[-1])
    return [row.tolist() for row in found]


def test_head_units_and_what_is_passed_over(tmp_path: Path) -> None:
    head = '\ufeff# made by hand\ntime [ms]; force.surge [kN];x[1]; x[2] [m] ;"a ; b [kN.m]"\n\n'
    text = head + "0;1;2;3;4\n# middle\n500;5;6;7;8\n"
    table = read_table(written(tmp_path, text))
    assert table.names == ("force.surge", "x[1]", "x[2]", "a ; b")
    assert table.units == ("kN", None, "m", "kN.m")
    assert table.ticks.tolist() == [0, 500 * MILLISECOND]
    assert table.values.tolist() == [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]
    assert table.step == 0.5
    assert read_table(written(tmp_path, "t\ty\n0\t1\n1\t1\n3\t1\n")).step is None


MALFORMED = {
    "no numbers": ("time [s], y\n0, 1\n", "1 lines of numbers; give a head and two or more"),
    "no time": ("y [m], time\n0, 1\n1, 2\n", r"line 1: the first column is 'y \[m\]'; it must be the time"),
    "unit of time": ("time [m], y\n0, 1\n1, 2\n", "line 1: the first column is"),
    "no column": ("time [s]\n0\n1\n", "line 1: there is no column beside the time"),
    "twice": ("time [s], y, y [m]\n0, 1, 1\n1, 2, 2\n", "line 1: there are two columns 'y'"),
    "nameless": ("time [s], [m]\n0, 1\n1, 2\n", "line 1: column 2 has no name"),
    "short line": ("time, y\n0, 1\n# two\n1\n", "line 4: 1 columns, and the first line has 2"),
    "text": ("time, y\n0, 1\n\n1, much\n", "line 4: column 2 is 'much', not a finite number"),
    "not finite": ("time, y\n0, 1\n1, nan\n", "line 3: column 2 is 'nan', not a finite number"),
    "order": ("time, y\n0, 1\n2, 1\n2, 1\n", "line 4: the time 2 does not come after 2"),
    "parameter": ("time, beyond\n0, 1\n2, 1\n", "a column is called 'beyond', which is a parameter"),
}


@pytest.mark.parametrize("fault", MALFORMED)
def test_malformed_files_are_named_with_the_line(tmp_path: Path, fault: str) -> None:
    text, message = MALFORMED[fault]
    with pytest.raises(FmuError, match=message) as caught:
        TableInstance("wind", written(tmp_path, text))
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match="the table cannot be opened: No such file"):
        read_table(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"time, y\xff\n")
    with pytest.raises(FmuError, match="not text in UTF-8"):
        read_table(tmp_path / "b.csv")


def test_interpolation_at_uneven_times(tmp_path: Path) -> None:
    """A cubic polynomial is its own spline; a line is its own line; held values wait for their time."""
    times = np.array([0.0, 0.4, 1.0, 1.1, 2.5, 4.0])
    write_table(tmp_path / "t.csv", times, {"line": 3.0 - 2.0 * times, "cube": times**3 - times}, {"line": "kN"})
    asked = [0.0, 0.3, 0.4, 1.05, 1.9, 2.5, 3.9]
    for name in ("linear", "cubic"):
        found = np.array(values_at(TableInstance("t", tmp_path / "t.csv"), asked, interpolation=name))
        np.testing.assert_allclose(found[:, 0], 3.0 - 2.0 * np.array(asked), atol=1e-14)
        if name == "cubic":
            np.testing.assert_allclose(found[:, 1], np.array(asked) ** 3 - asked, atol=1e-12)
    held = np.array(values_at(TableInstance("t", tmp_path / "t.csv"), asked, interpolation="hold"))
    np.testing.assert_array_equal(held[:, 0], 3.0 - 2.0 * np.array([0.0, 0.0, 0.4, 1.0, 1.1, 2.5, 2.5]))


def test_beyond_the_ends(tmp_path: Path) -> None:
    path = written(tmp_path, "time [s], y\n1, 10\n2, 20\n")
    assert values_at(TableInstance("t", path), [0.0, 1.0, 1.5, 2.0, 5.0]) == [[10.0], [10.0], [15.0], [20.0], [20.0]]
    with pytest.raises(StepError, match=r"t = 2.5 s is beyond the table .*table.csv, which goes from 1 to 2 s; "):
        values_at(TableInstance("t", path), [1.0, 2.0, 2.5], beyond="error")
    with pytest.raises(StepError, match="t = 0 s is beyond"):
        values_at(TableInstance("t", path), [0.0], beyond="error")
    with pytest.raises(WiringError, match="parameter 'beyond' = 'zero' is not one of hold, error"):
        TableInstance("t", path).set_parameters({"beyond": "zero"})


def test_a_written_table_is_read_to_the_last_bit(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    times, values = np.cumsum(random.uniform(0.1, 0.2, 50)).round(9), random.normal(size=50) * 1e6
    write_table(tmp_path / "t.csv", times, {"y": values}, {"y": "N"})
    table = read_table(tmp_path / "t.csv")
    assert table.values[:, 0].tobytes() == values.tobytes()
    assert table.units == ("N",)
    with pytest.raises(FmuError, match=r"'y' has the shape \(2,\), and the times \(3,\)"):
        write_table(tmp_path / "t.csv", [0.0, 1.0, 2.0], {"y": [1.0, 2.0]})


def driven(path: Path) -> System:
    """A table in kN and an integrator in N."""

    def integrate(values: dict[str, float], time: float, size: float) -> None:
        values["y"] += size * values["u"]

    body = PythonInstance("body", integrate, inputs={"u": 0.0}, outputs={"y": 0.0}, units={"u": "N"})  # type: ignore[arg-type]
    return System(
        components=(
            Component(
                instance=TableInstance("load", path), step=500 * MILLISECOND, parameters={"interpolation": "cubic"}
            ),
            Component(instance=body, step=100 * MILLISECOND),
        ),
        connections=(Connection(source="load", source_variable="f", target="body", target_variable="u"),),
    )


def test_a_table_feeds_a_component_of_another_rate_and_unit(tmp_path: Path) -> None:
    times = np.arange(0.0, 12.0, 0.5)
    write_table(tmp_path / "t.csv", times, {"f": np.sin(times)}, {"f": "kN"})
    recorder = MemoryRecorder()
    run(driven(tmp_path / "t.csv"), 10 * SECOND, observers=[recorder])
    # each step adds 0.1 s of the sine at its end; the first samples have the padding of the table's beginning
    added = np.diff(recorder.signal("body", "y"))
    np.testing.assert_allclose(added[20:], 100.0 * np.sin(recorder.times("body")[21:]), atol=0.05)


class _Stop(Observer):
    """Ends a run at 5 s."""

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] >= 5 * SECOND:
            raise KeyboardInterrupt


def test_a_run_goes_on_from_a_checkpoint(tmp_path: Path) -> None:
    times = np.arange(0.0, 12.0, 0.5)
    write_table(tmp_path / "t.csv", times, {"f": np.sin(times)}, {"f": "kN"})
    whole, again = MemoryRecorder(), MemoryRecorder()
    run(driven(tmp_path / "t.csv"), 10 * SECOND, observers=[whole])
    path, every = tmp_path / "run.checkpoint", SECOND
    with pytest.raises(KeyboardInterrupt):
        run(driven(tmp_path / "t.csv"), 10 * SECOND, observers=[_Stop()], checkpoints=Checkpoints(path, every))
    resumed = Checkpoints(path, every, resumed=read(path))
    run(driven(tmp_path / "t.csv"), 10 * SECOND, observers=[again], checkpoints=resumed)
    assert again.values("body").tobytes() == whole.values("body").tobytes()
    assert again.values("load").tobytes() == whole.values("load").tobytes()


def test_state_is_the_time(tmp_path: Path) -> None:
    instance = TableInstance("t", written(tmp_path, "time [s], y\n0, 0\n10, 10\n"))
    values_at(instance, [0.0, 1.0, 4.0])
    state = instance.deserialize_state(instance.serialize_state(instance.get_state()))
    instance.step(4.0, 2.0)
    instance.set_state(state)
    into = np.empty(1)
    instance.get_outputs(into)
    assert into.tolist() == [4.0]
    with pytest.raises(StepError, match="3 bytes are not the state of a table"):
        instance.deserialize_state(b"abc")
    with pytest.raises(StepError, match="str is not a state"):
        instance.set_state("x")
