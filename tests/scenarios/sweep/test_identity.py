"""By what cases and jobs are recognised, and seeds that no two records share."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import LARGEST_SEED
from tlpsim.scenarios.sweep import identity
from tlpsim.scenarios.sweep.identity import case_key, file_digest, job_key, named_files, record_seeds
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.sections import Statistics


def test_key_is_of_no_title_and_no_seed() -> None:
    base = case_key(Scenario())
    for change in ({"title": "other"}, {"simulation": {"seed": 7}}, {"wind": {"seed": 7}}, {"waves": {"seed": 7}}):
        assert case_key(Scenario.from_dict(change)) == base
    assert len(base) == identity.KEY_LENGTH


CHANGES: list[dict[str, Any]] = [
    {"simulation": {"duration": 1800.0}},
    {"simulation": {"start": "rest"}},
    {"site": {"water_depth": 449.0}},
    {"site": {"gravity": 9.81}},
    {"platform": {"mass": 40.4e6}},
    {"platform": {"damping_ratios": [0.0, 0.0, 0.02, 0.02, 0.03, 0.0]}},
    {"platform": {"hydrodynamics": "morison"}},
    {"platform": {"tendons": {"axial_stiffness": 3.38e11}}},
    {"wind": {"speed": 26.9 + 1e-12}},
    {"wind": {"spectrum": "api"}},
    {"wind": {"orders": {"long": 26}}},
    {"wind": {"segments": [{"position": [0, 0, 10], "area": 100, "shape_coefficient": 1}]}},
    {"waves": {"heading_deg": 21.7}},
    {"waves": {"splash": False}},
    {"waves": {"table": {"frequency": [0.05, 0.1, 0.2], "density": [1.0, 2.0, 1.0]}}},
    {"current": {"speed": 0.5}},
    {"coupling": {"filter": "linear"}},
    {"components": {"platform": {"step": 0.05}}},
    {"components": {"wind": {"parameters": {"x": 1.0}}}},
    {"components": {"wind": {"fmu": ""}}},
    {"connections": {"platform.wind_force.surge": {"factor": 2.0}}},
    {"connections": {"platform.elevation": {"from": ""}}},
    {"outputs": {"statistics_from": 60.0}},
    {"events": [{"at": 10.0, "set": {"platform.external_force.surge": 1e6}}]},
]


def test_key_is_of_every_other_setting() -> None:
    keys = [case_key(Scenario.from_dict(change)) for change in ({}, *CHANGES)]
    assert len(set(keys)) == len(CHANGES) + 1


def test_key_is_of_no_order_and_no_spelling() -> None:
    one = {"wind": {"speed": 20.0, "heading_deg": 5.0}, "current": {"speed": 1}, "simulation": {"duration": 1800.0}}
    other = {"simulation": {"duration": "30 min"}, "current": {"speed": 1.0}, "wind": {"heading_deg": 5, "speed": 20}}
    assert case_key(Scenario.from_dict(one)) == case_key(Scenario.from_dict(other))


def test_key_is_of_no_place_in_a_sweep(sweep_of: Callable[..., Sweep]) -> None:
    first = sweep_of("[grid]\nwind.speed = [1, 2]").plan().cases[1]
    second = sweep_of("title = 'x'\n[set]\nwind.speed = 2.0").plan().cases[0]
    third = sweep_of('[[cases]]\nname = "b"\nprobability = 0.1\nwind.speed = 2').plan().cases[0]
    assert first.key == second.key == third.key


def with_files(folder: Path, database: str = "one", quadratic: str = "two", table: str = "three") -> Scenario:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in {"b.h5": database, "q.h5": quadratic, "wind's \u00e9.csv": table}.items():
        (folder / name).write_text(content)
    return Scenario.from_dict(
        {
            "platform": {"hydrodynamics": str(folder / "b.h5")},
            "waves": {"drift": "qtf", "quadratic_transfer": str(folder / "q.h5")},
            "components": {"table": {"fmu": str(folder / "wind's \u00e9.csv"), "step": 1.0}},
        }
    )


def test_key_is_of_the_content_of_files_and_not_of_their_place(tmp_path: Path) -> None:
    base = case_key(with_files(tmp_path / "a"))
    assert case_key(with_files(tmp_path / "elsewhere" / "b")) == base
    others = [
        with_files(tmp_path / "c", database="other"),
        with_files(tmp_path / "d", quadratic="other"),
        with_files(tmp_path / "e", table="other"),
        with_files(tmp_path / "f", database="two", quadratic="one"),
    ]
    assert len({base, *map(case_key, others)}) == 5


def test_key_follows_a_file_that_is_written_anew(tmp_path: Path) -> None:
    scenario = with_files(tmp_path)
    before = case_key(scenario)
    (tmp_path / "b.h5").write_text("longer than before")
    assert case_key(scenario) != before
    (tmp_path / "b.h5").write_text("one")
    assert case_key(scenario) == before


def test_named_files_are_all_that_are_no_part_of_the_program(tmp_path: Path) -> None:
    assert named_files(Scenario()) == ()
    assert {path.name for path in named_files(with_files(tmp_path))} == {"b.h5", "q.h5", "wind's \u00e9.csv"}


def test_a_named_file_cannot_be_read(tmp_path: Path) -> None:
    scenario = with_files(tmp_path / "a")
    shutil.rmtree(tmp_path / "a")
    with pytest.raises(ScenarioError, match=r"cannot be read \(No such file or directory\); the scenario names it"):
        case_key(scenario)
    with pytest.raises(ScenarioError, match=r"Is a directory"):
        file_digest(tmp_path)


def test_a_job_is_of_case_domain_statistics_engine_and_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    base = job_key("c", "time", Statistics(), "monolithic", (1, 2))
    assert base == job_key("c", "time", Statistics(exposure=10800.0), "monolithic", (1, 2))
    keys = {
        base,
        job_key("d", "time", Statistics(), "monolithic", (1, 2)),
        job_key("c", "frequency", Statistics(), "monolithic", (1, 2)),
        job_key("c", "time", Statistics(exposure=3600.0), "monolithic", (1, 2)),
        job_key("c", "time", Statistics(slope=3.0), "monolithic", (1, 2)),
        job_key("c", "time", Statistics(signals=("a",)), "monolithic", (1, 2)),
        job_key("c", "time", Statistics(), "cosimulation", (1, 2)),
        job_key("c", "time", Statistics(), "monolithic", (2, 1)),
        job_key("c", "time", Statistics(), "monolithic"),
    }
    monkeypatch.setattr(identity, "program_version", lambda: "another")
    keys.add(job_key("c", "time", Statistics(), "monolithic", (1, 2)))
    monkeypatch.undo()
    monkeypatch.setattr(identity, "ROW_VERSION", identity.ROW_VERSION + 1)
    keys.add(job_key("c", "time", Statistics(), "monolithic", (1, 2)))
    assert len(keys) == 11


# Seeds


def test_seeds_of_many_records_all_differ() -> None:
    # 6e5 draws of 2^31 numbers have some 84 collisions, so that the way out of them is among what is tested.
    records = [(f"{case:032x}", k) for case in range(100_000) for k in (1, 2, 3)]
    seeds = [seed for pair in record_seeds(records, 1) for seed in pair]
    assert len(set(seeds)) == len(seeds) == 600_000
    assert min(seeds) >= 1
    assert max(seeds) <= LARGEST_SEED
    # Uniform: the mean of n of them errs by the range over sqrt(12 n), 8e5; five times that.
    assert sum(seeds) / len(seeds) == pytest.approx(0.5 * LARGEST_SEED, abs=4e6)


RECORDS = [(f"case {number}", k) for number in range(10) for k in (1, 2)]


def test_collisions_are_avoided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(identity, "LARGEST_SEED", 50)
    seeds = record_seeds(RECORDS, 1)
    assert len({seed for pair in seeds for seed in pair}) == 40
    assert all(1 <= seed <= 50 for pair in seeds for seed in pair)
    turned = record_seeds(RECORDS[::-1], 1)
    assert turned[::-1] == seeds


def test_seeds_are_of_the_record_alone() -> None:
    seeds = dict(zip(RECORDS, record_seeds(RECORDS, 1), strict=True))
    more = [("case of old", 1), *RECORDS[5:], ("another", 3), *RECORDS[:5]]
    again = dict(zip(more, record_seeds(more, 1), strict=True))
    assert all(again[record] == seeds[record] for record in RECORDS)
    assert not {*seeds.values()} & {*record_seeds(RECORDS, 2)}


def test_no_records_no_seeds() -> None:
    assert record_seeds([], 1) == []
