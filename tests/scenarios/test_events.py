"""Events of a scenario: what they do to the platform, by FMUs and in one loop, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError, WiringError
from tlpsim.loads.platform.equilibrium import static_equilibrium
from tlpsim.loads.platform.motion import initial_state, remaining
from tlpsim.scenarios.monolithic import parts
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

CALM = {"wind.speed": 0.0, "waves.significant_height": 0.0, "current.speed": 0.0, "simulation.duration": 120.0}
DAMPED = {"platform.damping_ratios": [0.3, 0.3, 0.3, 0.3, 0.3, 0.3]}


def changing(*events: dict[str, Any], **settings: Any) -> Scenario:
    return Scenario().with_(**{"simulation.duration": 60.0, **settings}, events=list(events))


def after(results: Results, name: str, time: float) -> np.ndarray:
    component = name.partition(".")[0]
    return results.signal(name)[results.time(component) > time]


@pytest.mark.parametrize("monolithic", [False, True])
def test_a_lost_tendon_hands_its_tension_to_the_others(tmp_path: Path, monolithic: bool) -> None:
    """After its transient the platform hangs in the equilibrium of the eleven others."""
    scenario = changing({"at": 20.0, "lose_tendons": 3}, **CALM, **DAMPED)
    results = scenario.run(tmp_path / "r.h5", monolithic=monolithic)
    lost = results.signal("platform.tendon_tension[3]")
    time = results.time("platform")
    assert np.all(lost[time < 20.05] > 1e7)
    assert np.all(lost[time > 20.15] == 0.0)
    model = parts(scenario).platform
    intact = np.arange(12) != 2
    position = static_equilibrium(remaining(model, intact), np.zeros(6))
    state = initial_state(model, position, np.zeros(6), np.zeros(6), intact)
    for number in (1, 2, 4, 12):
        settled = after(results, f"platform.tendon_tension[{number}]", 110.0).mean()
        # What is left of the slow yaw and surge after 90 s changes tensions by less.
        assert settled == pytest.approx(state.tensions[number - 1], rel=2e-4)


def test_a_force_at_a_time_moves_the_platform_to_its_static_offset(tmp_path: Path) -> None:
    event = {"at": 10.0, "set": {"platform.external_force.surge": 2e6}}
    scenario = changing(event, **{**CALM, "simulation.duration": 600.0}, **DAMPED)
    results = scenario.run(tmp_path / "r.h5")
    surge = results.signal("platform.position.surge")
    assert np.all(np.abs(surge[results.time("platform") <= 10.0]) < 1e-6)
    offset = static_equilibrium(parts(scenario).platform, np.array([2e6, 0, 0, 0, 0, 0]))[0]
    assert surge[-1] == pytest.approx(offset, rel=1e-3)


EVENTS: tuple[dict[str, Any], ...] = (
    {"at": 20.0, "lose_tendons": [3, 4]},
    {"at": 30.5, "current": {"speed": "3 kn", "heading_deg": 40.0}},
    {"at": 40.0, "set": {"platform.external_force.sway": 3e6}},
)


def test_fmus_and_one_loop_change_alike(tmp_path: Path) -> None:
    """Two programs of the same events; what differs is the error of the coupling, larger where motions are small."""
    scenario = changing(*EVENTS)
    fmus, loop = scenario.run(tmp_path / "f.h5"), scenario.run(tmp_path / "l.h5", monolithic=True)
    without = changing().run(tmp_path / "w.h5")
    for degree, error in {"surge": 0.02, "sway": 0.02, "pitch": 0.05, "yaw": 0.1}.items():
        name = f"platform.position.{degree}"
        one, other, plain = (each.signal(name) for each in (fmus, loop, without))
        effect = np.max(np.abs(one - plain))
        assert effect > 0.1 * np.ptp(plain)
        assert np.max(np.abs(one - other)) < error * effect
    assert np.array_equal(fmus.signal("wave.elevation")[:41], without.signal("wave.elevation")[:41])


def test_a_current_that_stays_changes_no_bit(tmp_path: Path) -> None:
    """The sea goes on where it was in its record."""
    plain = changing().run(tmp_path / "plain.h5")
    same = changing({"at": 30.0, "current": {"speed": 0.41}}).run(tmp_path / "same.h5")
    for name in ("wave.viscous.surge", "wave.elevation", "platform.position.surge"):
        assert np.array_equal(plain.signal(name), same.signal(name))


def test_currents_follow_one_another(tmp_path: Path) -> None:
    """Mean drag in calm water is quadratic in the speed; a change keeps the keys that it does not name."""
    events = (
        {"at": 20.0, "current": {"speed": 1.0, "heading_deg": 0.0}},
        {"at": 40.0, "current": {"speed": 2.0}},
        {"at": 10.0, "current": {"speed": 0.5}},
    )
    fixed = {"components": {"platform": {"parameters": {f"free.{d}": False for d in ("surge", "sway", "yaw")}}}}
    scenario = changing(*events, **{**CALM, "simulation.duration": 60.0}).with_(**fixed)
    results = scenario.run(tmp_path / "r.h5")
    time, force = results.time("wave"), results.signal("wave.viscous.surge")
    means = [force[(time > begin + 8.0) & (time <= begin + 10.0)].mean() for begin in (30.0, 50.0)]
    assert means[1] / means[0] == pytest.approx(4.0, rel=1e-3)
    assert results.signal("wave.viscous.surge")[0] == 0.0
    sway = results.signal("wave.viscous.sway")[time > 41.0]
    assert np.all(np.abs(sway) < 1e-3 * means[1])


def test_events_survive_json_and_toml(tmp_path: Path) -> None:
    from tlpsim.scenarios.writing import to_toml

    scenario = changing(*EVENTS)
    assert Scenario.from_json(scenario.to_json()) == scenario
    path = tmp_path / "s.toml"
    path.write_text(to_toml(scenario.model_dump(by_alias=True, exclude_none=True)))
    assert Scenario.load(path).events == scenario.events


@pytest.mark.parametrize(
    ("event", "text"),
    [
        ({"at": 5.0}, 'events[0] = {"at": 5.0}: does nothing: give it set, lose_tendons or current'),
        ({"at": -1.0, "lose_tendons": 1}, "events[0].at = -1.0: must be at least 0"),
        ({"at": "5 kn", "lose_tendons": 1}, "'kn' is not a unit of time"),
        ({"at": 5.0, "lose_tendons": 13}, "must be at most 12"),
        ({"at": 5.0, "lose_tendon": 3}, "unknown key (did you mean 'lose_tendons'?)"),
        ({"at": 5.0, "current": {"sped": 3}}, "unknown key (did you mean 'speed'?)"),
        ({"at": 5.0, "set": {"plat.x": 3}}, "there is no component 'plat'"),
        ({"at": 5.0, "set": {"platform": 3}}, "must be written COMPONENT.VARIABLE"),
        ({"lose_tendons": 1}, "events[0].at: is missing"),
    ],
)
def test_bad_events_are_told_in_one_line(event: dict[str, Any], text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        changing(event)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_cannot_change_is_told_before_the_run(tmp_path: Path) -> None:
    for target, text in (
        ("wave.significant_height", "wave.significant_height' is parameter, fixed, and cannot change"),
        ("platform.wave_force.surge", "is fed by wave.force.surge -> platform.wave_force.surge"),
        ("platform.no_such", "no variable 'no_such'"),
    ):
        with pytest.raises(WiringError) as caught:
            run_scenario(changing({"at": 5.0, "set": {target: 1.0}}), tmp_path / "r.h5")
        assert text in str(caught.value)
    with pytest.raises(ScenarioError, match="waves that ride on the current"):
        changing({"at": 5.0, "current": {"speed": 1.0}}, **{"current.doppler": True})
    with pytest.raises(ScenarioError, match=r"a monolithic run cannot set wind\.position\.yaw"):
        changing({"at": 5.0, "set": {"wind.position.yaw": 1.0}}).run(tmp_path / "r.h5", monolithic=True)
    with pytest.raises(ScenarioError, match="the frequency domain has no times"):
        changing({"at": 5.0, "lose_tendons": 1}).spectral()
    assert not list(tmp_path.iterdir())


def test_an_event_after_the_end_warns(tmp_path: Path) -> None:
    scenario = changing({"at": 70.0, "lose_tendons": 1}, **{"simulation.duration": 1.0})
    with pytest.warns(UserWarning, match="event at 70 s: has no effect, the run ends at 1 s"):
        scenario.run(tmp_path / "r.h5")
    assert open_results(tmp_path / "r.h5").complete
