"""Cases and jobs of a sweep: order, probabilities, alternatives, followers, and scenarios that are not allowed."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sweep.content import plan_content
from tlpsim.scenarios.sweep.plan import Plan, Sweep

SweepOf = Callable[..., Sweep]
BOTH = 'domains = ["frequency", "time"]\n'


def values(plan: Plan, key: str) -> list[object]:
    return [{dotted(path): value for path, value in case.settings.items()}[key] for case in plan.cases]


def test_an_empty_file_is_one_case(sweep_of: SweepOf) -> None:
    sweep = sweep_of()
    plan = sweep.plan()
    (case,), (job,) = plan.cases, plan.jobs
    assert (case.number, case.settings, case.problem, case.variant) == (0, {}, "", 0)
    assert math.isnan(case.probability)
    assert (job.case, job.domain, job.replicate, job.seeds) == (0, "frequency", 0, None)
    assert case.label == "the scenario itself"
    assert sweep.scenario(case).with_(title="") == Scenario().with_(title="")


def test_cases_are_all_combinations(sweep_of: SweepOf) -> None:
    plan = sweep_of("[grid]\nwind.speed = [1, 2]\ncurrent.speed = { from = 0, to = 1, count = 3 }").plan()
    assert [case.number for case in plan.cases] == list(range(6))
    assert values(plan, "wind.speed") == [1, 1, 1, 2, 2, 2]
    assert values(plan, "current.speed") == [0.0, 0.5, 1.0] * 2
    assert len({case.key for case in plan.cases}) == 6
    assert plan.cases[1].label == "wind.speed = 1, current.speed = 0.5"
    assert plan.variants == ({},)
    assert not plan.weighted


def test_scenarios_have_the_settings_of_their_case(sweep_of: SweepOf) -> None:
    sweep = sweep_of("[set]\nwaves.peak_period = 11\n[grid]\nwind.speed = [1, 2]\n", ["site.water_depth=300"])
    for case in sweep.plan().cases:
        scenario = sweep.scenario(case)
        assert scenario.wind.speed == case.settings["wind", "speed"]
        assert scenario.waves.peak_period == 11.0
        assert scenario.site.water_depth == 300.0
        assert scenario.title == f"{sweep.title}: {case.label}"


def test_environments_multiply_and_designs_stand_apart(sweep_of: SweepOf) -> None:
    text = """
    [grid]
    platform.draught = [30, 35]
    wind.speed = { values = [1, 2], probability = [0.25, 0.75] }
    platform.radiation = ["none", "convolution"]
    current.speed = { values = [0, 1], probability = [0.4, 0.5] }
    """
    plan = sweep_of(text).plan()
    assert plan.weighted
    assert plan.variants == tuple(
        {("platform", "draught"): draught, ("platform", "radiation"): radiation}
        for draught in (30, 35)
        for radiation in ("none", "convolution")
    )
    for case in plan.cases:
        alternative = plan.variants[case.variant]
        assert all(case.settings[key] == value for key, value in alternative.items())
        wind = {1: 0.25, 2: 0.75}[case.settings["wind", "speed"]]
        current = {0: 0.4, 1: 0.5}[case.settings["current", "speed"]]
        assert case.probability == pytest.approx(wind * current, rel=1e-15)
    for variant in range(4):
        mine = [case.probability for case in plan.cases if case.variant == variant]
        assert sum(mine) == pytest.approx(0.9, rel=1e-12)


def test_followers_go_with_their_leader(sweep_of: SweepOf) -> None:
    text = """
    [grid]
    waves.significant_height = [1, 2, 5]
    [linked]
    wind.speed = { by = "waves.significant_height", at = [0, 4], value = [10, 30] }
    current.speed = { by = "wind.speed", plus = -9 }
    waves.heading_deg = { by = "wind.heading_deg", plus = 10 }
    """
    sweep = sweep_of(text)
    plan = sweep.plan()
    assert values(plan, "wind.speed") == [15.0, 20.0, 30.0]
    assert values(plan, "current.speed") == [6.0, 11.0, 21.0]
    assert values(plan, "waves.heading_deg") == [44.5] * 3
    assert [sweep.scenario(case).wind.speed for case in plan.cases] == [15.0, 20.0, 30.0]
    assert plan.keys[0] == ("waves", "significant_height")


@pytest.mark.parametrize(
    ("by", "told"), [("waves.spectrum", "which is 'pierson_moskowitz'"), ("waves.hs", "not there or has no value")]
)
def test_followers_of_no_number(by: str, told: str, refusal: Callable[..., str]) -> None:
    message = refusal(f'[linked]\nwind.speed = {{ by = "{by}" }}')
    assert f"sweep.toml: case 0: linked: wind.speed follows {by}, " in message
    assert told in message


def test_keys_of_other_cases_have_the_value_of_the_scenario(sweep_of: SweepOf) -> None:
    text = """
    [set]
    wind.segments = [{ position = [0, 0, 10], area = 100, shape_coefficient = 1 }]
    [[cases]]
    name = "a"
    wind.speed = 3
    [[cases]]
    name = "b"
    platform.tendons.pretension = "1 N"
    wind.segments = [{ position = [0, 0, 20], area = 50, shape_coefficient = 1 }]
    [[cases]]
    name = "c"
    connections."platform.wind_force.surge".from = "wind.force.sway"
    """
    sweep = sweep_of(text)
    plan = sweep.plan()
    assert values(plan, "wind.speed") == [3, 26.9, 26.9]
    assert values(plan, "platform.tendons.pretension") == [None, "1 N", None]
    wired = {dotted(key): value for key, value in plan.cases[0].settings.items() if key[0] == "connections"}
    assert list(wired.values()) == ["wind.force.surge"]
    assert [case.name for case in plan.cases] == ["a", "b", "c"]
    assert "platform.tendons.pretension" in plan.cases[1].problem
    first = sweep.scenario(plan.cases[0])
    assert first.wind.segments == sweep.base.wind.segments
    # A table of settings that only one case has can be written, for the summary and for other programs.
    written = json.loads(json_text(plan_content(sweep, plan)))
    assert written["cases"][0]["settings"]["wind.segments"][0]["area"] == 100.0


def test_jobs_of_both_domains(sweep_of: SweepOf) -> None:
    plan = sweep_of(f"{BOTH}[replicates]\nrecords = 2\n[grid]\nwind.speed = [1, 2]").plan()
    told = [(job.case, job.domain, job.replicate) for job in plan.jobs]
    each = [("frequency", 0), ("time", 1), ("time", 2)]
    assert told == [(case, *rest) for case in (0, 1) for rest in each]
    assert len({job.key for job in plan.jobs}) == 6
    seeds = [seed for job in plan.jobs for seed in job.seeds or ()]
    assert len(set(seeds)) == 8


def test_a_record_has_its_seeds(sweep_of: SweepOf) -> None:
    sweep = sweep_of('domains = ["time"]')
    plan = sweep.plan()
    scenario = sweep.scenario(plan.cases[0], plan.jobs[0])
    assert (scenario.wind.seed, scenario.waves.seed) == plan.jobs[0].seeds


def test_records_keep_keys_and_seeds_when_cases_are_added(sweep_of: SweepOf) -> None:
    one = sweep_of("title = 'a'\n" + BOTH + "[grid]\nwind.speed = [1, 2]").plan()
    more = sweep_of("title = 'b'\n" + BOTH + "[grid]\nwind.speed = [5, 2, 1, 7]\ncurrent.speed = [1.07, 0.41]").plan()
    known = {job.key: job.seeds for job in more.jobs}
    assert len(known) == 16
    assert all(known[job.key] == job.seeds for job in one.jobs)


def test_another_seed_makes_other_records(sweep_of: SweepOf) -> None:
    one, other = (sweep_of(f"{BOTH}[replicates]\nseed = {seed}").plan() for seed in (1, 2))
    assert one.jobs[0].key == other.jobs[0].key
    assert one.jobs[1].key != other.jobs[1].key
    assert not set(one.jobs[1].seeds or ()) & set(other.jobs[1].seeds or ())


# What is not allowed


def test_two_cases_alike(sweep_of: SweepOf) -> None:
    plan = sweep_of("[grid]\nwind.speed = [1, 2, 1.0]").plan()
    assert [bool(case.problem) for case in plan.cases] == [False, False, True]
    assert "case 2 (wind.speed = 1.0) is the same scenario as case 0: leave one out" in plan.cases[2].problem
    assert plan.cases[2].key == ""
    assert {job.case for job in plan.jobs} == {0, 1}


def test_one_of_many_is_not_allowed(sweep_of: SweepOf) -> None:
    plan = sweep_of("[grid]\nwaves.significant_height = [1, -2, 3]").plan()
    assert "case 1: waves.significant_height = -2: must be at least 0" in plan.cases[1].problem
    (note,) = plan.notes
    assert note.startswith("1 of 3 cases are not allowed; the first: ")
    assert plan.cases[1].problem in note
    assert {job.case for job in plan.jobs} == {0, 2}


def test_no_case_is_allowed(refusal: Callable[..., str]) -> None:
    message = refusal("[grid]\nwaves.significant_height = [-1, -2]")
    assert "sweep.toml: case 0: waves.significant_height = -1: must be at least 0" in message


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("waves.heading", "did you mean 'heading_deg'?"),
        ("wavs.heading_deg", "did you mean 'waves'?"),
        ("waves", "table"),
    ],
)
def test_keys_that_no_scenario_has(key: str, told: str, refusal: Callable[..., str]) -> None:
    message = refusal(f"[grid]\n{key} = [1, 2]")
    assert "case 0" in message
    assert told in message


@pytest.mark.parametrize("override", ["wind.speed=3", "wind={speed=3}", '"wind".speed = 3'])
def test_an_override_of_a_key_that_varies(override: str, refusal: Callable[..., str]) -> None:
    message = refusal("[grid]\nwind.speed = [1, 2]", [override])
    assert "wind.speed varies in" in message
    assert "leave it out here, or there" in message


def test_a_common_setting_of_a_key_that_varies(refusal: Callable[..., str]) -> None:
    assert "set: wind.speed varies in" in refusal("[set]\nwind.speed = 3\n[grid]\nwind.speed = [1, 2]")


@pytest.mark.parametrize("override", ["wind.speeed=3", "wind", "=3"])
def test_a_wrong_override(override: str, refusal: Callable[..., str]) -> None:
    assert refusal("[grid]\ncurrent.speed = [1, 2]", [override]).startswith("override")


def test_an_override_of_a_follower(refusal: Callable[..., str]) -> None:
    assert "wind.speed varies" in refusal('[linked]\nwind.speed = { by = "waves.peak_period" }', ["wind.speed=3"])


# Files


def test_files_are_beside_the_sweep(tmp_path: Path, sweep_of: SweepOf) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "base.toml").write_text('[platform]\nhydrodynamics = "own.h5"\n')
    for name in ("below/own.h5", "a.h5", "b.h5", "c.h5"):
        (tmp_path / name).write_text(name)
    base = 'scenario = "below/base.toml"\n'
    assert sweep_of(base).base.platform.hydrodynamics == str(tmp_path / "below" / "own.h5")
    assert sweep_of(f'{base}set.platform.hydrodynamics = "a.h5"').base.platform.hydrodynamics == str(tmp_path / "a.h5")
    overridden = sweep_of(base, ["platform.hydrodynamics=c.h5"])
    assert overridden.base.platform.hydrodynamics == str(tmp_path / "c.h5")
    sweep = sweep_of(f'{base}[grid]\nplatform.hydrodynamics = ["a.h5", "b.h5"]')
    named = [sweep.scenario(case).platform.hydrodynamics for case in sweep.plan().cases]
    assert named == [str(tmp_path / "a.h5"), str(tmp_path / "b.h5")]


def test_a_file_that_is_not_there(refusal: Callable[..., str]) -> None:
    message = refusal('[set]\nplatform.hydrodynamics = "none.h5"')
    assert "none.h5: cannot be read (No such file or directory); the scenario names it" in message


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("[grid]\nwind.speed = [1]\n")
    assert len(Sweep.load(tmp_path / "s.toml").plan().cases) == 1
