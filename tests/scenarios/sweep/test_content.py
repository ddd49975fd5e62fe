"""A plan and a summary as JSON for other programs."""

import json
from collections.abc import Callable
from pathlib import Path

from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.sweep.content import plan_content, sweep_content
from tlpsim.scenarios.sweep.job import Outcome
from tlpsim.scenarios.sweep.ledger import ledger
from tlpsim.scenarios.sweep.outlook import outlook
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.table import SweepTable, summary_table

TEXT = """
title = "For others"
domains = ["frequency", "time"]
[time]
worst = 1
[long_term]
years = [1, 100]
[grid]
wind.speed = { values = [1, 2, -3], probability = [0.5, 0.2, 0.3] }
platform.radiation = ["none", "convolution"]
"""
SURGE = "platform.position.surge"


def test_plan(sweep_of: Callable[..., Sweep]) -> None:
    sweep = sweep_of(TEXT)
    plan = sweep.plan()
    found = json.loads(json_text(plan_content(sweep, plan)))
    assert (found["kind"], found["title"], found["worst"]) == ("sweep plan", "For others", 1)
    assert found["keys"] == ["wind.speed", "platform.radiation"]
    assert len(found["notes"]) == 1
    assert [case["case"] for case in found["cases"]] == list(range(6))
    assert [case["variant"] for case in found["cases"]] == [0, 1] * 3
    assert found["cases"][3]["settings"] == {"wind.speed": 2, "platform.radiation": "convolution"}
    assert found["cases"][3]["probability"] == 0.2
    assert [len(case["jobs"]) for case in found["cases"]] == [2, 2, 2, 2, 0, 0]
    assert "wind.speed = -3" in found["cases"][5]["problem"]
    jobs = [job for case in found["cases"] for job in case["jobs"]]
    assert [job["key"] for job in jobs] == [job.key for job in plan.jobs]
    assert [job["seeds"] for job in jobs] == [None if job.seeds is None else list(job.seeds) for job in plan.jobs]


def summary(sweep: Sweep, folder: Path, outcome: Callable[..., Outcome]) -> SweepTable:
    plan = sweep.plan()
    jobs = [job for job in plan.jobs if job.domain == "frequency"]
    numbers = {"mean": 2.0, "std": 1.0, "skewness": 0.0, "excess_kurtosis": 0.0, "zero_crossing_period": 10.0}
    row = {f"{SURGE}.{name}": value for name, value in (numbers | {"bandwidth": 0.5}).items()}
    with ledger(folder) as book:
        book.record([outcome(job.key, row) for job in jobs[:-1]])
        book.record([outcome(jobs[-1].key, error="it broke")])
        return summary_table(sweep, plan, jobs, book)


def test_summary(sweep_of: Callable[..., Sweep], tmp_path: Path, outcome: Callable[..., Outcome]) -> None:
    table = summary(sweep_of(TEXT), tmp_path / "sweep", outcome)
    found = json.loads(json_text(sweep_content(table, outlook(table))))
    assert (found["kind"], found["cases"], found["jobs"], found["done"]) == ("sweep", 6, 6, 3)
    assert found["variants"] == [{"platform.radiation": "none"}, {"platform.radiation": "convolution"}]
    broken = found["failed"][0]
    assert broken == {
        "case": 3,
        "domain": "frequency",
        "replicate": 0,
        "error": "it broke",
        "wind.speed": 2.0,
        "platform.radiation": "convolution",
    }
    assert len(found["failed"]) == 3
    extremes = found["extremes"]
    assert [(each["variant"], each["side"]) for each in extremes] == [
        (0, "maximum"),
        (0, "minimum"),
        (1, "maximum"),
        (1, "minimum"),
    ]
    assert [each["covered"] for each in extremes] == [0.7, 0.7, 0.5, 0.5]
    for each in extremes:
        assert (each["signal"], each["unit"], each["domain"]) == (SURGE, "m", "frequency")
        assert [value["years"] for value in each["returns"]] == [1.0, 100.0]
        assert {part["case"] for part in each["returns"][0]["governed_by"]} == ({0, 2} if each["variant"] == 0 else {1})
        assert each["returns"][0]["level"]["low"] is None  # NaN: the frequency domain has no interval
    # A Gaussian of std 1 passes some 5 of them in a year of sea states alike, upwards and downwards.
    level = extremes[0]["returns"][0]["level"]["value"]
    assert 2.0 + 4.5 < level < 2.0 + 6.0
    assert abs(level + extremes[1]["returns"][0]["level"]["value"] - 4.0) < 1e-9


def test_without_probabilities(sweep_of: Callable[..., Sweep], tmp_path: Path, outcome: Callable[..., Outcome]) -> None:
    table = summary(sweep_of("[grid]\nwind.speed = [1, 2]"), tmp_path / "sweep", outcome)
    found = sweep_content(table, outlook(table))
    assert found["extremes"] == []
    assert found["fatigue"] == []
    assert found["failed"][0]["wind.speed"] == 2.0
    assert type(found["failed"][0]["case"]) is int
