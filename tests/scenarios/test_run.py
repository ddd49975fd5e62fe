"""Scenarios from end to end, with the real FMUs."""

from pathlib import Path

import numpy as np
import pytest

from tlpsim.fmus.build import build
from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import write
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import FmuError, ScenarioError, StepError, WiringError
from tlpsim.loads.platform.equilibrium import static_equilibrium
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.assemble import assembled
from tlpsim.scenarios.monolithic import twin
from tlpsim.scenarios.results import open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

DEGREES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def positions(results: object) -> np.ndarray:
    return np.array([results.signal(f"platform.position.{degree}") for degree in DEGREES])  # type: ignore[attr-defined]


def test_every_component_is_recorded_at_its_own_step(scenario_file: Path, tmp_path: Path) -> None:
    results = run_scenario(Scenario.load(scenario_file), tmp_path / "r.h5")
    assert results.complete
    for component, step in {"wind": 1.0, "wave": 0.5, "platform": 0.1}.items():
        np.testing.assert_allclose(results.time(component), np.arange(0.0, 20.0 + 0.5 * step, step), atol=1e-9)
    assert results.unit("platform.tendon_tension[12]") == "N"
    assert np.ptp(results.signal("platform.position.surge")) > 0.1
    assert not (tmp_path / "r.h5.part").exists()


def test_same_seed_same_numbers_and_another_seed_others(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    one, same, other = (
        positions(run_scenario(chosen, tmp_path / "r.h5"))
        for chosen in (scenario, scenario, scenario.with_(simulation={"seed": 2}))
    )
    assert one.tobytes() == same.tobytes()
    assert np.abs(one - other).max() > 0.1


def test_isolated_components_give_the_same_numbers(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    apart = {name: {"isolation": "process", "timeout": 30.0} for name in ("wave", "platform")}
    one, same = (
        positions(run_scenario(chosen, tmp_path / "r.h5")) for chosen in (scenario, scenario.with_(components=apart))
    )
    assert one.tobytes() == same.tobytes()


def test_a_short_run_is_the_beginning_of_a_long_one(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    short = positions(run_scenario(scenario, tmp_path / "r.h5"))
    long = positions(run_scenario(scenario.with_(simulation={"duration": 30.0}), tmp_path / "r.h5"))
    assert long[:, : short.shape[1]].tobytes() == short.tobytes()


def test_only_chosen_signals_are_recorded(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file, ['outputs.signals=["platform.position.*", "wave.elevation"]'])
    results = run_scenario(scenario, tmp_path / "r.h5")
    assert results.signals("platform") == tuple(f"position.{degree}" for degree in DEGREES)
    assert results.signals("wave") == ("elevation",)


def test_steady_loads_leave_the_platform_where_it_starts(scenario_file: Path, tmp_path: Path) -> None:
    """With tiny waves and no wind the platform starts in the equilibrium of the current's drag, and stays.

    Drag ends at mean water level here: the start does not know how much deeper setdown takes the columns.
    """
    settings = ['components.wind.fmu=""', "waves.significant_height=1e-9", "waves.splash=false", "current.speed=1.5"]
    scenario = Scenario.load(scenario_file, settings)
    moved = positions(run_scenario(scenario, tmp_path / "r.h5"))
    assert np.hypot(*moved[:2, 0]) > 1.0
    # Rest within the tolerance of the equilibrium; a start at the origin would move by centimetres in 20 s.
    np.testing.assert_allclose(moved, moved[:, :1] * np.ones((1, moved.shape[1])), atol=1e-6)


def test_start_at_rest_is_at_the_origin(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file, ["simulation.start=rest"])
    assert not positions(run_scenario(scenario, tmp_path / "r.h5"))[:, 0].any()


def test_tensions_are_those_of_the_position(scenario_file: Path, tmp_path: Path) -> None:
    """The recorded tensions against the tethers' geometry, taken anew from the recorded positions."""
    results = run_scenario(Scenario.load(scenario_file), tmp_path / "r.h5")
    surge, sway, heave, roll, pitch, yaw = positions(results)[:, -1]
    rotation = np.array([[1.0, -yaw, pitch], [yaw, 1.0, -roll], [-pitch, roll, 1.0]])  # to first order
    for index in (0, 3, 6, 9):
        corner = np.array([*issc_tlp.COLUMN_CENTRES[index // 3], -35.0])
        line = np.linalg.norm(rotation @ corner + [surge, sway, heave] - [*corner[:2], -450.0])
        stiffness, pretension = 3.37e11 / 12, 14.0e6 * 9.80665 / 12
        tension = stiffness * (line * (1.0 + pretension / stiffness) / 415.0 - 1.0)
        recorded = results.signal(f"platform.tendon_tension[{index + 1}]")[-1]
        assert recorded == pytest.approx(tension, rel=0.02)  # second-order rotations move a corner by 43 yaw²/2


@pytest.mark.parametrize(("filter_name", "bound"), [("cubic", 0.02), ("quintic", 0.02), ("linear", 0.03)])
def test_multi_rate_motion_follows_that_of_one_fine_rate(tmp_path: Path, filter_name: str, bound: float) -> None:
    """Short form of benchmarks/chain.py: rms difference relative to the fine motion's spread."""
    settings = ["simulation.duration=300", "waves.components=100", f"coupling.filter={filter_name}"]
    path = tmp_path / "s.toml"
    path.write_text("")
    fine = positions(
        run_scenario(
            Scenario.load(path, [*settings, "components.wave.step=0.1", "components.wind.step=0.1"]), tmp_path / "r.h5"
        )
    )
    coarse = positions(run_scenario(Scenario.load(path, settings), tmp_path / "r.h5"))
    difference = np.sqrt(np.mean((coarse - fine)[:3] ** 2, axis=1)) / fine[:3].std(axis=1)
    assert difference.max() < bound


def test_a_renamed_fmu_takes_a_components_place(scenario_file: Path, tmp_path: Path) -> None:
    build(tmp_path, ["wave"])
    (tmp_path / "wave.fmu").rename(tmp_path / "vendor.fmu")
    standard = run_scenario(Scenario.load(scenario_file), tmp_path / "r.h5")
    swapped = run_scenario(Scenario.load(scenario_file, ["components.wave.fmu=vendor.fmu"]), tmp_path / "s.h5")
    assert swapped.components["wave"]["sha256"] == standard.components["wave"]["sha256"]
    assert positions(swapped).tobytes() == positions(standard).tobytes()


def test_map_gives_an_fmus_own_names(scenario_file: Path, tmp_path: Path) -> None:
    """The wave FMU's elevation in place of the wind force in heave, by the map alone."""
    with assembled(
        Scenario.load(
            scenario_file,
            [
                'components.wave.map={"force.surge" = "diffraction.surge"}',
                "components.wave.parameters={seed = 5}",
            ],
        )
    ) as assembly:
        sources = {
            f"{c.target}.{c.target_variable}": c.source_variable
            for c in assembly.system.connections
            if c.source == "wave"
        }
        wave = next(c for c in assembly.system.components if c.name == "wave")
    assert sources["platform.wave_force.surge"] == "diffraction.surge"
    assert sources["platform.wave_force.sway"] == "force.sway"
    assert wave.parameters["seed"] == 5


def test_site_reaches_the_fmus(scenario_file: Path) -> None:
    # Another depth asks for another database, which takes its time; the site does not depend on it.
    changes = ["site.water_depth=900", "site.water_density=1000", "platform.hydrodynamics=morison"]
    scenario = Scenario.load(scenario_file, changes)
    with assembled(scenario) as assembly:
        parameters = {component.name: component.parameters for component in assembly.system.components}
    assert parameters["wave"]["water_depth"] == 900.0
    assert '"anchors": [[43.125, 43.125, -900.0]' in str(parameters["platform"]["tendons"])
    assert parameters["platform"]["water_density"] == 1000.0


def test_one_key_gives_both_fmus_their_hydrodynamics(scenario_file: Path, tmp_path: Path) -> None:
    write(issc_database(), tmp_path / "hull.h5")
    for name, own, words in (
        ("issc_tlp", "", "database of issc_tlp for 450 m, 1025 kg/m3"),
        ("hull.h5", str(tmp_path / "hull.h5"), f"hydrodynamics: {tmp_path / 'hull.h5'}; radiation: state_space"),
        ("morison", "morison", "Morison's inertia force and constant added mass"),
    ):
        changes = [f"platform.hydrodynamics={name}", "platform.radiation=state_space"]
        with assembled(Scenario.load(scenario_file, changes)) as assembly:
            parameters = {component.name: component.parameters for component in assembly.system.components}
        assert parameters["wave"]["hydrodynamics"] == parameters["platform"]["hydrodynamics"] == own
        assert parameters["platform"]["radiation"] == "state_space"
        assert words in assembly.notes[0]


def test_radiation_damps_the_waves_motion(scenario_file: Path, tmp_path: Path) -> None:
    """The three memories through the FMUs: the filters agree with each other, and differ from none at all."""
    moved = {
        kind: positions(
            run_scenario(
                Scenario.load(scenario_file, ["simulation.duration=200", f"platform.radiation={kind}"]),
                tmp_path / "r.h5",
            )
        )[:3]
        for kind in ("convolution", "state_space", "none")
    }
    spread = moved["convolution"].std(axis=1)
    apart = {kind: np.abs(moved[kind] - moved["convolution"]).max(axis=1) / spread for kind in moved}
    # 2 % of the transfer function is a few thousandths of the motion, which is mostly that of mass and mooring.
    assert apart["state_space"].max() < 0.02
    assert apart["none"].max() > 0.05


class Fault(Observer):
    """Breaks the run at a time."""

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] >= 10**10:
            raise StepError("broken on purpose")


def test_a_failed_run_keeps_its_samples_and_the_old_results(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    first = run_scenario(scenario, tmp_path / "r.h5")
    with pytest.raises(StepError, match=r"broken on purpose; the samples so far are in .*r\.h5\.part"):
        run_scenario(scenario.with_(title="Broken"), tmp_path / "r.h5", [Fault()])
    assert open_results(tmp_path / "r.h5").title == first.title
    part = open_results(tmp_path / "r.h5.part")
    assert part.status.startswith("failed: broken on purpose")
    assert part.time("platform")[-1] >= 9.0


BAD: list[tuple[type[Exception], str, str]] = [
    (FmuError, "components.wave.fmu=nowhere.fmu", r"nowhere\.fmu"),
    (WiringError, "components.wave.parameters={significant_heigth = 3.0}", "nearest match: 'significant_height'"),
    (WiringError, 'connections={"platform.wave_force.surge"={from="wave.force.sruge"}}', "nearest match.*force.surge"),
    (WiringError, 'connections={"wind.velocity.surge"={from="platform.position.surge"}}', "in m and .*in m/s"),
    (ScenarioError, "platform.hydrodynamics=nowhere.h5", r"components\.wave: .*nowhere\.h5"),
    (ScenarioError, "waves.hs=3", "waves.hs: unknown key"),
    (ScenarioError, 'wind.speed="20 kg"', "'kg' is not a unit of speed"),
    (ScenarioError, "components.wave.step=0.35", "step"),
]


@pytest.mark.parametrize(("error", "setting", "message"), BAD, ids=[setting for _, setting, _ in BAD])
def test_bad_input_is_told_in_one_line_and_leaves_nothing(
    scenario_file: Path, tmp_path: Path, error: type[Exception], setting: str, message: str
) -> None:
    with pytest.raises(error, match=message) as caught:
        run_scenario(Scenario.load(scenario_file, [setting]), tmp_path / "r.h5")
    assert "\n" not in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["short.toml"]


def test_equilibrium_of_the_default_storm_is_near_the_mean_of_the_motion() -> None:
    # The motion's own mean has wave drag besides; the equilibrium must be that of mean wind and current alone.
    force = np.array([1.7e6, 1.45e6, 0.0, -6.5e7, 7.6e7, 2.2e7])
    position = static_equilibrium(issc_tlp.platform(), force)
    assert position[0] == pytest.approx(force[0] / (14.0e6 * 9.80665 / 415.0), rel=0.01)


@pytest.mark.parametrize("switch", [True, False])
def test_equilibrium_is_that_of_the_wind_at_its_own_yaw(switch: bool) -> None:
    box = {"position": [20.0, -15.0, 40.0], "size": [90.0, 30.0, 20.0], "shape_coefficient": 1.2}
    scenario = Scenario.from_dict(
        {
            "wind": {"speed": 35.0, "boxes": [box], "yaw_dependent_area": switch},
            "waves": {"significant_height": 0.0},
            "current": {"speed": 0.0},
        }
    )
    found = twin(scenario)
    assert found.model.wind is not None
    forces = [found.model.wind.mean_force(yaw) for yaw in (0.0, found.position[5])]
    np.testing.assert_allclose(static_equilibrium(found.model.platform, forces[1]), found.position, atol=1e-8)
    # b = l |sin| + w |cos| over that at zero yaw.
    breadth = [90.0 * np.sin(angle) + 30.0 * np.cos(angle) for angle in np.radians(34.5) - [0.0, found.position[5]]]
    assert found.position[5] > 0.03
    assert forces[1][0] / forces[0][0] == pytest.approx(breadth[1] / breadth[0] if switch else 1.0, rel=1e-12)
