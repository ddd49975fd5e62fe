"""A ledger keeps outcomes bit for bit, alone, through kills, and refuses what is not its own."""

import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.sweep.job import TOKEN, Outcome
from tlpsim.scenarios.sweep.ledger import NAME, Layout, ledger

Make = Callable[..., Outcome]


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 2**64 - 1), max_size=20), st.text(max_size=20).filter(str.isprintable))
def test_numbers_come_back_bit_for_bit(bits: list[int], text: str) -> None:
    values = np.array(bits, dtype=np.uint64).view(np.float64)
    names = tuple(f"{text}.{k}" for k in range(len(bits)))
    given_ = Outcome(
        key="a", notes=text, names=names, units=("m",) * len(bits), values=values, file=text, seconds=0.1 + 0.2
    )
    with tempfile.TemporaryDirectory() as folder:
        with ledger(Path(folder)) as book:
            book.record([given_])
        with ledger(Path(folder)) as book:
            (found,) = book.finished(["a"])
            layout = book.layouts()[found.layout]
    assert found.values.tobytes() == values.tobytes()
    assert (found.notes, found.file, found.error, found.seconds) == (text, text, "", 0.1 + 0.2)
    assert layout == Layout(names=names, units=("m",) * len(bits))


@pytest.mark.parametrize("value", [np.nan, -0.0, 5e-324, 2.3e-308, np.inf, -np.inf, 1.7976931348623157e308])
def test_odd_numbers(value: float, tmp_path: Path, outcome: Make) -> None:
    with ledger(tmp_path) as book:
        book.record([outcome("a", {"x.mean": value})])
        (found,) = book.finished(["a"])
    assert found.values.tobytes() == np.array([value]).tobytes()


def test_jobs_come_in_the_order_of_the_keys(tmp_path: Path, outcome: Make) -> None:
    keys = [f"{number:05d}" for number in range(1203)]
    with ledger(tmp_path) as book:
        book.record(outcome(key, {"x.mean": float(key)}) for key in keys)
        wanted = [*keys[::-1], "not there"]
        found = list(book.finished(wanted))
        assert [each.key for each in found] == keys[::-1]
        assert [each.values.item() for each in found] == [float(key) for key in keys[::-1]]
        assert book.errors(wanted) == dict.fromkeys(keys, "")
        assert list(book.finished([])) == []
        assert book.errors([]) == {}


def test_names_are_kept_once(tmp_path: Path, outcome: Make) -> None:
    with ledger(tmp_path) as book:
        book.record([outcome("a", {"x.mean": 1.0}), outcome("b", {"x.mean": 2.0}), outcome("c", {"x.std": 2.0})])
    with ledger(tmp_path) as book:
        book.record([outcome("d", {"x.mean": 3.0}), outcome("e", {"x.mean": 3.0}, unit="N")])
        numbers = {each.key: each.layout for each in book.finished(list("abcde"))}
        assert numbers["a"] == numbers["b"] == numbers["d"]
        assert len(set(numbers.values())) == len(book.layouts()) == 3


def test_a_job_that_is_done_again_replaces_its_error(tmp_path: Path, outcome: Make) -> None:
    with ledger(tmp_path) as book:
        book.record([outcome("a", error="first"), outcome("b", {"x.mean": 1.0})])
        assert book.errors(["a", "b", "c"]) == {"a": "first", "b": ""}
        (failed,) = book.finished(["a"])
        assert (failed.error, failed.layout, len(failed.values)) == ("first", 0, 0)
        book.record([outcome("a", {"x.mean": 2.0})])
        (done,) = book.finished(["a"])
        assert (done.error, done.values.item()) == ("", 2.0)


# Whose folder it is


def test_a_second_sweep_is_refused(tmp_path: Path, outcome: Make) -> None:
    with ledger(tmp_path) as book:
        book.record([outcome("a", {"x.mean": 1.0})])
        with pytest.raises(ResultsError, match="another sweep is writing there; wait for its end"), ledger(tmp_path):
            pass
        assert (tmp_path / TOKEN).read_text() == book.token
        book.record([outcome("b", {"x.mean": 1.0})])
    with ledger(tmp_path) as again:
        assert again.token != book.token
        assert (tmp_path / TOKEN).read_text() == again.token
        assert set(again.errors(["a", "b"])) == {"a", "b"}


def test_a_folder_of_other_things_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(ResultsError, match="holds files that are not of a sweep: give a folder that is empty"):
        ledger(tmp_path).__enter__()
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_folders_are_made(tmp_path: Path) -> None:
    with ledger(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b" / NAME).is_file()


def test_what_a_sweep_was_stopped_before_its_ledger_leaves_is_taken(tmp_path: Path) -> None:
    (tmp_path / TOKEN).write_text("old")
    with ledger(tmp_path) as book:
        assert book.token != "old"


def test_the_folder_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ResultsError, match="give another folder for the sweep"), ledger(place):
            pass


@pytest.fixture
def as_nobody() -> Iterator[Path]:
    """A folder that is open to all, in a process that is not the administrator's, who may write everywhere."""
    administrator = os.geteuid() == 0
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o777)
        if administrator:
            os.seteuid(65534)
        try:
            yield Path(folder)
        finally:
            if administrator:
                os.seteuid(0)


def test_a_folder_that_may_not_be_written(as_nobody: Path) -> None:
    folder = as_nobody / "sweep"
    folder.mkdir()
    folder.chmod(0o555)
    with pytest.raises(ResultsError, match="Permission denied; give another folder"), ledger(folder):
        pass
    with pytest.raises(ResultsError, match="Permission denied; give another folder"), ledger(folder / "below"):
        pass


def test_a_ledger_that_may_not_be_written(as_nobody: Path, outcome: Make) -> None:
    with ledger(as_nobody):
        pass
    (as_nobody / NAME).chmod(0o444)
    with pytest.raises(ResultsError, match="cannot be used"), ledger(as_nobody) as book:
        book.record([outcome("a", {"x.mean": 1.0})])


# Damage


def _filled(folder: Path, outcome: Make) -> Path:
    with ledger(folder) as book:
        book.record(outcome(f"{number:04d}", {f"x{k}.mean": float(k) for k in range(50)}) for number in range(200))
    return folder / NAME


def test_a_file_that_is_no_ledger(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text("this is no database, but long enough to be looked at as one " * 20)
    with pytest.raises(ResultsError, match=r"ledger\.sqlite: cannot be used \(file is not a database\)"):
        ledger(tmp_path).__enter__()


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_half_a_ledger(part: float, tmp_path: Path, outcome: Make) -> None:
    path = _filled(tmp_path, outcome)
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(ResultsError, match="it may be damaged"):
        _use(tmp_path, outcome)


def _use(folder: Path, outcome: Make) -> None:
    """Read and write every row."""
    keys = [f"{number:04d}" for number in range(200)]
    with ledger(folder) as book:
        list(book.finished(keys))
        book.record([outcome(key, {"x.mean": 1.0}) for key in keys])


def test_a_ledger_of_a_newer_version(tmp_path: Path, outcome: Make) -> None:
    path = _filled(tmp_path, outcome)
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    before = path.read_bytes()
    with pytest.raises(ResultsError, match="is of version 99 and this tlpsim knows 1; take a newer tlpsim"):
        ledger(tmp_path).__enter__()
    assert path.read_bytes() == before


def test_an_error_in_the_sweep_keeps_what_is_done(tmp_path: Path, outcome: Make) -> None:
    def interrupted() -> None:
        with ledger(tmp_path) as book:
            book.record([outcome("a", {"x.mean": 1.0})])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        interrupted()
    with ledger(tmp_path) as book:
        assert book.errors(["a"]) == {"a": ""}


WRITER = """
import sys
from pathlib import Path
import numpy as np
from tlpsim.scenarios.sweep.job import Outcome
from tlpsim.scenarios.sweep.ledger import ledger

with ledger(Path(sys.argv[1])) as book:
    for number in range(10**9):
        values = np.full(100, float(number))
        names = tuple(f"x{k}.mean" for k in range(100))
        book.record([Outcome(key=f"{number:06d}", names=names, units=("m",) * 100, values=values, seconds=0.0)])
        if number % 7 == 6:
            book.commit()
            print(number, flush=True)
"""


def test_a_kill_loses_nothing_that_was_committed(tmp_path: Path) -> None:
    folder = tmp_path / "sweep"
    with subprocess.Popen([sys.executable, "-c", WRITER, str(folder)], stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        told = [int(writer.stdout.readline()) for _ in range(20)]
        writer.send_signal(signal.SIGKILL)
        told += [int(line) for line in writer.stdout.read().split()[:-1]]  # the last may be half a line
    assert writer.returncode == -signal.SIGKILL
    keys = [f"{number:06d}" for number in range(max(told) + 1000)]
    with ledger(folder) as book:
        found = list(book.finished(keys))
    assert len(found) > max(told)
    assert [each.key for each in found] == keys[: len(found)]
    for number, each in enumerate(found):
        assert np.all(each.values == float(number))
        assert len(each.values) == 100
