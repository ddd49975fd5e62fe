import json
import math
from collections.abc import Callable
from dataclasses import asdict

import h5py
import numpy as np
import pytest

from tlpsim.orchestrator.coupling_report import ConnectionMeasure
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.document import Cell, Table, Text
from tlpsim.scenarios.report.running import (
    coupling_blocks,
    largest_coupling_errors,
    origin_blocks,
    speed_of,
    timing_blocks,
)
from tlpsim.scenarios.results import Results, open_results

DIGEST = "0123456789abcdef" * 4


def measure(connection: str, interpolation: float, extrapolation: float, samples: int = 100) -> ConnectionMeasure:
    return ConnectionMeasure(
        connection=connection,
        samples=samples,
        deviation=2.0,
        interpolation=interpolation,
        extrapolation=extrapolation,
    )


MEASURES = (
    measure("wave.force.surge -> platform.wave_force.surge", 0.001, math.nan),
    measure("wave.force.pitch -> platform.wave_force.pitch", 0.004, math.nan),
    measure("platform.velocity.yaw -> wind.velocity.yaw", math.nan, 0.2),
    measure("platform.position.yaw -> wind.position.yaw", math.nan, 0.9, samples=0),
)


@pytest.fixture
def ran(written: Callable[..., Results]) -> Results:
    """A run of 100 s in 4 s of wall time, 1 in the wave and 2.5 in the platform."""
    coupling = json.dumps([asdict(each) for each in MEASURES])
    found = written(
        {"wave.elevation": np.zeros(101), "platform.airgap": np.zeros(201)}, wall_time=4.0, coupling=coupling
    )
    with h5py.File(found.path, "a") as file:
        file["wave"].attrs.update({"steps": 100, "wall_time": 1.0, "sha256": DIGEST, "fmu": "C:\\vendor\\wave.fmu"})
        file["platform"].attrs.update({"steps": 200, "wall_time": 2.5})
    return open_results(found.path)


def text(cell: str | Cell) -> str:
    return cell.text if isinstance(cell, Cell) else cell


def test_times_and_shares(ran: Results) -> None:
    *told, table = timing_blocks(cases([ran]))
    assert isinstance(told[0], Text)
    assert told[0].text == "By hand: 100 s in 4.00 s of wall time, 25.0 × real time."
    assert isinstance(table, Table)
    rows = {text(row.heading): [text(cell) for cell in row.cells] for row in table.rows}
    assert rows["wave"] == ["0.500", "100", "1.00", "25.0 %", "10\u202f000"]
    assert rows["platform"][3] == "62.5 %"
    assert rows["master, coupling, recording"][2:4] == ["0.500", "12.5 %"]


def test_no_speed_of_a_run_without_an_end(written: Callable[..., Results]) -> None:
    found = written({"a.y": np.zeros(10)}, status="running")
    assert speed_of(found) == ""
    assert isinstance(timing_blocks(cases([found]))[0], Table)


def test_degrees_of_freedom_are_one_row_with_the_worst(ran: Results) -> None:
    table = coupling_blocks(cases([ran]))[0]
    assert isinstance(table, Table)
    rows = {text(row.heading): row.cells for row in table.rows}
    assert set(rows) == {"wave.force.* → platform.wave_force.*", "platform.velocity.yaw → wind.velocity.yaw"}
    worst = rows["wave.force.* → platform.wave_force.*"][1]
    assert isinstance(worst, Cell)
    assert (worst.text, worst.below) == ("0.40 %", "pitch")
    assert text(rows["platform.velocity.yaw → wind.velocity.yaw"][2]) == "20 %"


def test_largest_errors_to_and_from_the_platform(ran: Results) -> None:
    assert largest_coupling_errors(cases([ran])) == [
        (0.004, "wave.force.pitch → platform.wave_force.pitch"),
        (0.2, "platform.velocity.yaw → wind.velocity.yaw"),
    ]


def test_nothing_measured_is_nothing_told(written: Callable[..., Results]) -> None:
    found = cases([written({"a.y": np.zeros(10)})])
    assert coupling_blocks(found) == []
    assert largest_coupling_errors(found) == []


def test_origins_with_hashes(ran: Results) -> None:
    blocks = origin_blocks(cases([ran]))
    components = next(block for block in blocks if isinstance(block, Table) and block.caption == "Components")
    row = next(row for row in components.rows if row.heading == "wave")
    assert text(row.cells[0]) == "wave.fmu"
    assert isinstance(row.cells[3], Cell)
    assert (row.cells[3].text, row.cells[3].hint) == (f"{DIGEST[:12]}…", DIGEST)
