"""The monolithic run against the co-simulation of the same scenario, and what it refuses."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, write_quadratic_transfer
from tlpsim.loads.errors import ScenarioError, StepError, WiringError
from tlpsim.loads.hydro.excitation import PARTS, ROWS, WaveForces
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.monolithic import twin
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import summary

DEGREES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def positions(results: Results) -> np.ndarray:
    return np.array([results.signal(f"platform.position.{degree}") for degree in DEGREES])


def test_outputs_units_and_times_are_those_of_the_co_simulation(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    coupled = run_scenario(scenario, tmp_path / "c.h5")
    alone = run_scenario(scenario, tmp_path / "m.h5", monolithic=True)
    assert tuple(alone.components) == tuple(coupled.components)
    assert alone.seeds == coupled.seeds
    for component in coupled.components:
        np.testing.assert_array_equal(alone.time(component), coupled.time(component))
        assert alone.signals(component) == coupled.signals(component)
        for name in (f"{component}.{variable}" for variable in coupled.signals(component)):
            assert (alone.unit(name), alone.description(name)) == (coupled.unit(name), coupled.description(name))
    # At the start nothing is coupled yet: every output is the same function of the same place and time.
    for component in coupled.components:
        for name in (f"{component}.{variable}" for variable in coupled.signals(component)):
            one, other = alone.signal(name), coupled.signal(name)
            assert one[0] == pytest.approx(other[0], rel=1e-9, abs=1e-9 * np.abs(other).max() + 1e-12), name


def test_the_file_says_that_it_is_monolithic(scenario_file: Path, tmp_path: Path) -> None:
    run_scenario(Scenario.load(scenario_file), tmp_path / "m.h5", monolithic=True)
    with h5py.File(tmp_path / "m.h5") as file:
        assert file.attrs["run"] == "monolithic"
        assert {group.attrs["run"] for group in file.values()} == {"monolithic"}
    results = open_results(tmp_path / "m.h5")
    assert results.complete
    assert {name: int(group["steps"]) for name, group in results.components.items()} == {
        "wind": 20,
        "wave": 40,
        "platform": 200,
    }


def test_co_simulation_is_close_to_the_monolithic_run(tmp_path: Path) -> None:
    """Short form of benchmarks/monolithic.py.

    The coupling's error in the forces is that of interpolation from 0.5 s and of extrapolation over 0.5 s, about
    (omega h)³/6: 2e-3 at the peak of the waves, 0.1 of the little that they have at 0.3 Hz. Roll and pitch, of a
    natural period of 1.9 s, show most of that. Standard deviations add as squares, to thousandths.
    """
    scenario = Scenario.from_dict({"simulation": {"duration": 300.0}, "outputs": {"statistics_from": 60.0}})
    coupled = run_scenario(scenario, tmp_path / "c.h5")
    alone = run_scenario(scenario, tmp_path / "m.h5", monolithic=True)
    difference = (positions(coupled) - positions(alone)).std(axis=1) / positions(alone).std(axis=1)
    # The two differ by the coupling, and by no more than it can be.
    assert difference.min() > 1e-6
    assert difference[[0, 1, 2, 5]].max() < 0.015
    assert difference[[3, 4]].max() < 0.05
    found, reference = summary(coupled), summary(alone)
    for one, other in zip(found.motions, reference.motions, strict=True):
        assert one.std == pytest.approx(other.std, rel=5e-3), one.name
        assert one.wave_frequency == pytest.approx(other.wave_frequency, rel=5e-3), one.name
    assert found.tensions is not None
    assert reference.tensions is not None
    assert found.tensions.maximum == pytest.approx(reference.tensions.maximum, rel=0.01)


def test_finer_steps_of_the_co_simulation_come_closer(tmp_path: Path) -> None:
    scenario = Scenario.from_dict({"simulation": {"duration": 100.0}})
    alone = positions(run_scenario(scenario, tmp_path / "r.h5", monolithic=True))
    errors = []
    for step in (0.5, 0.1):
        finer = scenario.with_(components={"wind": {"step": step}, "wave": {"step": step}})
        errors.append(np.abs(positions(run_scenario(finer, tmp_path / "r.h5")) - alone).max(axis=1))
    # What an extrapolation of third order leaves at a fifth of the step is small beside what it leaves at the whole.
    assert np.all(errors[1] < 0.3 * errors[0])


@pytest.mark.parametrize(
    "settings",
    [
        ['components.wind.fmu=""'],
        ['components.wave.fmu=""'],
        ["wind.speed=0", "waves.significant_height=0"],
        ["waves.generator=harmonic", "wind.decomposition=expanded"],
        ["wind.decomposition=linear", "platform.radiation=none"],
        ["waves.directions=3", "waves.sampling_step=0.7"],
        ["components.platform.step=0.5", "platform.hydrodynamics=morison", "simulation.start=rest"],
        ["components.platform.parameters={\"external_force.surge\" = 1e6, \"free.yaw\" = false}"],
    ],
    ids=lambda settings: settings[0],
)  # fmt: skip
def test_every_kind_of_scenario_runs_compiled(
    scenario_file: Path, tmp_path: Path, settings: list[str], recwarn: pytest.WarningsRecorder
) -> None:
    """Against the co-simulation at the steps of the platform, where 20 s of motion differ by little."""
    scenario = Scenario.load(scenario_file, settings)
    step = scenario.components["platform"].step
    finer = scenario.with_(components={name: {"step": step} for name in scenario.components})
    coupled = positions(run_scenario(finer, tmp_path / "c.h5"))
    alone = positions(run_scenario(finer, tmp_path / "m.h5", monolithic=True))
    assert not [warning for warning in recwarn if issubclass(warning.category, RuntimeWarning)]
    size = np.array([1.0, 1.0, 0.01, 1e-3, 1e-3, 1e-2])  # m and rad, of the motions in a storm
    assert np.abs(alone).max() > 0.0
    # A step of extrapolation in the co-simulation: (omega h)³ of the damping forces, at 0.5 s a hundredth.
    assert (np.abs(coupled - alone).max(axis=1) / size).max() < (0.002 if step < 0.2 else 0.05)


def test_a_quadratic_transfer_function_drives_both(scenario_file: Path, tmp_path: Path) -> None:
    """Its drift is in both runs, and its mean in the position at the start."""
    omega = np.linspace(0.15, 2.3, 40)
    transfer = np.zeros((1, 40, 40, 6), dtype=np.complex128)
    transfer[..., 0] = 3e5
    table = QuadraticTransfer(omega=omega, heading=np.radians([21.6]), transfer=transfer)
    write_quadratic_transfer(table, tmp_path / "qtf.h5")
    settings = ["waves.drift=qtf", "waves.quadratic_transfer=qtf.h5", "components.wave.step=0.1"]
    settings += ["waves.displaced_position=false"]  # beside which the drift is whole
    scenario = Scenario.load(scenario_file, settings)
    results = [run_scenario(scenario, tmp_path / "r.h5", monolithic=alone) for alone in (True, False)]
    forces = [each.signal("wave.drift.surge") for each in results]
    assert forces[0].min() > 0.0  # the square of an envelope
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-3)
    rest = twin(scenario.with_(waves={"drift": "none", "quadratic_transfer": None})).position[0]
    mean = 3e5 * 7.08**2 / 8.0 / (twin(scenario).position[0] - rest)
    # N/m of the tethers at an offset of some 10 m, which the setdown stiffens.
    assert 2.0e5 < mean < 4.0e5


def test_same_seed_same_bits(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    one, same, other = (
        positions(run_scenario(chosen, tmp_path / "r.h5", monolithic=True))
        for chosen in (scenario, scenario, scenario.with_(simulation={"seed": 2}))
    )
    assert one.tobytes() == same.tobytes()
    assert np.abs(one - other).max() > 0.1


def test_all_parts_of_the_wave_force_are_in_the_loop() -> None:
    """A part that is added to the waves' forces has its place in the kernel, and in the outputs of the FMU."""
    parts = {field.name for field in dataclasses.fields(WaveForces)} - {"elevation"}
    assert parts == set(PARTS)
    rows = sorted(k for part in PARTS.values() for k in range(part.start, part.stop))
    assert rows == list(range(1, ROWS))
    outputs = {each.name.partition(".")[0] for each in TlpsimWave.table if each.causality == "output"}
    assert outputs == parts | {"force", "elevation"}


def test_the_air_gap_takes_the_waves_where_they_are_connected(scenario_file: Path) -> None:
    wired = ['connections={"platform.elevation"={from="wave.elevation"}}']
    assert twin(Scenario.load(scenario_file, wired)).elevation is None


BAD: list[tuple[type[Exception], str, str]] = [
    (ScenarioError, "components.wave.fmu=vendor.fmu", r"components\.wave: .*vendor\.fmu cannot be part"),
    (ScenarioError, 'components.wave.map={"elevation" = "eta"}', r"components\.wave\.map"),
    (ScenarioError, 'components.platform.fmu=""', r"components\.platform: .*needs the platform"),
    (ScenarioError, 'connections={"wind.velocity.surge"={from=""}}', r"wind\.velocity\.surge comes from nowhere"),
    (
        ScenarioError,
        'connections={"platform.wave_force.surge"={from="wave.diffraction.surge"}}',
        r"platform\.wave_force\.surge comes from wave\.diffraction\.surge, and .*wave\.force\.surge",
    ),
    (WiringError, "components.wave.parameters={significant_heigth = 3.0}", "nearest match: 'significant_height'"),
    (ScenarioError, "components.wind.parameters={roughness = -1.0}", r"components\.wind: .*roughness"),
]


@pytest.mark.parametrize(("error", "setting", "message"), BAD, ids=[setting for _, setting, _ in BAD])
def test_what_cannot_run_is_refused_in_one_line(
    scenario_file: Path, tmp_path: Path, error: type[Exception], setting: str, message: str
) -> None:
    with pytest.raises(error, match=message) as caught:
        run_scenario(Scenario.load(scenario_file, [setting]), tmp_path / "r.h5", monolithic=True)
    assert "\n" not in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["short.toml"]


class Fault(Observer):
    """Breaks the run at a time."""

    def sampled(self, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] >= 10**10:
            raise StepError("broken on purpose")


def test_a_failed_run_keeps_its_samples(scenario_file: Path, tmp_path: Path) -> None:
    with pytest.raises(StepError, match=r"broken on purpose; the samples so far are in .*r\.h5\.part"):
        run_scenario(Scenario.load(scenario_file), tmp_path / "r.h5", [Fault()], monolithic=True)
    assert open_results(tmp_path / "r.h5.part").status.startswith("failed: broken on purpose")


def test_motion_without_solution_is_told_with_its_time(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file, ['components.platform.parameters={"external_force.yaw" = 1e30}'])
    with pytest.raises(StepError, match=r"at t = 0\.1 s: platform motion did not converge"):
        run_scenario(scenario.with_(simulation={"start": "rest"}), tmp_path / "r.h5", monolithic=True)


def test_command_line(scenario_file: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", "run", str(scenario_file), "-o", str(tmp_path / "m.h5")]
    done = subprocess.run([*command, "--monolithic"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "surge, m" in done.stdout
    assert "(monolithic)" in done.stdout
