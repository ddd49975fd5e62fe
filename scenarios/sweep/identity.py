"""What cases and jobs are recognised by: hashes of all that their results depend on; and seeds from them.

A case's key is the hash of its whole scenario but for title and seeds, with the contents of the files that it names in
place of their names; a job's is that of the case, the domain, the seeds, what statistics are taken, and the version of
tlpsim. Neither depends on where in a sweep, or in which, the case stands.

The seeds of a record are the first two numbers, of the Philox stream whose key is the hash of case and record, that no
other record of the sweep has; records that want the same number get it in the order of their hashes. So no two records
share a stream of random numbers, and a record keeps its seeds when cases are added to the sweep, but for the rare one
whose number an added case has first.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import BUILTIN, LARGEST_SEED
from tlpsim.scenarios.sweep.sections import Statistics

ROW_VERSION = 1
"""Of the numbers that a finished job leaves; another one makes all jobs new."""
KEY_LENGTH = 32
"""Characters of a key: 128 bits."""


def digest(*parts: object) -> str:
    """Hash of parts that JSON can hold, 32 hexadecimal digits."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:KEY_LENGTH]


def named_files(scenario: Scenario) -> tuple[Path, ...]:
    """Files that a scenario names: FMUs, tables, hydrodynamic database, quadratic transfer function."""
    names = [entry.fmu for entry in scenario.components.values() if not entry.fmu.startswith(BUILTIN)]
    if scenario.platform.hydrodynamics.endswith(".h5"):
        names.append(scenario.platform.hydrodynamics)
    if scenario.waves.quadratic_transfer is not None:
        names.append(scenario.waves.quadratic_transfer)
    return tuple(map(Path, dict.fromkeys(names)))


def file_digest(path: Path) -> str:
    """Hash of a file's content.

    Raises
    ------
    ScenarioError
        When it cannot be read.
    """
    try:
        state = path.stat()
        return _content_digest(str(path), state.st_mtime_ns, state.st_size)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read ({error.strerror}); the scenario names it") from None


@lru_cache(maxsize=256)
def _content_digest(path: str, changed: int, size: int) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:KEY_LENGTH]


def case_key(scenario: Scenario) -> str:
    """Key of a scenario, whatever its title and seeds."""
    content = scenario.model_dump(mode="json", by_alias=True)
    content["title"] = ""
    content["simulation"]["seed"] = content["wind"]["seed"] = content["waves"]["seed"] = None
    contents = {str(path): file_digest(path) for path in named_files(scenario)}
    text = json.dumps(content, sort_keys=True)
    for name, found in contents.items():
        text = text.replace(json.dumps(name), json.dumps(f"sha256:{found}"))
    return hashlib.sha256(text.encode()).hexdigest()[:KEY_LENGTH]


def job_key(
    case: str, domain: str, statistics: Statistics, engine: str = "", seeds: tuple[int, int] | None = None
) -> str:
    """Key of a job of a case."""
    return digest(ROW_VERSION, program_version(), case, domain, statistics.model_dump(mode="json"), engine, seeds)


@cache
def program_version() -> str:
    """Version of tlpsim, by which workers of another one are recognised."""
    return importlib.metadata.version("tlpsim")


def record_seeds(records: Sequence[tuple[str, int]], seed: int) -> list[tuple[int, int]]:
    """Seeds of wind and waves, from 1 to 2^31 - 1, for each record of a sweep; all of them differ.

    Parameters
    ----------
    records
        Key of the case, and number of the record; no two are the same.
    seed
        Of the sweep.
    """
    hashes = [digest("record", seed, *record) for record in records]
    taken: set[int] = set()
    found: list[tuple[int, int]] = [(0, 0)] * len(records)
    for place in sorted(range(len(records)), key=hashes.__getitem__):
        chosen: list[int] = []
        for candidate in _candidates(hashes[place]):
            if candidate not in taken:
                taken.add(candidate)
                chosen.append(candidate)
                if len(chosen) == 2:
                    break
        found[place] = chosen[0], chosen[1]
    return found


def _candidates(key: str) -> Iterator[int]:
    """Numbers from 1 to 2^31 - 1, of the Philox stream of a hash."""
    stream = np.random.Philox(key=int(key, 16))
    while True:
        for word in stream.random_raw(4).tolist():
            yield word % LARGEST_SEED + 1
