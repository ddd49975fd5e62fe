from collections.abc import Callable

import numpy as np
import pytest

from tlpsim.scenarios.report.cases import cases, differences
from tlpsim.scenarios.results import Results, ResultsError
from tlpsim.scenarios.schema import Scenario

SIGNALS = {"platform.position.surge": np.arange(10.0)}


@pytest.fixture
def of(written: Callable[..., Results]) -> Callable[..., Results]:
    return lambda title="By hand", **changes: written(SIGNALS, scenario=Scenario().with_(**changes), title=title)


def test_records_of_other_seeds_are_one_case(of: Callable[..., Results]) -> None:
    first, second = of(), of(simulation={"seed": 2}, wind={"seed": 9})
    (case,) = cases([first, second])
    assert case.results == (first, second)
    assert case.records == ("seed 1", "seed 2")
    assert case.label == "By hand"


def test_other_scenarios_are_cases_named_by_what_differs(of: Callable[..., Results]) -> None:
    found = cases([of(), of(waves={"significant_height": 9.0}), of(simulation={"seed": 2})])
    assert [each.label for each in found] == ["significant height 7.08", "significant height 9"]
    assert [len(each.results) for each in found] == [2, 1]


def test_titles_name_cases_before_their_differences(of: Callable[..., Results]) -> None:
    found = cases([of(), of(title="Other", waves={"significant_height": 9.0})])
    assert [each.label for each in found] == ["By hand", "Other"]


def test_the_same_seeds_by_another_way_are_another_case(of: Callable[..., Results]) -> None:
    first, again = of(), of()
    found = cases([first, again])
    assert [each.results for each in found] == [(first,), (again,)]
    assert [each.label for each in found] == [each.path.stem for each in (first, again)]


def test_other_fmus_are_another_case(written: Callable[..., Results]) -> None:
    import h5py

    from tlpsim.scenarios.results import open_results

    first, second = (written(SIGNALS, scenario=Scenario().with_(simulation={"seed": seed})) for seed in (1, 2))
    with h5py.File(second.path, "a") as file:
        file["platform"].attrs["sha256"] = "0" * 64
    assert len(cases([first, open_results(second.path)])) == 2


def test_systems_without_a_scenario_stand_alone(written: Callable[..., Results]) -> None:
    found = cases([written(SIGNALS), written(SIGNALS)])
    assert [each.scenario for each in found] == [None, None]


def test_a_file_counts_once(of: Callable[..., Results]) -> None:
    first = of()
    with pytest.raises(ResultsError, match="given twice"):
        cases([first, first])


def test_an_empty_run_is_refused(written: Callable[..., Results]) -> None:
    empty = written({"platform.position.surge": np.zeros(0)}, scenario=Scenario(), status="failed: at once")
    with pytest.raises(ResultsError, match=r"no samples \(failed: at once\)"):
        cases([empty])


def test_differences_name_keys_with_both_values() -> None:
    changed = Scenario().with_(waves={"significant_height": 9.0}, components={"wave": {"step": 0.2}})
    assert differences(changed) == (("waves.significant_height", 9.0, 7.08), ("components.wave.step", 0.2, 0.5))
    assert differences(Scenario()) == ()
    assert differences(Scenario(), changed) == (
        ("waves.significant_height", 7.08, 9.0),
        ("components.wave.step", 0.5, 0.2),
    )
