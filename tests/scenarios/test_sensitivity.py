"""The sensitivity study on a response that follows its parameters by known powers."""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.issc_tlp import displaced_volume
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sensitivity import (
    ENVIRONMENT,
    PLATFORM,
    PRETENSION,
    STATISTICS,
    _changed,
    _pretension,
    sensitivity,
)
from tlpsim.scenarios.sensitivity_output import (
    PANELS,
    draw_sensitivity,
    print_sensitivity,
    read_sensitivity,
    sensitivity_json,
    tornado_figure,
    write_sensitivity,
)

Maker = Callable[..., SpectralResponse]
LARGEST_SPEED = 28.0


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch, fake_response: Maker) -> None:
    """A solver whose means and slow spreads go with U², whose wave spreads go with H, and which fails above 28 m/s."""

    def respond(scenario: Scenario) -> SpectralResponse:
        if scenario.wind.speed > LARGEST_SPEED:
            raise SolverError("no mean position")
        height = scenario.waves.significant_height / 7.08
        turn = 1.0 + math.sin(math.radians(scenario.wind.heading_deg - 34.5))
        return fake_response((scenario.wind.speed / 26.9) ** 2 * turn, height)

    monkeypatch.setattr("tlpsim.scenarios.spectral.spectral_response", respond)


def test_changes_are_those_of_the_known_powers(known: None) -> None:
    found = sensitivity(
        Scenario(), ["waves.significant_height", "wind.speed", "wind.heading_deg"], change=0.02, turn=5.0, workers=1
    )
    assert found.parameters == ("waves.significant_height", "wind.speed", "wind.heading_deg")
    assert [change.label for change in found.changes] == ["-2 %", "+2 %"] * 2 + ["-5°", "+5°"]
    assert [change.value for change in found.changes] == pytest.approx(
        [7.08 * 0.98, 7.08 * 1.02, 26.9 * 0.98, 26.9 * 1.02, 29.5, 39.5]
    )
    names = list(STATISTICS)
    relative = np.array([found.relative(change) for change in found.changes])
    mean, slow, fast = (names.index(f"surge {which}") for which in ("mean", "LF", "WF"))
    square, sine = np.array([0.98**2, 1.02**2]) - 1.0, np.sin(np.radians([-5.0, 5.0]))
    np.testing.assert_allclose(relative[:, mean], [0.0, 0.0, *square, *sine], atol=1e-12)
    # Tails beyond the edge of the band make the spreads follow by a little less.
    np.testing.assert_allclose(relative[:, slow], [0.0, 0.0, *square, *sine], atol=1e-3)
    np.testing.assert_allclose(relative[:, fast], [-0.02, 0.02, 0.0, 0.0, 0.0, 0.0], atol=3e-3)
    heave = names.index("heave mean")  # below zero: its modulus is the base, so that more of it is less
    np.testing.assert_allclose(relative[2:4, heave], -square, atol=1e-12)
    tension = np.hypot(2e5, 8e5 * np.array([0.98, 1.02])) / np.hypot(2e5, 8e5) - 1.0
    np.testing.assert_allclose(relative[:2, names.index("tension std")], tension, rtol=1e-6)
    assert found.base[names.index("tension std")] == pytest.approx(1e-6 * np.hypot(2e5, 8e5), rel=1e-6)


def test_a_failed_case_is_told_and_does_not_stop_the_others(known: None, capsys: pytest.CaptureFixture[str]) -> None:
    found = sensitivity(
        Scenario(), ["wind.speed", "waves.significant_height", "waves.frequency_min"], change=0.9, workers=1
    )
    problems = {(change.parameter, change.label): change.problem for change in found.changes}
    assert problems["wind.speed", "+90 %"] == "no mean position"
    assert problems["wind.speed", "-90 %"] == ""
    assert np.isnan(found.relative(found.changes[1])).all()
    # What the schema refuses is a failed case, too: the scenario's own band must hold the peak.
    assert problems["waves.frequency_min", "-90 %"] == ""
    assert sensitivity(Scenario(), ["waves.peak_period"], change=0.9, workers=1).changes[0].problem.count("peak") > 0
    print_sensitivity(found)
    told = capsys.readouterr().out
    assert "failed: wind.speed +90 %: no mean position" in told
    assert "nan" not in told


def test_a_base_that_fails_is_an_error(known: None) -> None:
    with pytest.raises(SolverError, match="no mean position"):
        sensitivity(Scenario().with_(wind={"speed": 30.0}), ["waves.significant_height"], workers=1)


def test_zero_and_absent_parameters_are_left_out_with_a_note(known: None) -> None:
    calm = Scenario().with_(current={"speed": 0.0})
    found = sensitivity(calm, ["current.speed", "waves.table", "wind.speed"], change=0.01, workers=1)
    assert found.parameters == ("wind.speed",)
    assert found.notes == (
        "current.speed is zero in the scenario and left out",
        "waves.table is not given in the scenario and left out",
    )
    with pytest.raises(ScenarioError, match=r"nothing is left.*current\.speed is zero"):
        sensitivity(calm, ["current.speed"], workers=1)
    # A heading of zero is a heading.
    assert len(sensitivity(Scenario().with_(wind={"heading_deg": 0.0}), ["wind.heading_deg"], workers=1).changes) == 2


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (["wind.sped"], r"'sped' is not in \[wind\] \(did you mean 'speed'"),
        (["wind.speed.x"], "'x' is not in"),
        (["wind.spectrum"], "is no number"),
        (["wind"], "is no number"),
        (["waves.splash"], "is no number"),
        ([], "nothing is left"),
    ],
)
def test_parameters_that_are_none(known: None, parameters: list[str], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        sensitivity(Scenario(), parameters, workers=1)


@pytest.mark.parametrize("changes", [{"change": 0.0}, {"change": 1.0}, {"turn": 0.0}, {"turn": 180.0}])
def test_changes_out_of_range(known: None, changes: dict[str, float]) -> None:
    with pytest.raises(ScenarioError, match="must be above 0"):
        sensitivity(Scenario(), ["wind.speed"], **changes, workers=1)  # type: ignore[arg-type]


def test_default_parameters_are_keys_of_numbers(known: None) -> None:
    found = sensitivity(Scenario(), change=0.01, turn=1.0, new_databases=True, workers=1)
    assert found.parameters[: len(ENVIRONMENT) + len(PLATFORM)] == (*ENVIRONMENT, *PLATFORM)
    assert found.parameters[-3:] == ("platform.mass", "platform.draught", PRETENSION)
    assert not found.notes
    assert not any(change.problem for change in found.changes)
    ratios = next(change for change in found.changes if change.parameter == "platform.damping_ratios")
    assert ratios.value == pytest.approx((0.0, 0.0, 0.0198, 0.0198, 0.0198, 0.0))


def test_weight_buoyancy_and_pretension_stay_in_balance() -> None:
    """Archimedes: what the weight loses the tethers take."""
    scenario = Scenario()
    g = scenario.site.gravity
    given = scenario.with_(platform={"tendons": {"pretension": _pretension(scenario)}})
    for base in (scenario, given):
        lighter = _changed(base, "platform.mass", 0.9 * base.platform.mass)
        assert _pretension(lighter) - _pretension(base) == pytest.approx(0.1 * base.platform.mass * g)
        tighter = _changed(base, PRETENSION, 1.1 * _pretension(base))
        assert _pretension(tighter) == pytest.approx(1.1 * _pretension(base), rel=1e-9)
        assert (base.platform.mass - tighter.platform.mass) * g == pytest.approx(0.1 * _pretension(base), rel=1e-9)
    assert _pretension(scenario) + scenario.platform.mass * g == pytest.approx(1025.0 * g * displaced_volume(35.0))


def test_files_hold_every_change(known: None, tmp_path: Path) -> None:
    found = sensitivity(Scenario(), ["wind.speed", "platform.damping_ratios"], workers=1)
    write_sensitivity(found, tmp_path / "new" / "s.csv")
    with (tmp_path / "new" / "s.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 * len(STATISTICS)
    surge = rows[0]
    assert (surge["parameter"], surge["change"], surge["statistic"]) == ("wind.speed", "-10 %", "surge mean")
    assert float(surge["changed"]) == pytest.approx(6.0 * 0.81)
    assert float(surge["relative_change"]) == pytest.approx(-0.19)
    write_sensitivity(found, tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5") as held:
        assert held.attrs["format"] == "tlpsim sensitivity"
        np.testing.assert_array_equal(held["base"], found.base)
        assert held["statistics"].shape == (4, len(STATISTICS))
        np.testing.assert_array_equal(held["statistics"][0], found.changes[0].statistics)
        assert np.isnan(held["statistics"][1]).all()  # 29.6 m/s, above the largest speed
        assert list(held["problems"].asstr()) == ["", "no mean position", "", ""]
        assert json.loads(held["values"].asstr()[2]) == pytest.approx([0.0, 0.0, 0.018, 0.018, 0.018, 0.0])
    assert read_sensitivity(tmp_path / "s.h5") == found
    told = json.loads(sensitivity_json(found), parse_constant=pytest.fail)
    assert len(told["rows"]) == len(rows)
    assert told["rows"][len(STATISTICS)]["changed"] is None
    with pytest.raises(ScenarioError, match=r"\.csv or \.h5"):
        write_sensitivity(found, tmp_path / "s.txt")


def test_tornado_has_the_largest_change_at_its_top(known: None, tmp_path: Path) -> None:
    found = sensitivity(Scenario(), ["waves.significant_height", "wind.speed", "current.speed"], change=0.03, workers=1)
    panels = tornado_figure(found).axes
    for name, top, width in (("surge mean", "wind.speed", 6.09), ("surge WF", "waves.significant_height", 3.0)):
        axes = panels[PANELS.index(name)]
        assert [label.get_text() for label in axes.get_yticklabels()][-1] == top
        widest = max(bar.get_width() for bar in axes.patches)  # type: ignore[attr-defined]
        assert widest == pytest.approx(width, rel=0.04)  # of the waves a little less, as above
    assert [path.name for path in draw_sensitivity(tmp_path / "figures", found)] == ["sensitivity.png"]
    assert (tmp_path / "figures" / "sensitivity.png").stat().st_size > 10000
