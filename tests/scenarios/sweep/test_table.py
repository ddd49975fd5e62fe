"""The summary of hand-made jobs: columns, what failed rows hold, and the file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas
import pyarrow
import pyarrow.parquet
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.sweep.job import Outcome
from tlpsim.scenarios.sweep.ledger import ledger
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.table import NAME, SweepTable, read_table, summary_table, write_table

Make = Callable[..., Outcome]

TEXT = """
title = "Hand-made"
domains = ["frequency", "time"]
[replicates]
records = 2
[statistics]
exposure = "1 h"
[[cases]]
name = "calm"
probability = 0.6
wind.speed = 1
wind.profile = "api"
[[cases]]
name = "impossible"
probability = 0.1
wind.speed = -1
[[cases]]
name = "storm"
probability = 0.3
platform.damping_ratios = [0, 0, 0.1, 0, 0, 0]
"""


def numbers_of(case: int, replicate: int) -> dict[str, float]:
    """Numbers of a row, some of which the domains share."""
    base = 100.0 * case + 10.0 * replicate
    if replicate == 0:
        return {"p.surge.mean": base, "p.surge.std": base + 1, "p.t[1].mean": base + 2, "p.t[1].bandwidth": base + 3}
    return {
        "p.surge.mean": base,
        "p.surge.mean.low": base - 1,
        "p.surge.std": base + 1,
        "p.surge.weibull.scale": base + 4,
        "p.t[1].mean": base + 2,
    }


def table_of(sweep: Sweep, folder: Path, outcome: Make, turned: bool = False) -> SweepTable:
    """Summary of a sweep whose first record of the last case failed and whose last one is not there."""
    plan = sweep.plan()
    done = [outcome(job.key, numbers_of(job.case, job.replicate), notes="a\nb", file=job.key) for job in plan.jobs]
    done[-2] = outcome(plan.jobs[-2].key, error="it broke")
    with ledger(folder) as book:
        if turned:
            book.record([outcome(plan.jobs[0].key, error="once"), *done[-2::-1]])
        else:
            book.record(done[:-1])
        return summary_table(sweep, plan, plan.jobs, book)


@pytest.fixture
def table(sweep_of: Callable[..., Sweep], tmp_path: Path, outcome: Make) -> SweepTable:
    return table_of(sweep_of(TEXT), tmp_path / "sweep", outcome)


def test_rows_are_jobs_in_the_order_of_cases(table: SweepTable) -> None:
    columns = table.columns
    assert columns["case"].tolist() == [0, 0, 0, 1, 2, 2]
    assert columns["domain"].tolist() == ["frequency", "time", "time", "frequency", "frequency", "time"]
    assert columns["replicate"].tolist() == [0, 1, 2, 0, 0, 1]
    assert columns["status"].tolist() == ["done", "done", "done", "failed", "done", "failed"]
    assert columns["name"].tolist() == ["calm"] * 3 + ["impossible"] + ["storm"] * 2
    assert columns["probability"].tolist() == [0.6] * 3 + [0.1] + [0.3] * 2
    assert columns["notes"].tolist() == ["a\nb"] * 3 + ["", "a\nb", ""]
    assert (table.rows, table.failed, table.planned) == (6, 2, 7)


def test_failed_rows_have_their_error_and_no_numbers(table: SweepTable) -> None:
    error = table.columns["error"]
    assert error[5] == "it broke"
    assert "wind.speed = -1" in error[3]
    assert error[[0, 1, 2, 4]].tolist() == [""] * 4
    for name, column in table.columns.items():
        if name.startswith("p."):
            assert np.isnan(column[[3, 5]]).all()
    assert table.columns["case_key"][3] == ""
    assert table.columns["wind_seed"][[0, 3]].tolist() == [0, 0]
    seeds = table.columns["wind_seed"][[1, 2, 5]].tolist() + table.columns["wave_seed"][[1, 2, 5]].tolist()
    assert len(set(seeds)) == 6
    assert min(seeds) > 0


def test_numbers_stand_in_their_rows(table: SweepTable) -> None:
    for row in (0, 1, 2, 4):
        case, replicate = int(table.columns["case"][row]), int(table.columns["replicate"][row])
        wanted = numbers_of(case, replicate)
        found = {name: column[row] for name, column in table.columns.items() if name.startswith("p.")}
        assert {name: value for name, value in found.items() if not np.isnan(value)} == wanted


def test_statistics_of_a_signal_stand_together(table: SweepTable) -> None:
    statistics = [name for name in table.columns if name.startswith("p.")]
    assert statistics == [
        "p.surge.mean",
        "p.surge.std",
        "p.surge.mean.low",
        "p.surge.weibull.scale",
        "p.t[1].mean",
        "p.t[1].bandwidth",
    ]
    assert table.units == {"p.surge": "m", "p.t[1]": "m"}
    assert table.statistic("p.surge", "std")[0] == 1.0
    assert np.isnan(table.statistic("p.surge", "none")).all()
    assert len(table.statistic("p.surge", "none")) == 6


def test_keys_are_numbers_or_text(table: SweepTable) -> None:
    assert table.keys == ("wind.speed", "wind.profile", "platform.damping_ratios")
    assert table.columns["wind.speed"].tolist() == [1.0] * 3 + [-1.0] + [26.9] * 2
    assert table.columns["wind.profile"].tolist() == ["api"] * 3 + ["logarithmic"] * 3
    assert table.columns["platform.damping_ratios"][5] == "[0, 0, 0.1, 0, 0, 0]"
    assert table.columns["platform.damping_ratios"][0] == "[0.0, 0.0, 0.02, 0.02, 0.02, 0.0]"


def same(one: SweepTable, other: SweepTable) -> None:
    for name in (
        "title",
        "keys",
        "weighted",
        "units",
        "duration",
        "exposure",
        "slope",
        "long_term",
        "notes",
        "planned",
    ):
        assert getattr(one, name) == getattr(other, name)
    assert [dict(each) for each in one.variants] == [dict(each) for each in other.variants]
    assert list(one.columns) == list(other.columns)
    for name, column in one.columns.items():
        assert column.dtype == other.columns[name].dtype
        np.testing.assert_array_equal(column, other.columns[name])


def test_a_file_gives_the_table_back(table: SweepTable, tmp_path: Path) -> None:
    write_table(table, tmp_path / "new" / NAME)
    same(read_table(tmp_path / "new" / NAME), table)
    same(read_table(tmp_path / "new"), table)
    assert table.exposure == 3600.0


def test_the_same_numbers_are_the_same_bytes(
    table: SweepTable, sweep_of: Callable[..., Sweep], tmp_path: Path, outcome: Make
) -> None:
    other = table_of(sweep_of(TEXT), tmp_path / "other", outcome, turned=True)
    write_table(table, tmp_path / "one.parquet")
    write_table(other, tmp_path / "two.parquet")
    write_table(read_table(tmp_path / "one.parquet"), tmp_path / "three.parquet")
    content = (tmp_path / "one.parquet").read_bytes()
    assert (tmp_path / "two.parquet").read_bytes() == content
    assert (tmp_path / "three.parquet").read_bytes() == content


def test_pandas_reads_it(table: SweepTable, tmp_path: Path) -> None:
    write_table(table, tmp_path / NAME)
    frame = pandas.read_parquet(tmp_path / NAME)
    assert list(frame.columns) == list(table.columns)
    done = frame[frame["status"] == "done"]
    assert done["p.surge.mean"].tolist() == [0.0, 10.0, 20.0, 200.0]
    assert frame.groupby("domain")["p.t[1].mean"].max().to_dict() == {"frequency": 202.0, "time": 22.0}


def test_a_sweep_without_a_job_that_is_done(sweep_of: Callable[..., Sweep], tmp_path: Path) -> None:
    sweep = sweep_of("[grid]\nwind.speed = [1, 2]")
    plan = sweep.plan()
    with ledger(tmp_path / "sweep") as book:
        table = summary_table(sweep, plan, plan.jobs, book)
    assert (table.rows, table.planned, table.failed) == (0, 2, 0)
    write_table(table, tmp_path / NAME)
    same(read_table(tmp_path / NAME), table)


# Other files


def test_no_summary(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match=r"summary\.parquet: no such file; make one by `tlpsim sweep"):
        read_table(tmp_path)


@pytest.mark.parametrize("content", [b"", b"PAR1", b"this is text and no table at all" * 10])
def test_damaged_summary(content: bytes, tmp_path: Path) -> None:
    (tmp_path / NAME).write_bytes(content)
    with pytest.raises(ResultsError, match="cannot be read as the summary of a sweep"):
        read_table(tmp_path)


@pytest.mark.parametrize(
    ("metadata", "told"),
    [
        (None, "is not of a sweep"),
        ({b"tlpsim": b'{"schema_version": 99}'}, "is of version 99 and this tlpsim knows 1"),
        ({b"tlpsim": b"no JSON"}, "cannot be read"),
    ],
)
def test_tables_of_others(metadata: dict[bytes, bytes] | None, told: str, tmp_path: Path) -> None:
    made = pyarrow.table({"case": [1, 2]}).replace_schema_metadata(metadata)
    pyarrow.parquet.write_table(made, tmp_path / NAME)
    with pytest.raises(ResultsError, match=told):
        read_table(tmp_path)


def test_a_place_that_cannot_be_written(table: SweepTable, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="the summary cannot be written"):
        write_table(table, tmp_path / "file" / NAME)
