"""Time series of a page: what is shown, and what happens where there is too much of it."""

import json
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.report.analysis import Analysis
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.series import envelope, panels, series_chart
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario

NAMES = (
    "wave.force.surge",
    "wave.diffraction.surge",
    "wave.viscous.surge",
    "wave.elevation",
    "wind.force.surge",
    "platform.position.surge",
    "platform.velocity.surge",
    "platform.tendon_tension[1]",
    "platform.tendon_tension[2]",
    "platform.tendon_bottom_tension[1]",
)


def bare(*results: Results) -> list[Analysis]:
    """Analyses with nothing computed."""
    return [
        Analysis(case=case, start=0.0, statistics={}, without_statistics="", response=None, without_response="")
        for case in cases(results)
    ]


@given(st.lists(st.one_of(st.floats(-1e6, 1e6), st.just(float("nan"))), max_size=80), st.integers(1, 20))
def test_envelope_is_the_extremes_of_each_group(values: list[float], group: int) -> None:
    low, high = envelope(np.array(values), group)
    parts = [[v for v in values[k : k + group] if v == v] for k in range(0, len(values), group)]
    assert len(low) == len(high) == len(parts)
    for part, least, most in zip(parts, low, high, strict=True):
        if part:
            assert (least, most) == (min(part), max(part))
        else:
            assert np.isnan([least, most]).all()


def test_every_signal_has_a_panel_and_the_usual_ones_are_shown() -> None:
    found = panels(NAMES)
    assert {name for panel in found for name in panel.names} >= set(NAMES)
    shown = {panel.title: panel.names for panel in found if panel.shown}
    assert shown["surge"] == ("platform.position.surge",)
    assert shown["elevation"] == ("wave.elevation",)
    assert shown["tension, all tendons"] == ("largest over tendons", "smallest over tendons")
    # The total of the wave loads is no part of them.
    assert shown["loads in surge"] == ("wave.diffraction.surge", "wave.viscous.surge", "wind.force.surge")
    assert len(shown) == 4


def test_patterns_choose_what_is_shown() -> None:
    found = panels(NAMES, ["platform.velocity.*", "platform.tendon_tension[1]"])
    assert [panel.names for panel in found if panel.shown] == [
        ("platform.velocity.surge",),
        ("platform.tendon_tension[1]",),
    ]
    with pytest.raises(ScenarioError, match="--signal: 'nothing' matches no signal"):
        panels(NAMES, ["nothing"])


def test_a_system_without_a_platform_shows_its_first_signals() -> None:
    found = panels([f"a.y{k}" for k in range(20)])
    assert [panel.shown for panel in found] == [True] * 8 + [False] * 12


def test_extremes_over_tendons_and_units(written: Callable[..., Results]) -> None:
    time = np.arange(400) * 0.5
    tensions = [1e7 + 1e6 * np.sin(time), 1e7 - 2e6 * np.sin(time)]
    names = ["platform.tendon_tension[1]", "platform.tendon_tension[2]"]
    results = written(dict(zip(names, tensions, strict=True)), dict.fromkeys(names, "N"))
    signals = series_chart(bare(results)).content["signals"]
    for name, extreme in (("largest over tendons", np.maximum), ("smallest over tendons", np.minimum)):
        expected = 1e-6 * extreme(*tensions)
        (packed,) = [each["values"] for each in signals[name]["records"]]
        assert signals[name]["unit"] == "MN"
        assert packed["offset"] == pytest.approx(expected.min())
        assert packed["offset"] + 65534 * packed["scale"] == pytest.approx(expected.max())


def test_a_small_budget_thins_the_last_signals_first(written: Callable[..., Results]) -> None:
    noise = np.random.default_rng(5).standard_normal((12, 20_000))
    results = written({f"a.y{k:02}": each for k, each in enumerate(noise)})
    whole = series_chart(bare(results))
    assert {signal["group"] for signal in whole.content["signals"].values()} == {1}
    # A signal of noise takes 2 bytes a value, 53 kB of text: three of them fit, and room is kept for the others.
    budget = 250_000
    small = series_chart(bare(results), budget=budget)
    groups = [small.content["signals"][f"a.y{k:02}"]["group"] for k in range(12)]
    assert groups[:3] == [1, 1, 1]
    assert all(group > 1 for group in groups[4:])
    packed = [each for signal in small.content["signals"].values() for each in signal["records"]]
    texts = {each[key]["data"] for each in packed for key in ("values", "low", "high") if key in each}
    assert sum(map(len, texts)) <= budget
    assert "kept as envelopes" in small.caption
    assert "kept as envelopes" not in whole.caption
    # What is asked for is kept whole.
    asked = series_chart(bare(results), ["a.y11"], budget)
    assert asked.content["signals"]["a.y11"]["group"] == 1


def test_events_are_marked_once(written: Callable[..., Results], storm: Scenario) -> None:
    lost = {"at": 200.0, "lose_tendons": [7, 8]}
    other = {"at": 50.0, "current": {"speed": 1.0}, "set": {"platform.external_force.surge": 1e6}}
    scenario = storm.with_(events=[lost, other])
    files = [
        written({"platform.position.surge": np.arange(9.0)}, None, scenario.with_(simulation={"seed": k}))
        for k in (1, 2)
    ]
    assert series_chart(bare(*files)).content["events"] == [
        {"time": 50.0, "label": "current changes; platform.external_force.surge = 1000000.0"},
        {"time": 200.0, "label": "tendons 7 and 8 lost"},
    ]


def test_records_have_their_own_signals_and_times(written: Callable[..., Results]) -> None:
    first = written({"a.y": np.arange(5.0), "a.z": np.arange(5.0)})
    second = written({"a.y": np.arange(9.0)}, title="Other")
    content = series_chart(bare(first, second)).content
    assert [each["label"] for each in content["records"]] == ["By hand", "Other"]
    assert [each["times"]["a"]["count"] for each in content["records"]] == [5, 9]
    assert content["signals"]["a.z"]["records"][1] is None
    json.dumps(content)  # is what JSON can hold
