"""What is done of a sweep, in its folder: an SQLite file with a row a finished job, found by the job's key.

The numbers of a job are kept as they are, 8 bytes each, and their names once for all jobs that have the same. Rows are
committed every half second, so that a kill loses no more than that, and never half a row. One sweep at a time writes.
"""

from __future__ import annotations

import fcntl
import json
import sqlite3
import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.sweep.job import TOKEN, Outcome

NAME = "ledger.sqlite"
_FORMAT = 1
_COMMIT = 0.5  # s between two
_MOST_KEYS = 500  # of one question
_SCHEMA = """
CREATE TABLE IF NOT EXISTS layouts (id INTEGER PRIMARY KEY, names TEXT UNIQUE);
CREATE TABLE IF NOT EXISTS jobs (
    key TEXT PRIMARY KEY, error TEXT, notes TEXT, layout INTEGER, row BLOB, file TEXT, seconds REAL
) WITHOUT ROWID;
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Names "SIGNAL.STATISTIC" of a row of numbers, and the unit of each signal."""

    names: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A finished job: its error ("" for none), warnings, layout and numbers (none of a failed one), file, and time."""

    key: str
    error: str
    notes: str
    layout: int
    values: NDArray[np.float64]
    file: str
    seconds: float


class Ledger:
    """Finished jobs of a folder; see `ledger`."""

    def __init__(self, connection: sqlite3.Connection, token: str) -> None:
        self._connection = connection
        self._layouts: dict[str, int] = {
            names: number for number, names in connection.execute("SELECT id, names FROM layouts")
        }
        self._committed = monotonic()
        self.token = token

    def record(self, outcomes: Iterable[Outcome]) -> None:
        """Keep outcomes; they are safe from a kill within half a second, or at `commit`."""
        rows = []
        for each in outcomes:
            layout = self._layout(json.dumps([each.names, each.units])) if not each.error else None
            content = np.asarray(each.values, dtype="<f8").tobytes()
            rows.append((each.key, each.error, each.notes, layout, content, each.file, each.seconds))
        self._connection.executemany("INSERT OR REPLACE INTO jobs VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
        if monotonic() - self._committed > _COMMIT:
            self.commit()

    def commit(self) -> None:
        """Make everything safe that was recorded."""
        self._connection.commit()
        self._committed = monotonic()

    def errors(self, keys: Sequence[str]) -> dict[str, str]:
        """Error of each of the jobs that is finished, "" where it went well."""
        found: dict[str, str] = {}
        for part in _parts(keys):
            marks = ",".join("?" * len(part))
            found.update(self._connection.execute(f"SELECT key, error FROM jobs WHERE key IN ({marks})", part))
        return found

    def layouts(self) -> dict[int, Layout]:
        """Layouts by their numbers."""
        found = {}
        for number, text in self._connection.execute("SELECT id, names FROM layouts"):
            names, units = json.loads(text)
            found[number] = Layout(names=tuple(names), units=tuple(units))
        return found

    def finished(self, keys: Sequence[str]) -> Iterator[Finished]:
        """Jobs that are finished, in the order of the keys."""
        columns = "key, error, notes, layout, row, file, seconds"
        for part in _parts(keys):
            marks = ",".join("?" * len(part))
            rows = {
                row[0]: row
                for row in self._connection.execute(f"SELECT {columns} FROM jobs WHERE key IN ({marks})", part)
            }
            for key in part:
                if key in rows:
                    _, error, notes, layout, content, file, seconds = rows[key]
                    yield Finished(
                        key=key,
                        error=error,
                        notes=notes,
                        layout=layout or 0,
                        values=np.frombuffer(content, dtype="<f8"),
                        file=file,
                        seconds=seconds,
                    )

    def _layout(self, names: str) -> int:
        if names not in self._layouts:
            cursor = self._connection.execute("INSERT INTO layouts (names) VALUES (?)", (names,))
            assert cursor.lastrowid is not None  # of an insertion
            self._layouts[names] = cursor.lastrowid
        return self._layouts[names]


def _parts(keys: Sequence[str]) -> Iterator[list[str]]:
    for first in range(0, len(keys), _MOST_KEYS):
        yield list(keys[first : first + _MOST_KEYS])


@contextmanager
def ledger(folder: Path) -> Iterator[Ledger]:
    """The ledger of a sweep's folder, both of which are made where they are not; nobody else may have it meanwhile.

    Raises
    ------
    ResultsError
        When the folder holds other things, cannot be written, is in use by another sweep, or its ledger is damaged or
        of a newer version.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / NAME
        if not path.exists() and any(entry.name != TOKEN for entry in folder.iterdir()):
            raise ResultsError(
                f"{folder}: holds files that are not of a sweep: give a folder that is empty or not there"
            )
        with (folder / TOKEN).open("a+", encoding="utf-8") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise ResultsError(
                    f"{folder}: another sweep is writing there; wait for its end, or give another folder"
                ) from None
            lock.truncate(0)
            token = uuid.uuid4().hex
            lock.write(token)
            lock.flush()
            with closing(sqlite3.connect(path)) as connection:
                _require_version(connection, path)
                connection.executescript(_SCHEMA)
                found = Ledger(connection, token)
                try:
                    yield found
                finally:
                    found.commit()
    except OSError as error:
        raise ResultsError(f"{folder}: {error.strerror or error}; give another folder for the sweep") from None
    except sqlite3.Error as error:
        raise ResultsError(
            f"{folder / NAME}: cannot be used ({error}); it may be damaged, or the disk full: free some room, or give "
            "another folder for the sweep"
        ) from None


def _require_version(connection: sqlite3.Connection, path: Path) -> None:
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version > _FORMAT:
        raise ResultsError(f"{path}: is of version {version} and this tlpsim knows {_FORMAT}; take a newer tlpsim")
    connection.execute(f"PRAGMA user_version = {_FORMAT}")
