"""Tables in a scenario, the section [coupling], and what --coupling, check and info say of systems."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError, TlpsimError, WiringError
from tlpsim.orchestrator.system import Adaptation, Iteration
from tlpsim.orchestrator.table import write_table
from tlpsim.scenarios.assemble import assembled
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.generic import export
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario


def tlpsim(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": "120"})
    assert result.exit_code == code, result.output + str(result.exception)
    return " ".join(result.output.split())


def wind_table(results: Results, path: Path) -> None:
    """The wind force of a run in kN."""
    names = [f"force.{degree}" for degree in DEGREES_OF_FREEDOM]
    units = {name: "kN" if i < 3 else "kN.m" for i, name in enumerate(names)}
    signals = {name: 1e-3 * results.signal(f"wind.{name}") for name in names}
    write_table(path, results.time("wind"), signals, units)


@pytest.mark.parametrize(("name", "tolerance"), [("linear", 1e-10), ("cubic", 5e-3)])
def test_a_table_of_the_recorded_wind_gives_the_same_motion(
    scenario_file: Path, tmp_path: Path, name: str, tolerance: float
) -> None:
    """By lines exactly so but for rounding; by the cubic filter, which looks ahead now, to 0.5 % of the range."""
    settings = ["simulation.start=rest", "simulation.duration=60", f"coupling.filter={name}"]
    base = Scenario.load(scenario_file, settings)
    computed = run_scenario(base, tmp_path / "computed.h5")
    wind_table(computed, tmp_path / "wind.csv")
    (tmp_path / "replayed.toml").write_text(scenario_file.read_text() + '[components.wind]\nfmu = "wind.csv"\n')
    replayed = run_scenario(Scenario.load(tmp_path / "replayed.toml", settings), tmp_path / "replayed.h5")
    assert replayed.unit("wind.force.surge") == "kN"
    for degree in ("surge", "sway", "yaw"):
        one, other = (each.signal(f"platform.position.{degree}") for each in (computed, replayed))
        np.testing.assert_allclose(other, one, atol=tolerance * np.ptp(one))


def test_a_table_in_a_scenario_needs_the_columns_that_are_connected(scenario_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("time [s], force.surge [kN]\n0, 1\n100, 2\n")
    entry = {"components": {"wind": {"fmu": str(path), "parameters": {"beyond": "error"}}}}
    with pytest.raises(WiringError, match=r"'wind' has no variable 'force.sway'"), assembled(Scenario.from_dict(entry)):
        pass
    only = {"platform.wind_force.*": {"from": ""}, "platform.wind_force.surge": {"from": "wind.force.surge"}}
    with assembled(Scenario.from_dict({**entry, "connections": only})) as assembly:
        assert not any(each.target == "wind" for each in assembly.system.connections)
        assert sum(each.source == "wind" for each in assembly.system.connections) == 1
    with pytest.raises(ScenarioError, match=r"must be the path of an .fmu file, of a table \(.csv\) or one of builtin"):
        Scenario.from_dict({"components": {"wind": {"fmu": "wind.txt"}}})


def test_a_table_on_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text("time [s], y [kN]\n0, 1\n0.5, 2\n1, 3\n1.5, 4\n")
    told = tlpsim("run", tmp_path / "load.csv", "--stop", "1", "-o", tmp_path / "r.h5")
    assert "load.y" in told
    assert open_results(tmp_path / "r.h5").signal("load.y").tolist() == [1.0, 2.0, 3.0]
    (tmp_path / "load.csv").write_text("time [s], y [kN]\n0, 1\n0.5, 2\n2, 3\n")
    result = CliRunner().invoke(app, ["run", str(tmp_path / "load.csv"), "--stop", "1", "-o", str(tmp_path / "r.h5")])
    assert isinstance(result.exception, TlpsimError)
    assert "its table has no default step; give one with --step" in str(result.exception)


def test_the_section_coupling_reaches_the_master(scenario_file: Path) -> None:
    settings = [
        "coupling.algorithm=iterative",
        "coupling.iteration.tolerance=1e-7",
        "coupling.iteration.acceleration=aitken",
        "coupling.adaptation.longest=8",
    ]
    with assembled(Scenario.load(scenario_file, settings)) as assembly:
        assert assembly.system.algorithm == "iterative"
        assert assembly.system.iteration == Iteration(tolerance=1e-7, acceleration="aitken")
        assert assembly.system.adaptation == Adaptation(longest=8)
    for setting, words in (
        ("coupling.algorithm=jacobi", "must be 'multirate', 'sequential', 'parallel', 'iterative' or 'adaptive'"),
        ("coupling.iteration.tolerance=1.0", "must be less than 1"),
        ("coupling.iteration.steps=1", "unknown key; the keys here are tolerance, most, acceleration"),
    ):
        with pytest.raises(ScenarioError, match=words):
            Scenario.load(scenario_file, [setting])


def test_iterated_loop_and_anti_alias_filter_in_a_scenario(scenario_file: Path, tmp_path: Path) -> None:
    """Both leave the motion of the short run as it is, to a few percent."""
    settings = ["simulation.start=rest"]
    plain = run_scenario(Scenario.load(scenario_file, settings), tmp_path / "a.h5").signal("platform.position.surge")
    for changes in (
        {"coupling": {"algorithm": "iterative"}},
        {"connections": {"wind.velocity.surge": {"from": "platform.velocity.surge", "filter": "anti_alias"}}},
    ):
        other = run_scenario(Scenario.load(scenario_file, settings).with_(**changes), tmp_path / "b.h5")
        surge = other.signal("platform.position.surge")
        assert 0.0 < np.abs(surge - plain).max() < 0.05 * np.ptp(plain)


def test_check_and_info_of_a_system_description(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file, ["coupling.algorithm=iterative", "coupling.iteration.most=7"])
    path = export(scenario, tmp_path / "short.ssp")
    told = tlpsim("check", path)
    for words in ("Short: components", "platform.fmu", "wave.force.surge", "The system is valid"):
        assert words in told
    told = tlpsim("info", path)
    assert "Short: components" in told
    assert "valid" not in told
    result = CliRunner().invoke(app, ["check", str(path), "--seed", "1"])
    assert "--seed and --duration are for scenarios" in str(result.exception)


def test_coupling_before_and_after_a_run(scenario_file: Path, tmp_path: Path) -> None:
    told = tlpsim("check", scenario_file, "--coupling", "--band", "0.05")
    for words in ("a band to 0.05 cycles", "wind.force.*", "cubic, causal", "2 derivatives +0.5 s"):
        assert words in told
    told = tlpsim("run", scenario_file, "-o", tmp_path / "r.h5", "--coupling")
    assert "coupling, measured" in told
    assert "platform.velocity.surge -> wind.velocity.surge" in told
    result = CliRunner().invoke(app, ["run", str(scenario_file), "-o", "r.h5", "--coupling", "--monolithic"])
    assert "--coupling measures connections, and a monolithic run has none" in str(result.exception)
