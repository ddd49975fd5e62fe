"""Which results are records of one case, and which of their signals are meant."""

from collections.abc import Callable

import numpy as np
import pytest

from tlpsim.scenarios.results import Results, ResultsError
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.case import chosen_signals, require_one_case

SIGNALS = {
    "tendon_tension[1]": np.zeros(5),
    "tendon_tension[11]": np.zeros(5),
    "position.surge": np.zeros(5),
    "velocity.surge": np.zeros(5),
}


@pytest.fixture(scope="module")
def of(record: Callable[..., Results]) -> Callable[..., Results]:
    def make(**sections: object) -> Results:
        return record(Scenario.from_dict(sections), SIGNALS)

    return make


def test_seeds_and_titles_may_differ(of: Callable[..., Results]) -> None:
    require_one_case(
        [
            of(title="first", simulation={"seed": 1}),
            of(title="second", simulation={"seed": 2}),
            of(simulation={"seed": 1}, waves={"seed": 9}),
            of(simulation={"seed": 1}, wind={"seed": 9}),
        ]
    )


@pytest.mark.parametrize(
    ("sections", "key"),
    [
        ({"waves": {"significant_height": 9.0}}, r"waves.significant_height is 9.0, and not 7.08"),
        ({"simulation": {"duration": 60.0}}, r"simulation.duration is 60.0, and not 3600.0"),
        ({"components": {"wave": {"parameters": {"splash": False}}}}, r"components.wave.parameters"),
        ({"events": [{"at": 100.0, "lose_tendons": 1}]}, "events is "),
    ],
)
def test_the_key_that_differs_is_named(of: Callable[..., Results], sections: dict, key: str) -> None:
    other = Scenario.from_dict(sections).with_(simulation={"seed": 2})
    with pytest.raises(ResultsError, match=f"another case than .*: {key}.*differ in their seeds alone"):
        require_one_case([of(), of(**other.model_dump(mode="json", by_alias=True, exclude_defaults=True))])


def test_one_record_given_twice_is_not_two(of: Callable[..., Results]) -> None:
    with pytest.raises(ResultsError, match=r"same seeds as .*give one of them"):
        require_one_case([of(), of(simulation={"seed": 5}), of()])


def test_no_results_at_all() -> None:
    with pytest.raises(ResultsError, match="no results"):
        require_one_case([])


def test_names_and_patterns(of: Callable[..., Results]) -> None:
    results = of()
    assert [name for _, name in chosen_signals(results, None)] == [
        "platform.position.surge",
        "platform.tendon_tension[1]",
        "platform.tendon_tension[11]",
    ]
    assert chosen_signals(results, ["platform.tendon_tension[1]"]) == (("platform", "platform.tendon_tension[1]"),)
    assert len(chosen_signals(results, ["*.surge", "platform.velocity.*"])) == 2
    with pytest.raises(ResultsError, match=r"no recorded signal matches 'platform.position.surg'.*position.surge"):
        chosen_signals(results, ["*", "platform.position.surg"])
